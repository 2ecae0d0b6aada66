#include "thread_timeline.hpp"

#include <algorithm>

namespace cie::analysis {
namespace {

constexpr std::size_t kMaxHoles = 65'536;

// 0x100 is "preempted" since Linux 4.14; higher bits are flags (linux/sched.h, TASK_REPORT_MAX).
bool is_runnable(std::int64_t prev_state) noexcept {
  return (static_cast<std::uint64_t>(prev_state) & 0xffU) == 0;
}

}  // namespace

const ThreadTimeline::Thread* ThreadTimeline::find(HostIndex host, std::int64_t tid) const {
  const auto* of_host = hosts_.find(host);
  return of_host != nullptr ? of_host->threads.find(tid) : nullptr;
}

ThreadTimeline::Cpu& ThreadTimeline::cpu_of(Host& host, std::int32_t number) {
  const auto [place, is_new] = host.cpu_places.insert(number);
  if (is_new) {
    *place = host.cpus.size();
    host.cpus.emplace_back();
  }
  return host.cpus[*place];
}

void ThreadTimeline::drop_presumption(Thread& thread) {
  if (!thread.is_presumed) return;
  thread.is_presumed = false;
  thread.failed_presumption = thread.presumptions;
  ++thread.breaks;
}

void ThreadTimeline::leave(Thread& thread, Timestamp time, std::int32_t cpu, bool is_runnable) {
  drop_presumption(thread);
  ++thread.departures;
  if (thread.state == State::running && thread.cpu == cpu) {
    thread.total.execution += time - thread.since;
  } else if (thread.state != State::unknown) {
    ++thread.breaks;  // its switch-in was not recorded
  }
  thread.state = is_runnable ? State::preempted : State::blocked;
  thread.since = time;
  thread.out = time;
}

void ThreadTimeline::resume(Thread& thread, Timestamp time, std::int32_t cpu) {
  switch (thread.state) {
    case State::preempted:
      thread.total.preempted += time - thread.since;
      break;
    case State::waking:
      thread.total.wake_delay += time - thread.since;
      break;
    case State::blocked:  // no wake-up recorded: where blocking ended is unknown
      thread.total.blocked += time - thread.since;
      ++thread.split_breaks;
      break;
    case State::running:
      ++thread.breaks;  // its switch-out was not recorded
      break;
    case State::unknown:
      break;
  }
  thread.state = State::running;
  thread.cpu = cpu;
  thread.since = time;
}

void ThreadTimeline::enter(Thread& thread, Timestamp time, std::int32_t cpu) {
  if (thread.is_presumed && thread.since == time) {
    thread.is_presumed = false;  // the user event of this nanosecond was read first
    thread.cpu = cpu;
  } else {
    drop_presumption(thread);
    resume(thread, time, cpu);
  }
  thread.is_switched_in = true;
  if ((thread.waking || thread.wakeup) && !thread.first_in) thread.first_in = time;
}

ThreadTimeline::Runner ThreadTimeline::runner(const Host& host, std::int64_t tid,
                                              std::string_view name) {
  const auto* thread = host.threads.find(tid);
  return {.tid = tid, .name = name, .is_in_callback = thread != nullptr && thread->watches > 0};
}

void ThreadTimeline::charge(Thread& waiting, const Runner& by, Timestamp time) {
  if (time <= waiting.charged) return;
  auto& preemptors = waiting.preemptors;
  auto found = std::ranges::find(preemptors, by.tid, &Preemptor::tid);
  if (found == preemptors.end()) {
    preemptors.push_back(Preemptor{.tid = by.tid,
                                   .name = std::string(by.name),
                                   .time = Duration{0},
                                   .in_callbacks = Duration{0}});
    found = std::prev(preemptors.end());
  }
  if (found->name.empty()) found->name = by.name;
  found->time += time - waiting.charged;
  if (by.is_in_callback) found->in_callbacks += time - waiting.charged;
  waiting.charged = time;
}

void ThreadTimeline::stop_waiting(Host& host, std::int64_t tid, Thread& waiting, Timestamp time) {
  if (waiting.waits_on < 0) return;
  auto& cpu = cpu_of(host, waiting.waits_on);
  charge(waiting, runner(host, cpu.tid, cpu.name), time);
  std::erase(cpu.waiting, tid);
  waiting.waits_on = -1;
}

void ThreadTimeline::lose_running(Host& host, std::int32_t cpu, std::int64_t tid) {
  if (tid == 0) return;
  auto& vanished = host.threads[tid];
  if (vanished.state != State::running || vanished.cpu != cpu) return;
  vanished.state = State::unknown;
  vanished.displaced = {};
  ++vanished.breaks;
}

bool ThreadTimeline::has_other(const Host& host, std::int32_t cpu, std::int64_t tid,
                               Timestamp time) {
  const auto* place = host.cpu_places.find(cpu);
  if (place == nullptr) return false;
  const auto& on_cpu = host.cpus[*place];
  return on_cpu.is_known && on_cpu.tid != tid && on_cpu.tid != 0 && on_cpu.time < time;
}

void ThreadTimeline::displace(Host& host, std::int32_t cpu, Timestamp time) {
  const auto* place = host.cpu_places.find(cpu);
  if (place == nullptr) return;
  auto& on_cpu = host.cpus[*place];
  if (!on_cpu.is_known || on_cpu.tid == 0 || on_cpu.spoken) return;
  auto& displaced = host.threads[on_cpu.tid];
  if (displaced.state != State::running || displaced.cpu != cpu) return;
  on_cpu.spoken = time;
  displaced.displaced = time;
}

// Of one nanosecond, in several streams, its switch-out may follow.
void ThreadTimeline::lose_displaced(Thread& thread, Timestamp time) {
  if (!thread.displaced) return;
  if (*thread.displaced < time) {
    thread.state = State::unknown;
    ++thread.breaks;
  }
  thread.displaced = {};
}

void ThreadTimeline::begin_anew(HostIndex host, std::int32_t cpu) {
  auto& of_host = hosts_[host];
  const auto* place = of_host.cpu_places.find(cpu);
  if (place == nullptr) return;
  auto& on_cpu = of_host.cpus[*place];
  if (on_cpu.is_known) lose_running(of_host, cpu, on_cpu.tid);
  on_cpu.is_known = false;
  on_cpu.spoken = {};
}

std::optional<ThreadTimeline::Hole> ThreadTimeline::hole_before(const Cpu& cpu, std::int32_t number,
                                                                Timestamp time,
                                                                const SchedSwitch& event) {
  const bool has_mismatch = cpu.tid != event.prev_tid || (cpu.spoken && *cpu.spoken < time);
  if (!cpu.is_known || !has_mismatch) return std::nullopt;
  return Hole{.begin = cpu.time, .end = time, .cpu = number};
}

std::optional<ThreadTimeline::Hole> ThreadTimeline::on_switch_behind(HostIndex host,
                                                                     std::int32_t cpu,
                                                                     Timestamp time,
                                                                     const SchedSwitch& event) {
  auto& of_host = hosts_[host];
  const auto* place = of_host.cpu_places.find(cpu);
  if (place == nullptr) return std::nullopt;
  auto& on_cpu = of_host.cpus[*place];
  const auto hole = hole_before(on_cpu, cpu, time, event);
  if (hole) add_hole(host, *hole);
  on_cpu.is_known = false;
  on_cpu.spoken = {};
  return hole;
}

std::vector<ThreadTimeline::Hole> ThreadTimeline::open_holes(HostIndex host, Timestamp end) const {
  std::vector<Hole> open;
  const auto* of_host = hosts_.find(host);
  if (of_host == nullptr) return open;
  of_host->cpu_places.each([&](std::int32_t number, std::size_t place) {
    const auto& cpu = of_host->cpus[place];
    if (cpu.spoken && *cpu.spoken <= end)
      open.push_back({.begin = cpu.time, .end = *cpu.spoken, .cpu = number});
  });
  std::ranges::sort(open, {}, &Hole::cpu);
  return open;
}

std::optional<ThreadTimeline::Hole> ThreadTimeline::on_switch(HostIndex host, std::int32_t cpu,
                                                              Timestamp time,
                                                              const SchedSwitch& event,
                                                              Observer* observer) {
  auto& of_host = hosts_[host];
  auto& on_cpu = cpu_of(of_host, cpu);
  const auto hole = hole_before(on_cpu, cpu, time, event);
  const bool is_unknown = hole || !on_cpu.is_known;
  if (hole) {
    add_hole(host, *hole);
    lose_running(of_host, cpu, on_cpu.tid);
  }
  if (!on_cpu.waiting.empty()) {
    const auto by = runner(of_host, event.prev_tid, event.prev_comm);
    for (const auto waiting : on_cpu.waiting)
      charge(of_host.threads[waiting], by, time);
  }
  if (event.prev_tid != 0) {
    auto& prev = of_host.threads[event.prev_tid];
    prev.displaced = {};
    if (observer != nullptr && prev.state == State::running && prev.cpu == cpu) {
      observer->on_sched_slice(
          SchedSlice{.cpu = cpu,
                     .tid = event.prev_tid,
                     .comm = event.prev_comm,
                     .priority = event.prev_prio,
                     .begin = prev.since,
                     .end = time,
                     .end_state = event.prev_state,
                     .host = host,
                     .unknown_until = hole ? OptionalTime(prev.since) : on_cpu.unknown_until});
      on_cpu.unknown_until = {};
    }
    stop_waiting(of_host, event.prev_tid, prev, time);  // its switch-in was not recorded
    leave(prev, time, cpu, is_runnable(event.prev_state));
    if (prev.watches > 0 && prev.state == State::preempted) {
      prev.waits_on = cpu;
      prev.charged = time;
      on_cpu.waiting.push_back(event.prev_tid);
    }
  }
  if (event.next_tid != 0) {
    auto& next = of_host.threads[event.next_tid];
    lose_displaced(next, time);
    stop_waiting(of_host, event.next_tid, next, time);
    enter(next, time, cpu);
  }
  if (is_unknown) on_cpu.unknown_until = time;
  on_cpu.tid = event.next_tid;
  on_cpu.time = time;
  on_cpu.is_known = true;
  on_cpu.spoken = {};
  on_cpu.name = on_cpu.waiting.empty() ? std::string_view() : std::string_view(event.next_comm);
  return hole;
}

void ThreadTimeline::wake(Thread& thread, Timestamp time) {
  if (thread.state != State::blocked) return;
  thread.total.blocked += time - thread.since;
  thread.state = State::waking;
  thread.since = time;
}

void ThreadTimeline::on_waking(HostIndex host, std::int64_t tid, Timestamp time) {
  hosts_[host].has_wakings = true;
  auto& woken = thread(host, tid);
  wake(woken, time);
  woken.waking = time;
  woken.first_in = {};
}

bool ThreadTimeline::on_wakeup(HostIndex host, std::int64_t tid, Timestamp time) {
  auto& woken = thread(host, tid);
  wake(woken, time);
  if (woken.waking) return false;
  woken.wakeup = time;
  woken.asleep = woken.out;
  woken.first_in = {};
  return true;
}

std::optional<std::int64_t> ThreadTimeline::running_on(HostIndex host, std::int32_t cpu) {
  const auto& on_cpu = cpu_of(hosts_[host], cpu);
  return on_cpu.is_known ? std::optional(on_cpu.tid) : std::nullopt;
}

ThreadTimeline::Shown ThreadTimeline::on_user_event(HostIndex host, std::int64_t tid,
                                                    std::optional<std::int32_t> cpu, Timestamp time,
                                                    bool is_named_so) {
  auto& of_host = hosts_[host];
  auto& seen = of_host.threads[tid];
  if (seen.displaced && *seen.displaced < time) lose_displaced(seen, time);
  const bool is_there = seen.state == State::running && (!cpu || seen.cpu == *cpu);
  if (is_there && (seen.is_switched_in || is_named_so)) return cpu ? Shown::there : Shown::nothing;
  if (!is_named_so && cpu && has_other(of_host, *cpu, tid, time)) return Shown::elsewhere;
  if (is_there) return Shown::nothing;
  if (seen.out && *seen.out == time && seen.state != State::unknown)
    return Shown::nothing;  // the event came just before it
  // A thread that moves while it emits an event may be said to be where it was.
  if (cpu && is_named_so && seen.state != State::running) displace(of_host, *cpu, time);
  stop_waiting(of_host, tid, seen, time);
  drop_presumption(seen);
  const bool has_moved = seen.state == State::running;  // to another CPU, unseen
  if (has_moved) seen.total.execution += time - seen.since;
  seen.is_presumed = !has_moved;
  if (seen.is_presumed) ++seen.presumptions;
  resume(seen, time, cpu.value_or(-1));
  seen.is_switched_in = false;
  return Shown::nothing;
}

bool ThreadTimeline::is_there(HostIndex host, std::int64_t tid,
                              std::optional<std::int32_t> cpu) const {
  const auto* seen = find(host, tid);
  return seen != nullptr && seen->state == State::running && seen->is_switched_in && cpu &&
         seen->cpu == *cpu;
}

void ThreadTimeline::presume_since(HostIndex host, std::int64_t tid, Timestamp time) {
  auto* of_host = hosts_.find(host);
  auto* const found = of_host != nullptr ? of_host->threads.find(tid) : nullptr;
  if (found != nullptr && found->is_presumed) found->since = time;
}

void ThreadTimeline::on_migrate(HostIndex host, std::int64_t tid, std::int32_t cpu,
                                Timestamp time) {
  auto& of_host = hosts_[host];
  auto* const found = of_host.threads.find(tid);
  if (found == nullptr || found->waits_on < 0) return;
  stop_waiting(of_host, tid, *found, time);
  found->waits_on = cpu;
  cpu_of(of_host, cpu).waiting.push_back(tid);
}

void ThreadTimeline::on_exit(HostIndex host, std::int64_t tid) { forget_wake(host, tid); }

void ThreadTimeline::begin_watch(HostIndex host, std::int64_t tid, Timestamp time) {
  auto& of_host = hosts_[host];
  auto& watched = of_host.threads[tid];
  charge_waiting(of_host, tid, watched, time);
  if (watched.watches++ == 0) watched.preemptors.clear();
}

std::vector<Preemptor> ThreadTimeline::end_watch(HostIndex host, std::int64_t tid, Timestamp time) {
  auto& of_host = hosts_[host];
  auto& watched = of_host.threads[tid];
  charge_waiting(of_host, tid, watched, time);
  if (watched.watches > 0) --watched.watches;
  return watched.preemptors;
}

void ThreadTimeline::charge_waiting(Host& host, std::int64_t tid, const Thread& running,
                                    Timestamp time) {
  const auto* place = host.cpu_places.find(running.cpu);
  if (place == nullptr) return;
  const auto& on_cpu = host.cpus[*place];
  if (on_cpu.tid != tid) return;
  const Runner by{.tid = tid, .name = on_cpu.name, .is_in_callback = running.watches > 0};
  for (const auto waiting : on_cpu.waiting)
    charge(host.threads[waiting], by, time);
}

void ThreadTimeline::add_hole(HostIndex host, Hole hole) {
  auto& of_host = hosts_[host];
  auto& holes = of_host.holes;
  if (holes.size() >= kMaxHoles) {
    of_host.forgotten = holes[kMaxHoles / 2 - 1].end;
    holes.erase(holes.begin(), holes.begin() + kMaxHoles / 2);
  }
  holes.insert(std::ranges::upper_bound(holes, hole.end, {}, &Hole::end), hole);
}

ThreadTimeline::Mark ThreadTimeline::mark(HostIndex host, std::int64_t tid, Timestamp time) const {
  Mark mark{.total = {},
            .breaks = 0,
            .split_breaks = 0,
            .presumption = 0,
            .failed_presumption = 0,
            .departures = 0,
            .time = time};
  if (const auto* read = find(host, tid)) {
    mark.total = read->total;
    mark.breaks = read->breaks;
    mark.split_breaks = read->split_breaks;
    mark.departures = read->departures;
    mark.failed_presumption = read->failed_presumption;
    if (read->is_presumed && time == read->since) {
      mark.presumption = read->presumptions;
    } else if (read->is_presumed) {  // no switch-in has come, and none can any more
      mark.failed_presumption = read->presumptions;
      ++mark.breaks;
    }
    const bool is_lost = read->displaced && *read->displaced < time;
    if (is_lost) ++mark.breaks;
    if (read->state == State::running && !is_lost) mark.total.execution += time - read->since;
  }
  return mark;
}

ThreadTimeline::Mark ThreadTimeline::mark_at_last_switch(HostIndex host, std::int64_t tid) const {
  const auto* read = find(host, tid);
  return mark(host, tid, read == nullptr ? Timestamp{} : read->since);
}

std::optional<ThreadTimeline::Parts> ThreadTimeline::between(const Mark& from, const Mark& to) {
  // A break at the very mark is none of what follows it.
  const bool is_broken_at_mark = from.presumption != 0 && from.presumption == to.failed_presumption;
  if (from.breaks + (is_broken_at_mark ? 1 : 0) != to.breaks) return std::nullopt;
  Parts parts{.execution = to.total.execution - from.total.execution,
              .preempted = to.total.preempted - from.total.preempted,
              .blocked = std::nullopt,
              .wake_delay = std::nullopt,
              .has_left = from.departures != to.departures,
              .presumption = from.presumption == to.presumption ? 0 : to.presumption};
  if (from.split_breaks == to.split_breaks) {
    parts.blocked = to.total.blocked - from.total.blocked;
    parts.wake_delay = to.total.wake_delay - from.total.wake_delay;
  }
  return parts;
}

// Of an earlier presumption than the last one it is not known any more.
bool ThreadTimeline::is_proven(HostIndex host, std::int64_t tid, std::uint64_t presumption) const {
  const auto* read = find(host, tid);
  return read != nullptr && read->presumptions == presumption && !read->is_presumed &&
         read->failed_presumption != presumption;
}

bool ThreadTimeline::overlaps_hole(HostIndex host, Timestamp from, Timestamp to,
                                   std::optional<std::int32_t> cpu) const {
  const auto* of_host = hosts_.find(host);
  if (of_host == nullptr) return false;
  if (of_host->forgotten && from <= *of_host->forgotten) return true;
  const auto& holes = of_host->holes;
  for (auto hole = holes.rbegin(); hole != holes.rend() && from <= hole->end; ++hole) {
    const bool is_there = !cpu || hole->cpu == *cpu || hole->cpu < 0;
    if (is_there && hole->begin <= to) return true;
  }
  return false;
}

std::optional<Timestamp> ThreadTimeline::last_switch(HostIndex host) const {
  const auto* of_host = hosts_.find(host);
  if (of_host == nullptr || of_host->cpus.empty()) return std::nullopt;
  return std::ranges::max_element(of_host->cpus, {}, &Cpu::time)->time;
}

bool ThreadTimeline::is_confirmed(HostIndex host, Timestamp time) {
  auto* of_host = hosts_.find(host);
  if (of_host == nullptr || of_host->cpus.empty()) return true;
  const auto& cpus = of_host->cpus;
  const auto is_awaited = [time](const Cpu& cpu) { return cpu.time < time; };
  // Asked of every event, most often in vain: the CPU that was awaited last is likely to be still.
  if (is_awaited(cpus[of_host->unconfirmed])) return false;
  const auto awaited = std::find_if(cpus.begin(), cpus.end(), is_awaited);
  if (awaited == cpus.end()) return true;
  of_host->unconfirmed = static_cast<std::size_t>(awaited - cpus.begin());
  return false;
}

ThreadTimeline::Wake ThreadTimeline::last_wake(HostIndex host, std::int64_t tid) const {
  const auto* read = find(host, tid);
  if (read == nullptr) return {};
  // A wake-up alone, where others have a waking before it, lost that.
  const bool is_lost = !read->waking && hosts_.find(host)->has_wakings;
  if (is_lost) return {};
  return {.waking = read->waking ? read->waking : read->wakeup,
          .first_in = read->first_in,
          .since = read->waking ? read->waking : read->asleep};
}

void ThreadTimeline::forget_wake(HostIndex host, std::int64_t tid) {
  auto* of_host = hosts_.find(host);
  auto* read = of_host != nullptr ? of_host->threads.find(tid) : nullptr;
  if (read == nullptr) return;
  read->waking = {};
  read->wakeup = {};
  read->first_in = {};
}

}  // namespace cie::analysis
