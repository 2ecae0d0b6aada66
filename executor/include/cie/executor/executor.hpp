// Executors decide which thread runs which callback.
#pragma once

#include <cie/executor/node.hpp>
#include <cie/scheduling/failure.hpp>
#include <cie/scheduling/options.hpp>
#include <cie/scheduling/problem.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>
#include <cie/tracepoints/schema.hpp>

#include <array>
#include <chrono>
#include <concepts>
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

namespace scheduling {
class ExecutorCore;
}

template <typename F>
concept WorkerFunction = std::invocable<F&, std::stop_token> || std::invocable<F&>;

// What all executors share. Every function may be called from any thread. Wrong use throws
// std::logic_error: a node in two executors or twice in one, spin() while spinning, remove_node()
// of a stranger or from a callback that it would have to wait for: one on the thread of the node's
// callbacks, or one that such a callback waits for, in remove_node() of its own for example.
class Executor {
 public:
  // Cancels, and waits until spin() has returned on whichever thread; in a callback of its own it
  // does not wait, and spin() returns when that one has.
  virtual ~Executor();
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;

  // Serves the node's callbacks, those it has and those it gets, while spinning. The node must
  // outlive its membership; its destructor ends that.
  void add_node(Node& node);
  // Returns when no callback of the node runs any more: bounded by the longest one.
  void remove_node(Node& node);
  // Serves callbacks until cancel(); then waits for the running ones and joins all threads.
  // A cancel() that came before makes the next spin() return at once. Throws CallbackError when a
  // callback or a worker threw and ExecutorOptions::on_exception does not handle it.
  void spin();
  void spin_for(std::chrono::nanoseconds duration);
  // Async-signal-safe, and waits for nothing; CancelOnSignals calls it at SIGINT and SIGTERM. Once it
  // has returned no callback begins before the next spin(), the one that called it included; those
  // that run, run on. A callback begins when its thread finds, last before the user's function, that
  // nobody has cancelled. The message of one that does not begin is the first of the next spin.
  void cancel() noexcept;

  // Starts a thread outside DDS: a driver's, a logger's. It is named, announced (role worker) and,
  // by its name, configured like the others before `function` runs; that takes a std::stop_token or
  // nothing. The destructor of the executor asks it to stop and waits for it; cancel() does not.
  // What it throws is treated as a callback's failure, without a callback and with the name as id.
  // Throws std::invalid_argument for a name that is not 1 to 15 bytes of printable text,
  // SchedulingRefused under OnError::refuse (then `function` never runs), std::system_error when
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
  // force, and SchedulingRefused is thrown; under OnError::warn the handler is told.
  void reload_spec(std::shared_ptr<const SchedulingSpec> spec);

  bool is_spinning() const noexcept;
  // What on_scheduling_problem was told so far.
  std::vector<SchedulingProblem> scheduling_problems() const;

  // For the classes of this library.
  const std::shared_ptr<scheduling::ExecutorCore>& core() const noexcept { return core_; }

 protected:
  explicit Executor(std::shared_ptr<scheduling::ExecutorCore> core);

 private:
  void start_worker(const std::string& name, std::function<void(std::stop_token)> function);

  std::shared_ptr<scheduling::ExecutorCore> core_;
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

// The executor of this name. Throws std::invalid_argument for another name.
std::unique_ptr<Executor> make_executor(std::string_view name, ExecutorOptions options = {});

}  // namespace cie
