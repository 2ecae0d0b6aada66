// What a child of fork() has of its parent: of that it tells nothing on the callback path either.
#pragma once

#include <cie/tracepoints/trace.hpp>

#include <atomic>
#include <cstdint>

namespace cie::trace {
namespace detail {
// Identities below these are the parent's. 0 outside a child.
extern std::atomic<std::uint32_t> first_own_callback;
extern std::atomic<std::uint32_t> first_own_publisher;
// False in a child until a run of its own begins: its threads may be those of an inherited executor.
extern std::atomic<bool> are_threads_own;
}  // namespace detail

inline bool is_own(CallbackId callback) noexcept {
  return to_number(callback) >= detail::first_own_callback.load(std::memory_order_relaxed);
}
inline bool is_own(PublisherId publisher) noexcept {
  return to_number(publisher) >= detail::first_own_publisher.load(std::memory_order_relaxed);
}
inline bool are_threads_own() noexcept {
  return detail::are_threads_own.load(std::memory_order_relaxed);
}

}  // namespace cie::trace
