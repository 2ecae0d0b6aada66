// What the trace says of the end of a wait.
#pragma once

#include <cie/scheduling/wakeup.hpp>
#include <cie/tracepoints/schema.hpp>

namespace cie::scheduling {

// `is_guard`: the loop was to look at something else than its callbacks.
inline WakeupReason reason_of(WaitResult result, bool is_guard) noexcept {
  switch (result) {
    case WaitResult::timeout:
      return WakeupReason::timer;
    case WaitResult::signalled:
      return is_guard ? WakeupReason::guard : WakeupReason::data;
    default:
      return WakeupReason::spurious;
  }
}

}  // namespace cie::scheduling
