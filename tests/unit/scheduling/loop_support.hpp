// What the tests of the loops share: callbacks that are released by hand.
#pragma once

#include <cie/scheduling/clock.hpp>
#include <cie/scheduling/loop.hpp>

#include <atomic>
#include <functional>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

namespace cie::scheduling {

inline trace::CallbackInfo waitable_info() {
  trace::CallbackInfo info;
  info.logical_id = trace::unique_logical_id("/test@Waitable(x)");
  info.kind = CallbackKind::waitable;
  return info;
}

// Released as often as release() was called. `taking` is what it does before each instance.
class Counted final : public Callback {
 public:
  Counted(
      std::shared_ptr<GroupState> group, std::function<void()> function,
      std::function<void()> taking = [] {})
      : Callback(std::move(group), waitable_info()),
        function_(std::move(function)),
        taking_(std::move(taking)) {}
  bool run_one() override {
    int left = left_.load();
    do {
      if (left == 0) return false;
    } while (!left_.compare_exchange_weak(left, left - 1));
    taking_();
    if (!may_begin()) {
      ++left_;
      return false;
    }
    function_();
    return true;
  }
  std::int64_t next_due() const noexcept override { return kNever; }
  std::uint64_t queued() const noexcept override {
    return static_cast<std::uint64_t>(left_.load());
  }
  void serve(ReadySink* sink) override {
    sink_ = sink;
    if (sink != nullptr) sink->on_ready(*this);
  }
  void release() {
    ++left_;
    if (ReadySink* const sink = sink_; sink != nullptr) sink->on_ready(*this);
  }

 private:
  std::function<void()> function_;
  std::function<void()> taking_;
  std::atomic<int> left_{0};
  std::atomic<ReadySink*> sink_{nullptr};
};

// Asked when it is due, it does something.
class SlowToAsk final : public Callback {
 public:
  explicit SlowToAsk(std::function<void()> asked)
      : Callback(std::make_shared<GroupState>(kNoNode, GroupType::mutually_exclusive),
                 waitable_info()),
        asked_(std::move(asked)) {}
  bool run_one() override { return false; }
  std::int64_t next_due() const noexcept override {
    asked_();
    return kNever;
  }
  bool has_timer() const noexcept override { return true; }
  void serve(ReadySink*) override {}

 private:
  std::function<void()> asked_;
};

class NoFailures final : public FailureHandler {
 public:
  void on_failure(CallbackFailure) noexcept override { ++count; }
  operator LoopParts() noexcept { return {*this, cancellation}; }
  std::atomic<int> count{0};
  Cancellation cancellation;
};

inline std::shared_ptr<GroupState> group(GroupType type) {
  return std::make_shared<GroupState>(kNoNode, type);
}

struct RunningLoop {
  RunningLoop(Loop& running_loop, int threads) : loop(running_loop) {
    for (int i = 0; i < threads; ++i)
      workers.emplace_back([this] { loop.run(kNever); });
  }
  ~RunningLoop() {
    loop.stop();
    for (auto& worker : workers)
      worker.join();
  }
  Loop& loop;
  std::vector<std::thread> workers;
};

inline void wait_for(const std::atomic<int>& count, int value) {
  while (count < value)
    std::this_thread::yield();
}

}  // namespace cie::scheduling
