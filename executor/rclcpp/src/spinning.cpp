// How long callbacks are served: until somebody cancels, as long as there is something, or once.
#include <cie/scheduling/clock.hpp>

#include "executor_state.hpp"

#include <algorithm>
#include <thread>
#include <utility>

namespace cie_rclcpp {

using cie::scheduling::kNever;
using cie::scheduling::monotonic_now;

std::function<void()> ExecutorState::cancel() const {
  return [core = std::weak_ptr{core_}, admission = admission_] {
    if (const auto alive = core.lock()) alive->cancel();
    admission->close();
  };
}

std::vector<std::shared_ptr<Admitted>> ExecutorState::all_admitted() const {
  std::vector<std::shared_ptr<Admitted>> all;
  for (const NodePtr& node : nodes()) {
    auto of_node = node->admitted();
    std::ranges::move(of_node, std::back_inserter(all));
  }
  return all;
}

// Their threads looked while none was let in.
void ExecutorState::wake_all() {
  for (const auto& each : all_admitted())
    each->wake();
}

void ExecutorState::spin(std::int64_t deadline_ns) {
  session_.end();
  prepare();
  changed_->notify();  // what is created from here on is found by the watcher, once it serves
  const std::shared_ptr<void> idle{nullptr, [this](void*) { admission_->wait_until_idle(); }};
  core_->spin(deadline_ns, [&](cie::scheduling::Cancellation& cancellation) {
    admission_->open([&cancellation] { return cancellation.is_cancelled(); });
    wake_all();
    cancellation.wait_until(deadline_ns);
    admission_->close();
  });
}

bool ExecutorState::run_round(
    const std::vector<std::pair<std::shared_ptr<Admitted>, std::uint64_t>>& waiting,
    std::int64_t deadline_ns) {
  session_.begin();
  if (!admission_->begin_round([this] { return !session_.goes_on(); })) {
    session_.rethrow();
    return false;
  }
  for (const auto& [each, instances] : waiting)
    each->let_in(instances);
  for (const auto& [each, instances] : waiting)
    each->wake();
  admission_->wait_for_round(deadline_ns);
  admission_->close();
  admission_->wait_until_idle();
  session_.rethrow();
  return session_.goes_on();
}

bool ExecutorState::spin_some(std::int64_t deadline_ns) {
  prepare();
  std::vector<std::pair<std::shared_ptr<Admitted>, std::uint64_t>> waiting;
  for (auto& each : all_admitted()) {
    if (const std::uint64_t instances = each->waiting(); instances > 0) {
      waiting.emplace_back(std::move(each), instances);
    }
  }
  return !waiting.empty() && run_round(waiting, deadline_ns);
}

void ExecutorState::spin_all(std::int64_t deadline_ns) {
  while (spin_some(deadline_ns) && monotonic_now() < deadline_ns) {
  }
}

void ExecutorState::spin_once(std::int64_t deadline_ns) {
  prepare();
  for (;;) {
    look_at_all();
    std::pair<std::shared_ptr<Admitted>, std::int64_t> first{nullptr, kNever};
    for (auto& each : all_admitted()) {
      if (const std::int64_t at = each->ready_at(); at < first.second) {
        first = {std::move(each), at};
      }
    }
    const std::int64_t now = monotonic_now();
    if (first.second <= now) {
      if (!run_round({{std::move(first.first), 1}}, kNever) || admission_->begun() > 0) return;
      continue;  // there was nothing in it
    }
    if (now >= deadline_ns) return;
    if (!session_.goes_on()) {
      session_.begin();
      if (!session_.goes_on()) return;
      continue;  // what came meanwhile tells nobody
    }
    admission_->wait_for_interest(std::min(deadline_ns, first.second));
    session_.rethrow();
    if (!session_.goes_on()) return;
  }
}

rclcpp::FutureReturnCode ExecutorState::spin_until(std::int64_t deadline_ns,
                                                   const WaitForFuture& wait_for_future) {
  using rclcpp::FutureReturnCode;
  constexpr std::chrono::nanoseconds kNow{0};
  constexpr std::chrono::milliseconds kSlice{10};  // until a cancel() is seen
  const auto is_complete = [&wait_for_future](std::chrono::nanoseconds time) {
    const auto status = wait_for_future(time);
    if (status == std::future_status::deferred) std::this_thread::sleep_for(time);
    return status == std::future_status::ready;
  };
  if (monotonic_now() >= deadline_ns) {  // what waits, as rclcpp's executors do
    spin_some(kNever);
    return is_complete(kNow) ? FutureReturnCode::SUCCESS : FutureReturnCode::TIMEOUT;
  }
  prepare();
  session_.begin();
  admission_->open([this] { return !session_.goes_on(); });
  wake_all();
  auto outcome = FutureReturnCode::INTERRUPTED;
  while (session_.goes_on()) {
    const std::chrono::nanoseconds left{deadline_ns - monotonic_now()};
    if (is_complete(std::clamp<std::chrono::nanoseconds>(left, kNow, kSlice))) {
      outcome = FutureReturnCode::SUCCESS;
      break;
    }
    if (left <= kNow) {
      outcome = FutureReturnCode::TIMEOUT;
      break;
    }
  }
  admission_->close();
  admission_->wait_until_idle();
  session_.rethrow();
  return outcome;
}

}  // namespace cie_rclcpp
