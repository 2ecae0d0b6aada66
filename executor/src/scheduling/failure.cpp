#include <cie/scheduling/failure.hpp>

#include <utility>

namespace cie {

std::string CallbackFailure::reason() const {
  try {
    std::rethrow_exception(exception);
  } catch (const std::exception& error) {
    return error.what();
  } catch (...) {
    return "an exception that is no std::exception";
  }
}

std::string CallbackFailure::text() const {
  const bool is_worker = callback == kNoCallback;
  return (is_worker ? "thread \"" : "callback \"") + logical_id + "\" threw: " + reason();
}

CallbackError::CallbackError(CallbackFailure failure)
    : std::runtime_error(failure.text()), failure_(std::move(failure)) {}

}  // namespace cie
