// Executors decide which thread runs which callback.
#pragma once

#include <cie/executor/node.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>
#include <cie/tracepoints/schema.hpp>

#include <array>
#include <chrono>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cie {

namespace executor {
class ExecutorCore;
}

// A thread does not run as the spec says.
struct ParameterProblem {
  std::string file{};   // the spec's name
  int line = 0;         // 1-based; of the entry
  std::string entry{};  // its id
  std::string thread{};
  int error = 0;  // errno of the refused request; 0: accepted, but another value was read back
  std::string reason{};  // in words, with the remedy
  // An audit found it: the thread ran as asked, until somebody else changed it.
  bool is_from_outside = false;

  // "demo.yaml:12: \"/lidar@Timer(100000000)\": cannot set SCHED_FIFO 80: … ".
  std::string text() const;
};

// Thrown under OnError::refuse: by spin() and add_node() before any callback of the threads
// concerned runs, by reload_spec() after everything is as it was.
class ParametersRefused : public std::runtime_error {
 public:
  explicit ParametersRefused(std::vector<ParameterProblem> problems);
  const std::vector<ParameterProblem>& problems() const noexcept { return problems_; }

 private:
  std::vector<ParameterProblem> problems_;
};

// A callback, or a worker's function, ended by an exception.
struct CallbackFailure {
  CallbackId callback{};   // kNoCallback: a worker
  std::string logical_id;  // or the worker's name
  std::exception_ptr exception;
};

enum class OnError : std::uint8_t {
  refuse,  // spin(), add_node() and reload_spec() throw ParametersRefused
  warn     // the handler is told, the callback runs as the kernel left it
};

// How the threads of an executor wait, and find what they are to run.
enum class Dispatch : std::uint8_t {
  lean,     // on one futex word each, or on one queue for several
  wait_set  // as rclcpp does, on DDS wait sets that are collected anew for every wait: a baseline
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
  Dispatch dispatch = Dispatch::lean;
  // Null: threads run as the kernel starts them. Callback threads of the isolated executor take the
  // entry of their callback's logical id; all other threads that of their name.
  std::shared_ptr<const SchedulingSpec> spec{};
  OnError on_error = OnError::refuse;
  // How often, while spinning, an ordinary thread reads every thread's parameters back, for the
  // trace and to find what was changed from outside; 0: never. Two system calls for each thread.
  std::chrono::nanoseconds audit_period = std::chrono::seconds{5};
  OnChange on_change = OnChange::report;
  // Called from the thread concerned, from that of the audit or from reload_spec(), one call at a
  // time; must not call the executor. May be empty.
  std::function<void(const ParameterProblem&)> on_parameter_problem{};
  // Called on the thread of the callback; spinning goes on. Empty: the executor stops, and spin()
  // throws the exception.
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

template <typename F>
concept WorkerFunction = std::invocable<F&, std::stop_token> || std::invocable<F&>;

// What all executors share. Every function may be called from any thread. Wrong use throws
// std::logic_error: a node in two executors or twice in one, spin() while spinning, remove_node()
// of a stranger or from a callback that it would have to wait for.
class Executor {
 public:
  virtual ~Executor();  // cancels; must not run while spin() has not returned
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;

  // Serves the node's callbacks, those it has and those it gets, while spinning. The node must
  // outlive its membership; its destructor ends that.
  void add_node(Node& node);
  // Returns when no callback of the node runs any more: bounded by the longest one.
  void remove_node(Node& node);
  // Serves callbacks until cancel(); then waits for the running ones and joins all threads.
  // A cancel() that came before makes the next spin() return at once.
  void spin();
  void spin_for(std::chrono::nanoseconds duration);
  // Async-signal-safe.
  void cancel() noexcept;

  // Starts a thread outside DDS: a driver's, a logger's. It is named, announced (role worker) and,
  // by its name, configured like the others before `function` runs; that takes a std::stop_token or
  // nothing. The destructor of the executor asks it to stop and waits for it; cancel() does not.
  // What it throws is treated as a callback's failure, without a callback and with the name as id.
  // Throws std::invalid_argument for a name that is not 1 to 15 bytes of printable text,
  // ParametersRefused under OnError::refuse (then `function` never runs), std::system_error when
  // there is no thread.
  template <WorkerFunction F>
  void spawn_thread(const std::string& name, F function) {
    if constexpr (std::invocable<F&, std::stop_token>) {
      start_worker(name, std::move(function));
    } else {
      start_worker(
          name, [function = std::move(function)](const std::stop_token&) mutable { function(); });
    }
  }

  // Goes on under another spec, also while spinning (null: without one). Of the threads that run,
  // only those change that the spec asks to run otherwise; what it no longer asks for goes back to
  // what the thread began with. Callbacks run on meanwhile, under the former parameters or the new
  // ones. Under OnError::refuse the first refusal puts everything back, the former spec stays in
  // force, and ParametersRefused is thrown; under OnError::warn the handler is told.
  void reload_spec(std::shared_ptr<const SchedulingSpec> spec);

  bool is_spinning() const noexcept;
  // What on_parameter_problem was told so far.
  std::vector<ParameterProblem> parameter_problems() const;

 protected:
  Executor(ExecutorKind kind, ExecutorOptions options);

 private:
  void start_worker(const std::string& name, std::function<void(std::stop_token)> function);

  std::shared_ptr<executor::ExecutorCore> core_;
};

// One thread for each callback group, and so for each callback that was not put into a group with
// others. A reentrant group has a pool of `reentrant_threads`.
class CallbackIsolatedExecutor final : public Executor {
 public:
  explicit CallbackIsolatedExecutor(ExecutorOptions options = {});
};

// All callbacks on the thread that calls spin().
class SingleThreadedExecutor final : public Executor {
 public:
  explicit SingleThreadedExecutor(ExecutorOptions options = {});
};

// All callbacks on the thread that calls spin(), in the order in which they became ready: each
// stands in a queue until its turn comes, and goes to the queue's end if it has more to do.
class EventsExecutor final : public Executor {
 public:
  // Throws std::invalid_argument for Dispatch::wait_set: an order of events is what that has not.
  explicit EventsExecutor(ExecutorOptions options = {});
};

// `threads` threads take ready callbacks from one queue; spin()'s own thread only waits.
class MultiThreadedExecutor final : public Executor {
 public:
  explicit MultiThreadedExecutor(ExecutorOptions options = {});
};

// What users call the executors: by their kind, and with "-waitset" the baselines that dispatch as
// rclcpp does. The traces of those name the kind.
inline constexpr std::array<std::string_view, 7> kExecutorNames{
    "isolated", "single", "multi", "events", "isolated-waitset", "single-waitset", "multi-waitset"};

// The executor of this name; the options' dispatch is the name's. Throws std::invalid_argument for
// another name.
std::unique_ptr<Executor> make_executor(std::string_view name, ExecutorOptions options = {});

}  // namespace cie
