// A discrete-event model of a Linux machine's scheduler: processors, threads under SCHED_DEADLINE
// (EDF with constant-bandwidth servers), SCHED_FIFO, SCHED_RR and, in the background, SCHED_OTHER;
// mutexes with priority inheritance. It writes the kernel's events and keeps its own account of
// where each thread's time went.
#pragma once

#include "random.hpp"
#include "system.hpp"
#include "tape.hpp"

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <queue>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace cie::sim {

// Where a thread's time went, from its creation on.
struct Account {
  Ns execution = 0;
  Ns preempted = 0;  // runnable and not running, after it had run
  Ns blocked = 0;
  Ns wake_delay = 0;  // from being woken to running
  Ns waking = 0;      // of it: until it was runnable
  std::map<std::int64_t, Ns>
      instead{};  // while preempted: who had its processor, 0 the idle thread
};

struct WakeUp {
  std::optional<Ns> waking{};             // when somebody woke it last
  std::optional<Ns> wakeup{};             // when it was runnable then
  std::optional<Ns> first_in{};           // when it ran first after `waking`
  std::optional<Ns> first_in_runnable{};  // when it ran first after `wakeup`
};

class Machine {
 public:
  using ThreadNumber = std::size_t;
  using Action = std::function<void()>;
  // Asked when a thread has nothing left to do: gives it more, or it exits.
  using Refill = std::function<void(ThreadNumber)>;

  Machine(int cpus, int mutexes, std::uint64_t seed, Tape& tape);

  // A new thread, SCHED_OTHER and allowed everywhere, which begins to run at once.
  ThreadNumber create(std::int64_t tid, std::string comm, Refill refill,
                      std::optional<ThreadNumber> parent = std::nullopt);

  // What a thread does next, in order. Actions happen on a processor and cost a few nanoseconds.
  void compute(ThreadNumber thread, Ns time);
  void act(ThreadNumber thread, Action action);
  void wait(ThreadNumber thread);  // until signalled; not at all if it was since the last wait
  void sleep(ThreadNumber thread, Ns time);
  void lock(ThreadNumber thread, int mutex);
  void unlock(ThreadNumber thread, int mutex);

  void signal(ThreadNumber thread);
  void at(Ns time, Action action);
  void set_parameters(ThreadNumber thread, const ThreadParameters& parameters);

  Ns now() const { return now_; }
  std::int32_t cpu_of(ThreadNumber thread) const { return threads_[thread].cpu; }
  std::int64_t tid_of(ThreadNumber thread) const { return threads_[thread].tid; }
  const Account& account(ThreadNumber thread) const { return threads_[thread].account; }
  const WakeUp& last_wake_up(ThreadNumber thread) const { return threads_[thread].wake_up; }
  void forget_wake_up(ThreadNumber thread) { threads_[thread].wake_up = {}; }
  // Whether the last wait really waited.
  bool has_waited(ThreadNumber thread) const { return threads_[thread].has_waited; }
  // When it blocked first, and its execution time until then.
  const std::optional<std::pair<Ns, Ns>>& first_wait(ThreadNumber thread) const {
    return threads_[thread].first_wait;
  }
  const ThreadParameters& parameters(ThreadNumber thread) const {
    return threads_[thread].parameters;
  }
  std::uint64_t inherited() const { return inherited_; }  // how often a priority was inherited
  Random& random() { return random_; }

  // Until nothing is left to happen.
  void run();

 private:
  static constexpr Ns kSlice = 400'000;  // SCHED_RR and SCHED_OTHER

  enum class State : std::uint8_t { blocked, waking, woken, preempted, running, dead };
  enum class Reason : std::uint8_t { wait, sleep, mutex };
  struct Op {
    enum class Kind : std::uint8_t { compute, act, wait, sleep, lock, unlock };
    Kind kind = Kind::compute;
    Ns time = 0;
    int mutex = 0;
    Action action{};
  };
  // Who runs first: smaller is sooner.
  struct Rank {
    int band = 2;  // deadline, real-time, fair
    Ns key = 0;    // absolute deadline, or kernel priority
    std::uint64_t order = 0;
    friend auto operator<=>(const Rank&, const Rank&) = default;
  };
  struct Thread {
    std::int64_t tid = 0;
    std::string comm{};
    Refill refill{};
    ThreadParameters parameters{};
    State state = State::blocked;
    Reason reason = Reason::wait;
    std::deque<Op> ops{};
    std::int32_t cpu = 0;
    Ns left_at = -1;          // when it last left a processor
    std::uint64_t order = 0;  // in its queue
    Ns slice = 0;
    Ns budget = 0;    // SCHED_DEADLINE
    Ns deadline = 0;  // SCHED_DEADLINE, absolute
    bool is_throttled = false;
    bool is_signalled = false;
    bool has_waited = false;
    std::optional<Rank> inherited{};
    std::optional<int> wants{};  // mutex
    std::vector<int> holds{};    // mutexes
    Account account{};
    WakeUp wake_up{};
    std::optional<std::pair<Ns, Ns>> first_wait{};
  };
  struct Mutex {
    std::optional<ThreadNumber> owner{};
    std::vector<ThreadNumber> waiters{};
  };
  struct Timer {
    Ns time = 0;
    std::uint64_t order = 0;
    Action action{};
    bool operator>(const Timer& other) const {
      return std::tie(time, order) > std::tie(other.time, other.order);
    }
  };

  Rank own_rank(const Thread& thread) const;
  Rank rank(const Thread& thread) const;
  std::int32_t priority(const Thread& thread) const;
  static bool is_allowed(const Thread& thread, std::int32_t cpu);

  std::optional<Ns> next_time() const;
  void advance(Ns time);
  bool is_leaving(const Thread& thread) const;
  void settle();
  bool work(std::int32_t cpu);  // whether anything was done
  void perform(ThreadNumber number, Op op);
  void expire(ThreadNumber number);
  void block(ThreadNumber number, Reason reason);
  void wake(ThreadNumber number, std::int32_t by_cpu);
  void enqueue(ThreadNumber number);
  void replenish(ThreadNumber number);
  void acquire(ThreadNumber number, int mutex);
  void release(ThreadNumber number, int mutex);
  void inherit(ThreadNumber owner);

  void dispatch();
  std::optional<std::int32_t> place(ThreadNumber number, const std::vector<bool>& is_taken) const;
  void switch_to(std::int32_t cpu, std::optional<ThreadNumber> next);

  Tape& tape_;
  Random random_;
  Ns now_ = kBeginning;
  std::deque<Thread> threads_;
  std::vector<Mutex> mutexes_;
  std::vector<std::optional<ThreadNumber>> on_cpu_;
  std::priority_queue<Timer, std::vector<Timer>, std::greater<>> timers_;
  std::uint64_t timer_order_ = 0;
  std::uint64_t queue_order_ = 0;
  std::uint64_t inherited_ = 0;
  Ns inherited_at_ = -1;       // last change of a priority through a mutex
  std::int32_t speaker_ = -1;  // the processor whose thread acts at the moment
  bool needs_dispatch_ = false;
};

}  // namespace cie::sim
