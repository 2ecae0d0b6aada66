// Which thread runs which callback: what the executors differ in.
#pragma once

#include <cie/scheduling/callback.hpp>
#include <cie/scheduling/cancellation.hpp>
#include <cie/scheduling/failure.hpp>
#include <cie/scheduling/loop.hpp>
#include <cie/scheduling/loop_team.hpp>
#include <cie/scheduling/options.hpp>
#include <cie/scheduling/thread_configurator.hpp>

#include <cstdint>
#include <functional>
#include <memory>
#include <set>
#include <vector>

namespace cie::scheduling {

// What an executor lends to its placement, which it outlives.
struct PlacementParts {
  const ExecutorOptions& options;
  ThreadConfigurator& configurator;
  LoopParts loops;
};

// The loop that serves callbacks of groups of this type. A reentrant one also serves several groups.
using LoopFactory = std::function<std::unique_ptr<Loop>(GroupType type, const LoopParts& parts)>;
// On futex words, and for several threads on one queue.
std::unique_ptr<Loop> make_lean_loop(GroupType type, const LoopParts& parts);

// What becomes of an instance that runs as its callback is taken off its thread.
enum class Running : std::uint8_t { awaited, left_alone };

// Puts callbacks on threads and takes them off, and alone knows which it serves. All with the
// executor's lock held, except where a function says otherwise.
class Placement {
 public:
  using Callbacks = std::vector<std::shared_ptr<Callback>>;
  using TeamPtr = std::shared_ptr<LoopTeam>;
  using Teams = std::vector<TeamPtr>;
  // What waits for running callbacks; called without the lock.
  using Waiting = std::function<void()>;
  // What takes callbacks off their threads; called once, without the lock. If it waits, none of them
  // runs when it returns. If not, then none begins to, and it returns the teams that leave and are
  // yet to be joined.
  using Vacating = std::function<Teams(Running running)>;

  Placement() = default;
  Placement(const Placement&) = delete;
  Placement& operator=(const Placement&) = delete;
  virtual ~Placement() = default;

  // Serves those that it does not serve yet. Returns the teams that are new: configured, their gates
  // still closed. Throws SchedulingRefused and std::system_error, with nothing of it left.
  Teams serve(const Callbacks& callbacks);
  // Forgets those of the callbacks that it serves.
  Vacating remove(const Callbacks& callbacks);
  // Whether the calling thread is one that waiting for these callbacks would wait for.
  virtual bool is_on_thread_of(const Callbacks& callbacks) const = 0;

  // Takes all out of service. Only clear() forgets them, so that meanwhile whoever removes one
  // waits likewise.
  virtual Waiting stop() = 0;
  void clear();

  // Whether callbacks run on the thread that calls run().
  virtual bool is_on_spinning_thread() const noexcept { return false; }
  // Returns after cancel(), or at `deadline_ns` of CLOCK_MONOTONIC. Without the lock.
  virtual void run(std::int64_t deadline_ns, Cancellation& cancellation);
  // Beside Cancellation::cancel(), in a signal handler too, and so without the lock.
  virtual void cancel() noexcept {}

 protected:
  using Served = std::set<std::shared_ptr<Callback>>;

  // Those that are served. place() and take_off() are given what is not, or no longer, among them.
  const Served& served() const noexcept { return served_; }
  virtual Teams place(const Callbacks& callbacks) = 0;
  virtual Vacating take_off(const Callbacks& callbacks) = 0;
  // After stop(), for the next spin.
  virtual void reset() = 0;

 private:
  Served served_;
};

using PlacementFactory = std::function<std::unique_ptr<Placement>(const PlacementParts& parts)>;

}  // namespace cie::scheduling
