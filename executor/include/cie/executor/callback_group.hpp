// Callbacks that share a rule of exclusion, and under the isolated executor a thread.
#pragma once

#include <cie/tracepoints/schema.hpp>

#include <chrono>
#include <memory>
#include <string>

namespace cie {

namespace scheduling {
class GroupState;
}

// Made by Node::create_callback_group. Callbacks of a mutually exclusive group never overlap; those
// of a reentrant one may, even with themselves. A callback created without a group gets a mutually
// exclusive group of its own, which is what one thread per callback needs. A group lives as long as
// a handle to it or a callback in it.
class CallbackGroup {
 public:
  explicit CallbackGroup(std::shared_ptr<scheduling::GroupState> state)
      : state_(std::move(state)) {}
  GroupType type() const noexcept;
  GroupId id() const noexcept;
  const std::shared_ptr<scheduling::GroupState>& state() const noexcept { return state_; }

 private:
  std::shared_ptr<scheduling::GroupState> state_;
};

struct CallbackOptions {
  std::shared_ptr<CallbackGroup> group{};  // null: a group of its own
  std::string name{};                      // stands in the logical id's parentheses; may be empty
  std::chrono::nanoseconds deadline{0};    // declared response-time bound; 0: none
};

}  // namespace cie
