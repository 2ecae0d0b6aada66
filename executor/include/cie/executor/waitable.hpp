// Runs a callback when the program says so. Made by Node::create_waitable.
#pragma once

#include <cie/tracepoints/schema.hpp>

#include <memory>
#include <string>
#include <utility>

namespace cie {

namespace executor {
class WaitableCallback;
}

// What a guard condition is in ROS 2: other threads, devices or libraries hand work over to a
// callback that an executor serves. May outlive its node; it then is idle.
class Waitable {
 public:
  explicit Waitable(std::shared_ptr<executor::WaitableCallback> callback)
      : callback_(std::move(callback)) {}

  // Makes one instance ready, released now. Triggers that come before it starts are one with it;
  // one that comes while it runs makes another. What the caller wrote before is seen by the
  // instance. Any thread; also a signal handler, unless several threads serve the callback
  // (MultiThreadedExecutor, a reentrant group) or Dispatch::wait_set: those take a lock.
  void trigger() noexcept;

  const std::string& logical_id() const noexcept;
  CallbackId id() const noexcept;

 private:
  std::shared_ptr<executor::WaitableCallback> callback_;
};

}  // namespace cie
