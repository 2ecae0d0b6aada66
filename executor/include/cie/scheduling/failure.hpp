// What happens when a function of the user's throws.
#pragma once

#include <cie/tracepoints/schema.hpp>

#include <exception>
#include <stdexcept>
#include <string>

namespace cie {

// A callback, or the function of a thread, ended by an exception.
struct CallbackFailure {
  CallbackId callback{};   // kNoCallback: a thread's function
  std::string logical_id;  // or the thread's name
  std::exception_ptr exception;

  // What the exception says of itself.
  std::string reason() const;
  // "callback \"/lidar@Timer(100000000)\" threw: no more fuel", or `thread "gnss" threw: …`.
  std::string text() const;
};

// Thrown by spin() where nothing handles exceptions: whose exception it was, and within it that
// exception (std::rethrow_if_nested, or failure().exception), of whatever type.
class CallbackError : public std::runtime_error, public std::nested_exception {
 public:
  // While the failure's exception is being handled.
  explicit CallbackError(CallbackFailure failure);
  const CallbackFailure& failure() const noexcept { return failure_; }

 private:
  CallbackFailure failure_;
};

namespace scheduling {

// Told of it, on the thread that ran the function. Outlives whatever runs functions.
class FailureHandler {
 public:
  FailureHandler() = default;
  FailureHandler(const FailureHandler&) = delete;
  FailureHandler& operator=(const FailureHandler&) = delete;
  virtual ~FailureHandler() = default;
  virtual void on_failure(CallbackFailure failure) noexcept = 0;
};

}  // namespace scheduling
}  // namespace cie
