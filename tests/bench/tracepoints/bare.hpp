// Loops over bare LTTng tracepoints, `count` events each.
#pragma once

#include <cstdint>

namespace cie::bench {

void bare_release(std::uint64_t count);
void bare_wakeup(std::uint64_t count);
void bare_start(std::uint64_t count);
void bare_end(std::uint64_t count);
void bare_publish(std::uint64_t count);

}  // namespace cie::bench
