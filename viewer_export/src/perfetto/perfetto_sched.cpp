#include "perfetto_sched.hpp"

#include <cie/tracepoints/utf8.hpp>

#include <algorithm>
#include <limits>
#include <span>
#include <string_view>
#include <type_traits>

namespace cie::viewer_export::perfetto {
namespace {

constexpr std::int32_t kMostCpus = 4096;
constexpr std::size_t kEventsPerPacket = 256;
// The state proper and "preempted"; the kernel's higher bits are flags.
constexpr std::int64_t kStateMask = 0x1ff;

bool is_tid(std::int64_t tid) { return tid > 0 && tid <= std::numeric_limits<std::int32_t>::max(); }

}  // namespace

bool SchedRecorder::add(const analysis::SchedSlice& slice) {
  const bool is_sane = slice.cpu >= 0 && slice.cpu < kMostCpus && is_tid(slice.tid) &&
                       slice.begin.ns >= 0 && slice.begin < slice.end;
  if (!is_sane) {
    return false;
  }
  const CpuKey key{.host = slice.host, .number = slice.cpu};
  auto& cpu = cpus_[key];
  if (cpu.has_last && slice.begin.ns < cpu.last.end) {
    return false;
  }
  const Running next{.tid = slice.tid,
                     .priority = slice.priority,
                     .comm = names_.number(slice.comm),
                     .end = slice.end.ns,
                     .end_state = slice.end_state & kStateMask};
  comms_[{slice.host, slice.tid}] = next.comm;
  const Running idle{.comm = names_.number("swapper")};
  const bool is_adjacent = cpu.has_last && cpu.last.end == slice.begin.ns;
  auto before = is_adjacent ? cpu.last : idle;
  if (cpu.has_last && !is_adjacent) {
    const auto until =
        std::min(slice.unknown_until.value_or(analysis::Timestamp{}).ns, slice.begin.ns);
    const bool is_unknown = until > cpu.last.end;
    const Running first = is_unknown ? unrecorded() : idle;
    switch_task(key, cpu, cpu.last.end, cpu.last, first);
    if (is_unknown && until < slice.begin.ns) switch_task(key, cpu, until, first, idle);
    if (is_unknown && until == slice.begin.ns) before = first;
  }
  switch_task(key, cpu, slice.begin.ns, before, next);
  cpu.last = next;
  cpu.has_last = true;
  return true;
}

SchedRecorder::Running SchedRecorder::unrecorded() {
  return {.tid = std::numeric_limits<std::int32_t>::max(), .comm = names_.number("not recorded")};
}

bool SchedRecorder::add(const analysis::Waking& waking) {
  const bool is_sane = waking.cpu && *waking.cpu >= 0 && *waking.cpu < kMostCpus &&
                       waking.waker_tid && (*waking.waker_tid == 0 || is_tid(*waking.waker_tid)) &&
                       is_tid(waking.tid) && waking.time.ns >= 0;
  if (!is_sane) {
    return false;
  }
  static_assert(std::is_trivially_copyable_v<analysis::Waking>);
  const auto bytes = std::as_bytes(std::span(&waking, 1));
  wakings_.append({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  return true;
}

void SchedRecorder::switch_task(const CpuKey& key, Cpu& cpu, std::int64_t time, const Running& prev,
                                const Running& next) {
  cpu.pending.push_back({.time = time,
                         .prev_tid = prev.tid,
                         .prev_prio = prev.priority,
                         .prev_state = prev.end_state,
                         .prev_comm = names_.name(prev.comm),
                         .next_tid = next.tid,
                         .next_prio = next.priority,
                         .next_comm = names_.name(next.comm)});
  if (cpu.pending.size() >= kEventsPerPacket) {
    flush(key, cpu);
  }
}

void SchedRecorder::flush(const CpuKey& key, Cpu& cpu) {
  packets_.set_machine(key.host);
  packets_.switches(key.number, cpu.pending);
  cpu.pending.clear();
  spool_.append(packets_.bytes());
  packets_.clear();
}

void SchedRecorder::finish(std::ostream& out) {
  for (auto& [key, cpu] : cpus_) {
    const Running idle{.comm = names_.number("swapper")};
    switch_task(key, cpu, cpu.last.end, cpu.last, idle);
    flush(key, cpu);
  }
  cpus_.clear();
  if (spool_.size() > 0) {
    spool_.copy_to(out);
  }
  write_wakings(out);
}

void SchedRecorder::write_wakings(std::ostream& out) {
  using analysis::Waking;
  std::map<CpuKey, std::vector<WakingEvent>> pending;
  const auto flush_wakings = [&](const CpuKey& key, std::vector<WakingEvent>& events) {
    packets_.set_machine(key.host);
    packets_.wakings(key.number, events);
    events.clear();
    out.write(packets_.bytes().data(), static_cast<std::streamsize>(packets_.bytes().size()));
    packets_.clear();
  };
  std::vector<Waking> block(kEventsPerPacket);
  const auto total = wakings_.size() / sizeof(Waking);
  for (std::uint64_t at = 0; at < total; at += block.size()) {
    block.resize(std::min<std::uint64_t>(block.size(), total - at));
    const auto bytes = std::as_writable_bytes(std::span(block));
    wakings_.read(at * sizeof(Waking), {reinterpret_cast<char*>(bytes.data()), bytes.size()});
    for (const auto& w : block) {
      const auto comm = comms_.find({w.host, w.tid});
      auto& events = pending[{.host = w.host, .number = *w.cpu}];
      events.push_back(
          {.time = w.time.ns,
           .waker_tid = *w.waker_tid,
           .tid = w.tid,
           .comm = comm == comms_.end() ? std::string_view() : names_.name(comm->second),
           .prio = w.priority,
           .target_cpu = w.target_cpu});
      if (events.size() >= kEventsPerPacket) {
        flush_wakings({.host = w.host, .number = *w.cpu}, events);
      }
    }
  }
  for (auto& [key, events] : pending) {
    if (!events.empty()) flush_wakings(key, events);
  }
}

}  // namespace cie::viewer_export::perfetto
