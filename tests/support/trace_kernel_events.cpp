#include "support/trace_writer.hpp"

namespace cie::test::text {

void Writer::switch_to(std::int64_t time, std::int32_t cpu, std::int64_t state, const Thread* next,
                       const Line& line) {
  const auto* prev = on_cpu_[cpu];
  const auto prio = [](const Thread* thread) { return thread == nullptr ? 120 : thread->prio; };
  const auto name = [](const Thread* thread) {
    return thread == nullptr ? std::string_view("swapper") : std::string_view(thread->name);
  };
  add(time, {.time = {}, .stream = kKernel, .cpu = cpu, .pid = std::nullopt, .tid = std::nullopt},
      SchedSwitch{.prev_comm = keep(std::string(name(prev))),
                  .prev_tid = prev == nullptr ? 0 : prev->tid,
                  .prev_prio = line.number<std::int32_t>("prio", prio(prev)),
                  .prev_state = prev == nullptr ? 0 : state,
                  .next_comm = keep(std::string(name(next))),
                  .next_tid = next == nullptr ? 0 : next->tid,
                  .next_prio = line.number<std::int32_t>("next_prio", prio(next))});
  on_cpu_[cpu] = next;
}

bool Writer::kernel_event(std::int64_t time, const Line& line) {
  const auto& verb = line.word(1);
  const EventHead head{
      .time = {}, .stream = kKernel, .cpu = 0, .pid = std::nullopt, .tid = std::nullopt};
  const auto thread = [&](std::size_t i) -> const Thread* {
    return line.word(i) == "idle" ? nullptr : &named(threads_, line, line.word(i));
  };
  if (verb == "switch") {
    const auto cpu = static_cast<std::int32_t>(line.parse(line.word(2)));
    on_cpu_[cpu] = thread(3);
    switch_to(time, cpu, line.number("state", 1), thread(4), line);
  } else if (verb == "preempt") {
    const auto& by = named(threads_, line, line.value("by", ""));
    on_cpu_[thread(2)->cpu] = thread(2);
    switch_to(time, thread(2)->cpu, 0x100, &by, line);
  } else if (verb == "block") {
    on_cpu_[thread(2)->cpu] = thread(2);
    switch_to(time, thread(2)->cpu, 1, nullptr, line);
  } else if (verb == "resume") {
    switch_to(time, thread(2)->cpu, 1, thread(2), line);
  } else if (verb == "waking") {
    add(time, head, SchedWaking{.tid = thread(2)->tid, .prio = thread(2)->prio, .target_cpu = 0});
  } else if (verb == "fork") {
    add(time, head,
        SchedProcessFork{.parent_tid = thread(2)->tid,
                         .child_tid = thread(3)->tid,
                         .child_comm = keep(thread(3)->name)});
  } else if (verb == "exit") {
    add(time, head, SchedProcessExit{.tid = thread(2)->tid});
  } else if (verb == "exec") {
    add(time, head, SchedProcessExec{.tid = thread(2)->process->pid, .old_tid = thread(2)->tid});
  } else if (verb == "boost") {
    add(time, head,
        SchedPiSetprio{.tid = thread(2)->tid,
                       .old_prio = line.number<std::int32_t>("old", thread(2)->prio),
                       .new_prio = line.number<std::int32_t>("prio", 0)});
  } else {
    return false;
  }
  has_kernel_ = true;
  return true;
}

bool Writer::recording_event(std::int64_t time, const Line& line) {
  const auto& verb = line.word(1);
  const bool is_kernel = line.has("kernel");
  const EventHead head{.time = {},
                       .stream = is_kernel ? kKernel : kUser,
                       .cpu = 0,
                       .pid = std::nullopt,
                       .tid = std::nullopt};
  if (verb == "discard") {
    Discarded event{.begin = {time},
                    .end = {line.number("until", time)},
                    .count = std::nullopt,
                    .packets = line.has("packets")};
    if (line.gives("count")) event.count = line.number<std::uint64_t>("count", 0);
    add(event.end.ns, head, event);
  } else if (verb == "damage") {
    add(time, head,
        DamagedPacket{.reason = "cut short", .end = Timestamp{line.number("until", time)}});
  } else if (verb == "regress") {
    add(time, head, TimeRegression{.previous = {line.number("previous", time + 1)}});
  } else {
    return false;
  }
  has_kernel_ = has_kernel_ || is_kernel;
  return true;
}

}  // namespace cie::test::text
