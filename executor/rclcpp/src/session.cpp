#include "session.hpp"

#include <cie/scheduling/threads.hpp>

#include <utility>

namespace cie_rclcpp {

Session::Session(std::shared_ptr<cie::scheduling::ExecutorCore> core,
                 std::shared_ptr<Admission> admission)
    : core_(std::move(core)), admission_(std::move(admission)) {}

void Session::set(Stage stage) {
  const std::lock_guard lock{mutex_};
  stage_ = stage;
  changed_.notify_all();
}

void Session::run() noexcept {
  cie::scheduling::set_current_thread_name("cie-spin");
  try {
    core_->spin(cie::scheduling::kNever, [this](cie::scheduling::Cancellation& cancellation) {
      {
        const std::lock_guard lock{mutex_};
        cancellation_ = &cancellation;
      }
      set(Stage::serving);
      cancellation.wait_until(cie::scheduling::kNever);
      set(Stage::leaving);
      admission_->close();
    });
  } catch (...) {
    const std::lock_guard lock{mutex_};
    failure_ = std::current_exception();
  }
  set(Stage::ended);
  admission_->wake();
}

void Session::begin() {
  if (goes_on()) return;
  end();
  set(Stage::starting);
  thread_ = std::thread{[this] { run(); }};
  {
    std::unique_lock lock{mutex_};
    changed_.wait(lock, [this] { return stage_ != Stage::starting; });
  }
  rethrow();
}

bool Session::goes_on() const {
  const std::lock_guard lock{mutex_};
  return stage_ == Stage::serving && !cancellation_->is_cancelled();
}

void Session::rethrow() {
  if (goes_on()) return;
  if (thread_.joinable()) thread_.join();
  const std::lock_guard lock{mutex_};
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

// Cancelled under the lock, before it leaves by itself: so this cancels no other spin.
void Session::end() {
  {
    const std::lock_guard lock{mutex_};
    if (stage_ == Stage::serving) core_->cancel();
  }
  if (thread_.joinable()) thread_.join();
  rethrow();
}

void Session::abandon() noexcept {
  try {
    end();
  } catch (...) {  // whoever did not call again does not hear of it
  }
}

}  // namespace cie_rclcpp
