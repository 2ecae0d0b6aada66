// Memory that is there before it is needed: a page fault can cost milliseconds.
#pragma once

#include <cie/scheduling/options.hpp>

#include <cstddef>

namespace cie::scheduling {

// Keeps pages, and in the heap what is freed. For the whole process and for good. Returns 0 or an
// errno.
int lock_memory(LockMemory wish) noexcept;

// Touches the next `bytes` of the calling thread's stack. False, and nothing is done, if the stack
// has no room for them.
bool prefault_stack(std::size_t bytes) noexcept;

}  // namespace cie::scheduling
