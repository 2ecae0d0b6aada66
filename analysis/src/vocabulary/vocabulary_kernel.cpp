#include "vocabulary.hpp"

#include <initializer_list>
#include <tuple>

namespace cie::analysis {
namespace {

// LTTng-modules writes prio - 100, perf and ftrace write prio. The idle task's is 120: where one is
// seen, it tells the scale.
constexpr std::int32_t kIdlePriority = 120;

// Damaged events have any priority: sums wrap.
std::int32_t wrapping_add(std::int32_t a, std::int32_t b) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(a) + static_cast<std::uint32_t>(b));
}

std::int32_t priority(const Payload& p, std::size_t slot, const VocabularyState& state) {
  return wrapping_add(p.number<std::int32_t>(slot), state.priority_offset);
}

// The offset with which the idle task's priority is what it is.
std::int32_t offset_of_idle(const Payload& p, std::size_t slot) {
  const auto told = static_cast<std::uint32_t>(p.number<std::int32_t>(slot));
  return wrapping_add(kIdlePriority, static_cast<std::int32_t>(0U - told));
}

std::optional<std::int32_t> target_cpu(const Payload& p, std::size_t slot) {
  const auto cpu = p.integer(slot);
  if (!cpu) return std::nullopt;
  return static_cast<std::int32_t>(*cpu);
}

void sched_switch(const Payload& p, VocabularyState& state, EventBody& body) {
  const auto prev_tid = p.number<std::int64_t>(1);
  const auto next_tid = p.number<std::int64_t>(5);
  if (prev_tid == 0) state.priority_offset = offset_of_idle(p, 2);
  if (next_tid == 0) state.priority_offset = offset_of_idle(p, 6);
  body.emplace<SchedSwitch>() = {.prev_comm = p.text(0),
                                 .prev_tid = prev_tid,
                                 .prev_prio = priority(p, 2, state),
                                 .prev_state = p.number<std::int64_t>(3),
                                 .next_comm = p.text(4),
                                 .next_tid = next_tid,
                                 .next_prio = priority(p, 6, state)};
}

void sched_waking(const Payload& p, VocabularyState& state, EventBody& body) {
  body.emplace<SchedWaking>() = {.tid = p.number<std::int64_t>(0),
                                 .prio = priority(p, 1, state),
                                 .target_cpu = target_cpu(p, 2)};
}

void sched_wakeup(const Payload& p, VocabularyState& state, EventBody& body) {
  body.emplace<SchedWakeup>() = {.tid = p.number<std::int64_t>(0),
                                 .prio = priority(p, 1, state),
                                 .target_cpu = target_cpu(p, 2)};
}

void process_fork(const Payload& p, VocabularyState&, EventBody& body) {
  body.emplace<SchedProcessFork>() = {.parent_tid = p.number<std::int64_t>(0),
                                      .child_tid = p.number<std::int64_t>(1),
                                      .child_comm = p.text(2)};
}

void process_exit(const Payload& p, VocabularyState&, EventBody& body) {
  body.emplace<SchedProcessExit>() = {.tid = p.number<std::int64_t>(0)};
}

void process_exec(const Payload& p, VocabularyState&, EventBody& body) {
  body.emplace<SchedProcessExec>() = {.tid = p.number<std::int64_t>(0),
                                      .old_tid = p.number<std::int64_t>(1)};
}

void migrate_task(const Payload& p, VocabularyState&, EventBody& body) {
  body.emplace<SchedMigrateTask>() = {.tid = p.number<std::int64_t>(0),
                                      .orig_cpu = p.number<std::int32_t>(1),
                                      .dest_cpu = p.number<std::int32_t>(2)};
}

void pi_setprio(const Payload& p, VocabularyState& state, EventBody& body) {
  body.emplace<SchedPiSetprio>() = {.tid = p.number<std::int64_t>(0),
                                    .old_prio = priority(p, 1, state),
                                    .new_prio = priority(p, 2, state)};
}

std::vector<Translation> kernel_table() {
  const std::vector<FieldRequest> switched{
      "prev_comm", needed("prev_tid|prev_pid"), needed("prev_prio"), needed("prev_state"),
      "next_comm", needed("next_tid|next_pid"), needed("next_prio")};
  const std::vector<FieldRequest> woken{needed("tid|pid"), needed("prio"), "target_cpu"};
  // perf's conversion prefixes names with the subsystem. The kernel's own events call a thread id a pid.
  std::vector<Translation> table;
  for (const auto& [name, perf_name, fields, translate] : std::initializer_list<
           std::tuple<std::string_view, std::string_view, std::vector<FieldRequest>, Translate>>{
           {"sched_switch", "sched:sched_switch", switched, sched_switch},
           {"sched_waking", "sched:sched_waking", woken, sched_waking},
           {"sched_wakeup", "sched:sched_wakeup", woken, sched_wakeup},
           {"sched_wakeup_new", "sched:sched_wakeup_new", woken, sched_wakeup},
           {"sched_process_fork",
            "sched:sched_process_fork",
            {needed("parent_tid|parent_pid"), needed("child_tid|child_pid"), "child_comm"},
            process_fork},
           {"sched_process_exit", "sched:sched_process_exit", {needed("tid|pid")}, process_exit},
           {"sched_process_exec",
            "sched:sched_process_exec",
            {needed("tid|pid"), needed("old_tid|old_pid")},
            process_exec},
           {"sched_migrate_task",
            "sched:sched_migrate_task",
            {needed("tid|pid"), needed("orig_cpu"), needed("dest_cpu")},
            migrate_task},
           {"sched_pi_setprio",
            "sched:sched_pi_setprio",
            {needed("tid|pid"), needed("oldprio"), needed("newprio")},
            pi_setprio}}) {
    table.push_back({name, fields, translate});
    table.push_back({perf_name, fields, translate});
  }
  return table;
}

}  // namespace

const std::vector<Translation>& kernel_vocabulary() {
  static const auto table = kernel_table();
  return table;
}

}  // namespace cie::analysis
