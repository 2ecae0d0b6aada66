#include "system/instant.hpp"

#include "base/clock.hpp"

namespace cie::record {

Instant now() { return {now_ns(CLOCK_MONOTONIC), now_ns(CLOCK_REALTIME)}; }

}  // namespace cie::record
