// A call that may take long, or never return.
#pragma once

#include <chrono>
#include <future>
#include <optional>
#include <thread>
#include <utility>

namespace cie::record {

// liblttng-ctl waits for its daemon without limit, and on a full disk a consumer daemon may spin
// instead of answering. So a thread of its own waits for LTTng, and whoever wants the answer for the
// thread, but not for ever. liblttng-ctl serves one thread at a time: nobody else may call it until
// this is done.
template <typename Result>
class LongCall {
 public:
  // `call` has to own what it uses, or share it: it may outlive this object.
  template <typename Function>
  explicit LongCall(Function call) {
    std::packaged_task<Result()> task(std::move(call));
    result_ = task.get_future();
    thread_ = std::thread(std::move(task));
  }
  // One that is not done ends with its connection, or with this process.
  ~LongCall() {
    if (!thread_.joinable()) return;
    is_done() ? thread_.join() : thread_.detach();
  }
  LongCall(const LongCall&) = delete;
  LongCall& operator=(const LongCall&) = delete;

  bool is_done(std::chrono::milliseconds patience = {}) const {
    return result_.wait_for(patience) == std::future_status::ready;
  }
  // Once, when it is done. Throws what the call threw.
  Result get() {
    thread_.join();
    return result_.get();
  }

 private:
  std::future<Result> result_;
  std::thread thread_;
};

// Of a call that is done, and forgotten thereby.
template <typename Result>
Result answer_of(std::optional<LongCall<Result>>& call) {
  const struct Forget {
    std::optional<LongCall<Result>>& call;
    ~Forget() { call.reset(); }
  } forget{call};
  return call->get();
}

}  // namespace cie::record
