#include "thread_questions.hpp"

#include "judgement.hpp"
#include "model/callback_questions.hpp"
#include "model/logical_ids.hpp"
#include "rule_context.hpp"

#include <algorithm>

namespace cie::analysis {
namespace {

std::string cpu_list(const std::vector<std::uint32_t>& cpus) {
  std::string text;
  for (const auto cpu : cpus) {
    text += text.empty() ? "" : ",";
    text += std::to_string(cpu);
  }
  return text;
}

std::string describe_policy(Policy policy, std::int32_t nice, std::uint32_t priority,
                            std::uint64_t runtime, std::uint64_t deadline, std::uint64_t period) {
  const auto name = policy_name(policy);
  std::string text(name.empty() ? "policy " + std::to_string(static_cast<std::int32_t>(policy))
                                : std::string(name));
  switch (policy) {
    case Policy::fifo:
    case Policy::round_robin:
      return text + " " + std::to_string(priority);
    case Policy::other:
    case Policy::batch:
      return text + " nice " + std::to_string(nice);
    case Policy::deadline:
      return text + " " + std::to_string(runtime) + "/" + std::to_string(deadline) + "/" +
             std::to_string(period);
    case Policy::idle:
      break;
  }
  return text;
}

bool has_policy(const ReadBack& read, const ThreadParameters& asked) {
  if (read.policy != static_cast<std::int32_t>(*asked.policy)) return false;
  switch (*asked.policy) {
    case Policy::fifo:
    case Policy::round_robin:
      return read.priority == asked.priority;
    case Policy::other:
    case Policy::batch:
      return read.nice == asked.nice;
    case Policy::deadline:
      return read.runtime_ns == asked.runtime_ns && read.deadline_ns == asked.deadline_ns &&
             read.period_ns == asked.period_ns;
    case Policy::idle:
      break;
  }
  return true;
}

// As far as the callback's id is known; its number may be any.
bool may_be_entry_of(const SpecEntry& entry, const CallbackFacts& callback) {
  if (!callback.registered) return true;
  const IdParts known(callback.logical_id);
  if (entry.is_wildcard()) {
    return known.lacks_node() || entry.id == std::string(known.node) + "/*";
  }
  const IdParts asked(entry.id);
  if (!known.lacks_node() && asked.node != known.node) return false;
  constexpr std::string_view kUntold = "?)";  // "@Service(?)"
  if (!known.what.ends_with(kUntold)) return asked.what == known.what;
  return asked.what.starts_with(known.what.substr(0, known.what.size() - kUntold.size()));
}

}  // namespace

std::optional<Evidence> end_after_fini(const ThreadFacts& thread, const CallbackOnThread& pair) {
  if (!thread.fini || pair.last_activity.time <= thread.fini->time) return std::nullopt;
  return evidence("callback_end", pair.last_activity,
                  "ended on thread " + std::to_string(thread.tid) + " after its thread_fini");
}

bool may_be_former(const RuleContext& context, const ThreadFacts& thread) {
  return thread.former_fini && !thread.announced && !context.proof.is_complete(thread.process);
}

bool is_isolated(const ThreadFacts& thread) noexcept {
  return thread.announced && thread.role == ThreadRole::callback;
}

bool is_registered_to(const ThreadFacts& thread, const CallbackFacts& callback) noexcept {
  if (thread.process != callback.process) return false;
  if (thread.callback) return *thread.callback == callback.id;
  return thread.group && callback.group && *thread.group == *callback.group;
}

const EventRef& first_start_on(const ThreadFacts& thread) {
  const auto first = std::ranges::min_element(
      thread.ran, {}, [](const CallbackOnThread* pair) { return pair->first_start.time; });
  return (*first)->first_start;
}

std::optional<Evidence> perhaps_anothers(const CallbackOnThread& pair) {
  if (pair.is_certain) return std::nullopt;
  return evidence(pair.starts != 0 ? "callback_start" : "callback_end", pair.first_start,
                  "this instance " + std::string(kPerhapsAnothers));
}

std::optional<Evidence> perhaps_another_process(const CallbackFacts& callback) {
  if (!callback.is_after_rcl_init) return std::nullopt;
  return without_event(*callback.registered,
                       callback.logical_id +
                           " was made after another rcl_init of this pid: another process may have "
                           "that, and so another thread its tid");
}

bool is_there_for_certain(const Model& model, const CallbackOnThread& pair) noexcept {
  return pair.is_certain && !model.callbacks[at(pair.callback)].is_after_rcl_init;
}

std::optional<Timestamp> registration(const RuleContext& context, const CallbackFacts& callback) {
  const auto& begin = context.model.processes[at(callback.process)].run_begin;
  if (!begin || !callback.registered || callback.may_repeat) return std::nullopt;
  const auto registered = callback.registered->time;
  // It may follow an announcement whose run_begin was lost.
  const bool is_doubtful = registered < begin->time ||
                           context.proof.user_loss(callback.process, begin->time, registered);
  return is_doubtful ? std::nullopt : std::optional(registered);
}

bool is_identified(const CallbackFacts& callback) noexcept {
  return callback.registered && callback.is_identified && !callback.may_be_another;
}

std::string_view why_unidentified(const CallbackFacts& callback) noexcept {
  if (!callback.registered) return "its registration was not seen";
  if (!callback.is_identified) return "registered in part only";
  return callback.is_after_rcl_init
             ? "made after another rcl_init of this pid, perhaps by another process than the one of "
               "its id before"
             : "registered after events were lost, perhaps those of another of its id";
}

EventRef last_sign(const CallbackFacts& callback) {
  EventRef last = *callback.registered;
  const auto consider = [&last](const EventRef& sign) {
    if (sign.time > last.time) last = sign;
  };
  if (callback.starts.last) consider(callback.starts.last_at);
  if (callback.ended.last) consider(callback.ended.last_at);
  if (callback.fini) consider(callback.fini->at);
  return last;
}

bool is_real_time(std::int32_t policy) noexcept {
  return policy == static_cast<std::int32_t>(Policy::fifo) ||
         policy == static_cast<std::int32_t>(Policy::round_robin) ||
         policy == static_cast<std::int32_t>(Policy::deadline);
}

std::string priority_text(std::int32_t prio) {
  if (prio < 0) return "priority of SCHED_DEADLINE";
  if (is_real_time_priority(prio)) return "real-time priority " + std::to_string(99 - prio);
  return "nice " + std::to_string(prio - 120);
}

const ReadBack* last_applied(const Model& model, const ThreadFacts& thread) noexcept {
  if (!thread.applied.empty()) return &thread.applied.back();
  const bool is_attached = model.processes[at(thread.process)].first_moment == RunMoment::announce;
  return is_attached && thread.first_audit ? &*thread.first_audit : nullptr;
}

std::optional<Evidence> doubt_of_first_audit(const RuleContext& context, ThreadIndex index) {
  const auto& thread = context.model.threads[at(index)];
  if (!thread.applied.empty() || !thread.first_audit) return std::nullopt;
  return context.proof.lost_read_back_before(index, thread.first_audit->at.time);
}

std::string describe(const ReadBack& read) {
  std::string text = describe_policy(Policy{read.policy}, read.nice, read.priority, read.runtime_ns,
                                     read.deadline_ns, read.period_ns);
  if (read.slice_ns.value_or(0) != 0) text += " slice " + std::to_string(*read.slice_ns) + " ns";
  const bool is_clamped = read.util_min.value_or(0) != 0 || read.util_max.value_or(1024) < 1024;
  if (is_clamped && read.util_max != 0U) {
    text += " uclamp " + std::to_string(read.util_min.value_or(0)) + ".." +
            std::to_string(read.util_max.value_or(1024));
  }
  return text + " on CPUs " + cpu_list(read.cpus);
}

std::string describe(const ThreadParameters& asked) {
  std::string text = asked.policy
                         ? describe_policy(*asked.policy, asked.nice, asked.priority,
                                           asked.runtime_ns, asked.deadline_ns, asked.period_ns)
                         : "any policy";
  if (asked.slice_ns) text += " slice " + std::to_string(*asked.slice_ns) + " ns";
  if (asked.util_min) text += " uclamp_min " + std::to_string(*asked.util_min);
  if (asked.util_max) text += " uclamp_max " + std::to_string(*asked.util_max);
  return text += asked.cpus ? " on CPUs " + cpu_list(*asked.cpus) : " on any CPU";
}

std::optional<bool> is_as_specified(const ReadBack& read, const ThreadParameters& asked) {
  if (asked.policy && !has_policy(read, asked)) return false;
  if (asked.cpus && !std::ranges::equal(*asked.cpus, read.cpus)) return false;
  bool is_known = true;
  const auto is_other = [&is_known](const auto& wanted, const auto& actual) {
    is_known = is_known && (!wanted || actual);
    return wanted && actual && *wanted != *actual;
  };
  const bool has_no_clamps = read.util_max == 0U;  // the kernel then reports 0 for both
  if (is_other(asked.slice_ns, read.slice_ns) || is_other(asked.util_min, read.util_min) ||
      is_other(asked.util_max, read.util_max) || (asked.util_min && has_no_clamps)) {
    return false;
  }
  return is_known ? std::optional(true) : std::nullopt;
}

bool was_asked_otherwise(const ReadBack& applied, const ThreadParameters& asked) {
  return (asked.policy && !has_policy(applied, asked)) ||
         (asked.cpus && !std::ranges::includes(*asked.cpus, applied.cpus));
}

bool judges_parameters(const ThreadParameters& parameters) noexcept {
  return parameters.policy || parameters.cpus;
}

const SpecEntry* spec_entry(const RuleContext& context, const CallbackFacts& callback) {
  if (context.options.spec == nullptr || !is_identified(callback)) return nullptr;
  return context.options.spec->find_callback(callback.logical_id, callback.period_ns);
}

std::optional<Evidence> unknown_entry(const RuleContext& context, const CallbackFacts& callback) {
  const char* const unknown = ": what it has to keep is unknown";
  if (!is_identified(callback)) {
    return without_event(first_sign(context.model, callback),
                         std::string(why_unidentified(callback)) + unknown);
  }
  const auto* spec = context.options.spec;
  const bool lacks_entry = spec != nullptr && spec_entry(context, callback) == nullptr;
  if (!lacks_entry || !IdParts(callback.logical_id).lacks_node()) return std::nullopt;
  const auto may_be = [&](const SpecEntry& entry) { return may_be_entry_of(entry, callback); };
  if (std::ranges::none_of(spec->callbacks(), may_be)) return std::nullopt;
  return without_event(first_sign(context.model, callback),
                       std::string("of a node that is not told") + unknown);
}

std::uint64_t most_allowed(const RuleContext& context, const CallbackFacts& callback,
                           std::optional<std::uint64_t> SpecEntry::*limit) {
  if (context.options.spec == nullptr) return 0;
  if (!unknown_entry(context, callback)) {
    const auto* entry = spec_entry(context, callback);
    return entry != nullptr ? (entry->*limit).value_or(0) : 0;
  }
  std::uint64_t most = 0;
  for (const auto& entry : context.options.spec->callbacks()) {
    if (may_be_entry_of(entry, callback)) most = std::max(most, (entry.*limit).value_or(0));
  }
  return most;
}

const SpecEntry* spec_entry_of(const RuleContext& context, ThreadIndex index) {
  if (context.options.spec == nullptr) return nullptr;
  const auto& thread = context.model.threads[at(index)];
  if (thread.role == ThreadRole::worker) return context.options.spec->find_thread(thread.name);
  for (const auto* pair : thread.ran) {
    const auto& callback = context.model.callbacks[at(pair->callback)];
    if (is_registered_to(thread, callback)) return spec_entry(context, callback);
  }
  const auto owner = context.isolated.idle_owner(index);
  return owner ? spec_entry(context, context.model.callbacks[at(*owner)]) : nullptr;
}

std::string place(const RuleContext& context, int line) {
  return (context.options.spec != nullptr ? context.options.spec->name() : std::string()) + ':' +
         std::to_string(line);
}

std::string asks(const RuleContext& context, const SpecEntry& entry) {
  return place(context, entry.line) + " asks for " + describe(entry.parameters);
}

std::string nanoseconds(std::int64_t value) { return std::to_string(value) + " ns"; }

}  // namespace cie::analysis
