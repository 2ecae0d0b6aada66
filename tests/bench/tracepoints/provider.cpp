// The bare tracepoints, and one loop of each.
#define LTTNG_UST_TRACEPOINT_CREATE_PROBES
#define LTTNG_UST_TRACEPOINT_DEFINE
#include "provider.h"

#include "bare.hpp"

namespace cie::bench {

void bare_release(std::uint64_t count) {
  for (std::uint64_t i = 0; i < count; ++i) {
    lttng_ust_tracepoint(cie_bare, callback_release, 1, i, 0);
  }
}
void bare_wakeup(std::uint64_t count) {
  for (std::uint64_t i = 0; i < count; ++i) {
    lttng_ust_tracepoint(cie_bare, thread_wakeup, 1, 0);
  }
}
void bare_start(std::uint64_t count) {
  for (std::uint64_t i = 0; i < count; ++i) {
    lttng_ust_tracepoint(cie_bare, callback_start, 1, i, 1, 10, 0, 20, 30);
  }
}
void bare_end(std::uint64_t count) {
  for (std::uint64_t i = 0; i < count; ++i) {
    lttng_ust_tracepoint(cie_bare, callback_end, 1, i, 0);
  }
}
void bare_publish(std::uint64_t count) {
  for (std::uint64_t i = 0; i < count; ++i) {
    lttng_ust_tracepoint(cie_bare, publish, 1, i, static_cast<std::int64_t>(i));
  }
}

}  // namespace cie::bench
