// The threads of this process as the kernel lists them.
#pragma once

#include <cie/tracepoints/trace.hpp>

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>

namespace cie::scheduling {

std::set<std::uint32_t> thread_ids();

// The name (comm) of a thread of this process; empty when it is gone.
std::string thread_name(std::uint32_t tid);

std::uint32_t current_tid() noexcept;

// An OS thread, or those of a team. Unlike a tid it is never given twice in a process.
enum class ThreadsId : std::uint64_t {};
ThreadsId new_threads_id() noexcept;
ThreadsId id_of_current_thread() noexcept;

// Bytes of a thread's name: Linux's TASK_COMM_LEN without the terminator.
inline constexpr std::size_t kMostThreadName = 15;

// What the thread of a callback can be called, so that `ps` and `top` show what it does: the
// beginnings of the node's name and of the topic or period, "lidar:100ms", "fusion:front/po".
std::string thread_label(const trace::CallbackInfo& info);

// Names the calling thread; what exceeds kMostThreadName bytes is cut off.
void set_current_thread_name(const std::string& name) noexcept;

}  // namespace cie::scheduling
