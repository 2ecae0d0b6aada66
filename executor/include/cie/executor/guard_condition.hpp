// Runs a callback when the program says so. Made by Node::create_guard_condition.
#pragma once

#include <cie/executor/callback_handle.hpp>

namespace cie {

namespace executor {
class GuardConditionCallback;
}

// As in ROS 2: other threads, devices or libraries hand work over to a
// callback that an executor serves. It ends with the last copy of its handle. That may outlive the
// node; it then is idle, and trigger() does nothing.
class GuardCondition : public executor::CallbackHandle<executor::GuardConditionCallback> {
 public:
  using CallbackHandle::CallbackHandle;

  // Makes one instance ready, released now. Triggers that come before it starts are one with it;
  // one that comes while it runs makes another. What the caller wrote before is seen by the
  // instance. Any thread; also a signal handler, unless the executor is a baseline: those take locks of
  // DDS.
  void trigger() noexcept;
};

}  // namespace cie
