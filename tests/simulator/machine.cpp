#include "simulator/machine.hpp"

#include <algorithm>
#include <utility>

namespace cie::sim {
namespace {

constexpr Range kActionCost{1, 300};  // of what a thread does beside computing
constexpr Range kWakeCost{1, 3'000};  // from being woken to being runnable

bool is_sliced(Policy policy) {
  return policy == Policy::round_robin || policy == Policy::other || policy == Policy::batch;
}

}  // namespace

Machine::Machine(int cpus, int mutexes, std::uint64_t seed, Tape& tape)
    : tape_(tape),
      random_(seed),
      mutexes_(static_cast<std::size_t>(mutexes)),
      on_cpu_(static_cast<std::size_t>(cpus)) {}

Machine::ThreadNumber Machine::create(std::int64_t tid, std::string comm, Refill refill,
                                      std::optional<ThreadNumber> parent) {
  const auto number = threads_.size();
  auto& thread = threads_.emplace_back();
  thread.tid = tid;
  thread.comm = std::move(comm);
  thread.refill = std::move(refill);
  thread.parameters.policy = Policy::other;
  thread.cpu = static_cast<std::int32_t>(random_.between(0, static_cast<Ns>(on_cpu_.size()) - 1));
  if (parent) {
    tape_.kernel(now_, threads_[*parent].cpu,
                 analysis::SchedProcessFork{.parent_tid = threads_[*parent].tid,
                                            .child_tid = tid,
                                            .child_comm = tape_.keep(thread.comm)});
  }
  thread.state = State::waking;
  at(now_ + random_.in(kWakeCost), [this, number] { enqueue(number); });
  return number;
}

void Machine::compute(ThreadNumber thread, Ns time) {
  threads_[thread].ops.push_back(
      {.kind = Op::Kind::compute, .time = time, .mutex = 0, .action = {}});
}
void Machine::act(ThreadNumber thread, Action action) {
  auto& ops = threads_[thread].ops;
  ops.push_back({.kind = Op::Kind::act, .time = 0, .mutex = 0, .action = std::move(action)});
  compute(thread, random_.in(kActionCost));
}
void Machine::wait(ThreadNumber thread) {
  threads_[thread].ops.push_back({.kind = Op::Kind::wait, .time = 0, .mutex = 0, .action = {}});
  compute(thread, random_.in(kActionCost));
}
void Machine::sleep(ThreadNumber thread, Ns time) {
  threads_[thread].ops.push_back({.kind = Op::Kind::sleep, .time = time, .mutex = 0, .action = {}});
  compute(thread, random_.in(kActionCost));
}
void Machine::lock(ThreadNumber thread, int mutex) {
  threads_[thread].ops.push_back({.kind = Op::Kind::lock, .time = 0, .mutex = mutex, .action = {}});
  compute(thread, random_.in(kActionCost));
}
void Machine::unlock(ThreadNumber thread, int mutex) {
  threads_[thread].ops.push_back(
      {.kind = Op::Kind::unlock, .time = 0, .mutex = mutex, .action = {}});
  compute(thread, random_.in(kActionCost));
}

void Machine::at(Ns time, Action action) {
  timers_.push(
      {.time = std::max(time, now_), .order = timer_order_++, .action = std::move(action)});
}

void Machine::set_parameters(ThreadNumber number, const ThreadParameters& parameters) {
  auto& thread = threads_[number];
  thread.parameters = parameters;
  thread.order = queue_order_++;
  thread.slice = kSlice;
  if (parameters.policy == Policy::deadline) replenish(number);
  needs_dispatch_ = true;
}

void Machine::signal(ThreadNumber number) {
  auto& thread = threads_[number];
  if (thread.state == State::blocked && thread.reason == Reason::wait) {
    wake(number, speaker_);
    return;
  }
  thread.is_signalled = true;
  const bool is_running = thread.state == State::running || thread.state == State::preempted;
  if (!is_running || !random_.one_in(8)) return;
  // The kernel also tells of wakings that come before the thread has gone to sleep.
  tape_.kernel(
      now_, std::max(speaker_, 0),
      analysis::SchedWaking{.tid = thread.tid, .prio = priority(thread), .target_cpu = thread.cpu});
  thread.wake_up.waking = now_;
  thread.wake_up.first_in.reset();
}

std::optional<Ns> Machine::next_time() const {
  std::optional<Ns> next;
  const auto consider = [&next](Ns time) { next = next ? std::min(*next, time) : time; };
  if (!timers_.empty()) consider(timers_.top().time);
  for (const auto& running : on_cpu_) {
    if (!running) continue;
    const auto& thread = threads_[*running];
    if (thread.state != State::running) continue;
    if (!thread.ops.empty()) consider(now_ + thread.ops.front().time);
    if (is_sliced(*thread.parameters.policy)) consider(now_ + thread.slice);
    if (thread.parameters.policy == Policy::deadline && !thread.inherited) {
      consider(now_ + thread.budget);
    }
  }
  return next;
}

// Blocked or dead, and its processor has not noticed yet.
bool Machine::is_leaving(const Thread& thread) const {
  const auto& holder = on_cpu_[static_cast<std::size_t>(thread.cpu)];
  return holder && &threads_[*holder] == &thread;
}

void Machine::advance(Ns time) {
  const auto passed = time - now_;
  for (auto& thread : threads_) {
    auto& account = thread.account;
    switch (thread.state) {
      case State::running:
        account.execution += passed;
        thread.ops.front().time -= passed;
        thread.slice -= passed;
        thread.budget -= passed;
        break;
      case State::preempted: {
        account.preempted += passed;
        const auto& other = on_cpu_[static_cast<std::size_t>(thread.cpu)];
        if (passed > 0) account.instead[other ? threads_[*other].tid : 0] += passed;
        break;
      }
      case State::blocked:
        (is_leaving(thread) ? account.execution : account.blocked) += passed;
        break;
      case State::waking:
        account.waking += passed;
        [[fallthrough]];
      case State::woken:
        account.wake_delay += passed;
        break;
      case State::dead:
        if (is_leaving(thread)) account.execution += passed;
        break;
    }
  }
  now_ = time;
}

void Machine::run() {
  while (const auto next = next_time()) {
    advance(*next);
    while (!timers_.empty() && timers_.top().time == now_) {
      auto action = timers_.top().action;
      timers_.pop();
      action();
    }
    settle();
  }
}

// Everything that happens at this very time.
void Machine::settle() {
  if (needs_dispatch_ && random_.one_in(2)) dispatch();
  for (bool is_done = false; !is_done;) {
    is_done = true;
    for (std::size_t cpu = 0; cpu < on_cpu_.size(); ++cpu) {
      if (work(static_cast<std::int32_t>(cpu))) is_done = false;
    }
    if (!needs_dispatch_) continue;
    dispatch();
    is_done = false;
  }
}

bool Machine::work(std::int32_t cpu) {
  const auto number = on_cpu_[static_cast<std::size_t>(cpu)];
  if (!number) return false;
  auto& thread = threads_[*number];
  if (thread.state != State::running) return false;
  expire(*number);
  if (thread.ops.empty()) thread.refill(*number);
  if (thread.ops.empty()) {
    thread.state = State::dead;
    tape_.kernel(now_, cpu, analysis::SchedProcessExit{.tid = thread.tid});
    needs_dispatch_ = true;
    return true;
  }
  if (thread.ops.front().time > 0 && thread.ops.front().kind == Op::Kind::compute) return false;
  auto op = std::move(thread.ops.front());
  thread.ops.pop_front();
  speaker_ = cpu;
  perform(*number, std::move(op));
  speaker_ = -1;
  return true;
}

void Machine::perform(ThreadNumber number, Op op) {
  auto& thread = threads_[number];
  switch (op.kind) {
    case Op::Kind::compute:
      break;
    case Op::Kind::act:
      op.action();
      break;
    case Op::Kind::wait:
      thread.has_waited = !std::exchange(thread.is_signalled, false);
      if (thread.has_waited) block(number, Reason::wait);
      break;
    case Op::Kind::sleep:
      block(number, Reason::sleep);
      at(now_ + op.time, [this, number] { wake(number, -1); });
      break;
    case Op::Kind::lock:
      acquire(number, op.mutex);
      break;
    case Op::Kind::unlock:
      release(number, op.mutex);
      break;
  }
}

void Machine::block(ThreadNumber number, Reason reason) {
  auto& thread = threads_[number];
  thread.state = State::blocked;
  thread.reason = reason;
  needs_dispatch_ = true;
}

void Machine::wake(ThreadNumber number, std::int32_t by_cpu) {
  auto& thread = threads_[number];
  if (is_leaving(thread) ||
      thread.left_at == now_) {  // the kernel waits until it has left its processor
    at(now_ + 1, [this, number] { wake(number, -1); });
    thread.reason = Reason::sleep;  // on its way: signals need not wake it again
    return;
  }
  if (by_cpu < 0) {
    by_cpu = static_cast<std::int32_t>(random_.between(0, static_cast<Ns>(on_cpu_.size()) - 1));
  }
  tape_.kernel(
      now_, by_cpu,
      analysis::SchedWaking{.tid = thread.tid, .prio = priority(thread), .target_cpu = thread.cpu});
  thread.wake_up = WakeUp{};
  thread.wake_up.waking = now_;
  thread.state = State::waking;
  at(now_ + random_.in(kWakeCost), [this, number] { enqueue(number); });
}

void Machine::enqueue(ThreadNumber number) {
  auto& thread = threads_[number];
  thread.state = State::woken;
  thread.wake_up.wakeup = now_;
  thread.order = queue_order_++;
  thread.slice = kSlice;
  const auto& parameters = thread.parameters;
  if (parameters.policy == Policy::deadline && !thread.is_throttled) {
    // The constant-bandwidth server's rule: what is left may be used as it was planned, or not.
    const auto left = static_cast<double>(thread.deadline - now_);
    const auto density =
        static_cast<double>(parameters.runtime_ns) / static_cast<double>(parameters.deadline_ns);
    if (left <= 0 || static_cast<double>(thread.budget) > left * density) replenish(number);
  }
  tape_.kernel(
      now_, thread.cpu,
      analysis::SchedWakeup{.tid = thread.tid, .prio = priority(thread), .target_cpu = thread.cpu});
  needs_dispatch_ = true;
}

}  // namespace cie::sim
