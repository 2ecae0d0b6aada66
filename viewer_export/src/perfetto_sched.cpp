#include "perfetto_sched.hpp"

#include "utf8.hpp"

#include <limits>

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
  auto& cpu = cpus_[slice.cpu];
  if (cpu.has_last && slice.begin.ns < cpu.last.end) {
    return false;
  }
  const Running next{.tid = slice.tid,
                     .priority = slice.priority,
                     .comm = names_.number(slice.comm),
                     .end = slice.end.ns,
                     .end_state = slice.end_state & kStateMask};
  const Running idle{.comm = names_.number("swapper")};
  const bool is_adjacent = cpu.has_last && cpu.last.end == slice.begin.ns;
  if (cpu.has_last && !is_adjacent) {
    switch_task(slice.cpu, cpu, cpu.last.end, cpu.last, idle);
  }
  switch_task(slice.cpu, cpu, slice.begin.ns, is_adjacent ? cpu.last : idle, next);
  cpu.last = next;
  cpu.has_last = true;
  return true;
}

void SchedRecorder::switch_task(std::int32_t number, Cpu& cpu, std::int64_t time,
                                const Running& prev, const Running& next) {
  cpu.pending.push_back({.time = time,
                         .prev_tid = prev.tid,
                         .prev_prio = prev.priority,
                         .prev_state = prev.end_state,
                         .prev_comm = names_.name(prev.comm),
                         .next_tid = next.tid,
                         .next_prio = next.priority,
                         .next_comm = names_.name(next.comm)});
  if (cpu.pending.size() >= kEventsPerPacket) {
    flush(number, cpu);
  }
}

void SchedRecorder::flush(std::int32_t number, Cpu& cpu) {
  packets_.switches(number, cpu.pending);
  cpu.pending.clear();
  spool_.append(packets_.bytes());
  packets_.clear();
}

void SchedRecorder::finish(std::ostream& out) {
  for (auto& [number, cpu] : cpus_) {
    const Running idle{.comm = names_.number("swapper")};
    switch_task(number, cpu, cpu.last.end, cpu.last, idle);
    flush(number, cpu);
  }
  cpus_.clear();
  if (spool_.size() > 0) {
    spool_.copy_to(out);
  }
}

}  // namespace cie::viewer_export::perfetto
