// What an executor is told of its threads: how many, how they run, and who hears of trouble.
#pragma once

#include <cie/scheduling/failure.hpp>
#include <cie/scheduling/problem.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>

namespace cie {

enum class OnError : std::uint8_t {
  refuse,  // spin(), add_node() and reload_spec() throw SchedulingRefused
  warn     // the handler is told, the callback runs as the kernel left it
};

// What happens when an audit finds a thread that somebody else gave other parameters.
enum class OnChange : std::uint8_t {
  report,      // the handler is told
  apply_again  // and the thread gets again what the spec says
};

// Whether the pages of the process stay in memory (mlockall), from spin() on and for good.
enum class LockMemory : std::uint8_t {
  no,
  on_fault,  // each page from its first use on
  all        // all pages, also those never used: 8 MB for the stack of every thread
};

struct ExecutorOptions {
  // Null: threads run as the kernel starts them. Callback threads of the isolated executor take the
  // entry of their callback's logical id; all other threads that of their name.
  std::shared_ptr<const SchedulingSpec> spec{};
  OnError on_error = OnError::refuse;
  // How often, while spinning, an ordinary thread reads every thread's parameters back, for the
  // trace and to find what was changed from outside; 0: never. Two system calls for each thread.
  std::chrono::nanoseconds audit_period = std::chrono::seconds{5};
  OnChange on_change = OnChange::report;
  // Called from the thread concerned, from that of the audit, from spin() or from reload_spec(),
  // one call at a time; must not call the executor. May be empty.
  std::function<void(const SchedulingProblem&)> on_scheduling_problem{};
  // Called on the thread of the callback; spinning goes on. Empty: the executor stops, and spin()
  // throws a CallbackError with the first exception in it. So it does when this throws.
  std::function<void(const CallbackFailure&)> on_exception{};
  // Both are asked for under OnError as scheduling parameters are. RLIMIT_MEMLOCK or CAP_IPC_LOCK
  // is needed to lock.
  LockMemory lock_memory = LockMemory::no;
  // Bytes of its stack that each thread of callbacks touches before it first waits, so that they
  // cost no page fault later; with `lock_memory` they then stay.
  std::size_t prefault_stack = 0;
  // Threads of a reentrant group under the isolated executor, and of MultiThreadedExecutor (there
  // 0 means one for each CPU the process may use, at least 2).
  unsigned reentrant_threads = 4;
  unsigned threads = 0;
};

}  // namespace cie
