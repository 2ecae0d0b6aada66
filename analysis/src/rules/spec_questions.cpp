#include "spec_questions.hpp"

#include <cie/tracepoints/logical_id.hpp>

#include "judgement.hpp"
#include "model/callback_questions.hpp"
#include "model/logical_ids.hpp"
#include "parameter_words.hpp"
#include "thread_questions.hpp"

#include <string_view>

namespace cie::analysis {
namespace {

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
    return known.lacks_node() || entry.node() == known.node;
  }
  const IdParts asked(entry.id);
  if (!known.lacks_node() && asked.node != known.node) return false;
  constexpr std::string_view kUntold = "?)";  // "@Service(?)"
  if (!known.kind_and_what.ends_with(kUntold)) return asked.kind_and_what == known.kind_and_what;
  return asked.kind_and_what.starts_with(
      known.kind_and_what.substr(0, known.kind_and_what.size() - kUntold.size()));
}

// That of one of its id that may have been gone when it was made: then it has that one's number, which
// it would have had in a process that tells of the end of callbacks. Null: there is none, or it has an entry of its
// own.
const SpecEntry* entry_of_former(const SchedulingSpec& spec, const CallbackFacts& callback) {
  if (callback.least_number == 0) return nullptr;
  const auto number = id_number(callback.logical_id);
  const auto plain = LogicalId::without_number(callback.logical_id);
  const SpecEntry* former = nullptr;
  for (const auto& entry : spec.callbacks()) {
    if (LogicalId::without_number(entry.id) != plain) continue;
    const auto its = id_number(entry.id);
    if (its == number) return nullptr;
    if (its >= callback.least_number && its < number && former == nullptr) former = &entry;
  }
  return former;
}

}  // namespace

const SpecEntry* spec_entry(const RuleContext& context, const CallbackFacts& callback) {
  const auto* spec = context.options.spec;
  if (spec == nullptr || !is_identified(callback)) return nullptr;
  if (entry_of_former(*spec, callback) != nullptr) return nullptr;
  return spec->find_callback(callback.logical_id, callback.period_ns);
}

std::optional<Evidence> unknown_former(const RuleContext& context, const CallbackFacts& callback,
                                       EntryQuestion asks) {
  const auto* spec = context.options.spec;
  if (spec == nullptr || !is_identified(callback)) return std::nullopt;
  const auto* entry = entry_of_former(*spec, callback);
  if (entry == nullptr) return std::nullopt;
  const auto* other = spec->find_callback(callback.logical_id, callback.period_ns);  // of its node
  if (!asks(*entry) && (other == nullptr || !asks(*other))) return std::nullopt;
  return without_event(first_sign(context.model, callback),
                       note("entry-perhaps-of-former", {{"spec", place(context, entry->line)},
                                                        {"callback", NamedCallback{entry->id}}}));
}

std::optional<Evidence> unknown_entry(const RuleContext& context, const CallbackFacts& callback,
                                      EntryQuestion asks) {
  const auto* spec = context.options.spec;
  if (spec == nullptr) return std::nullopt;
  if (auto unknown = unknown_former(context, callback, asks)) return unknown;
  if (!is_identified(callback)) {
    return without_event(first_sign(context.model, callback),
                         note("owed-unknown", {{"text", why_unidentified(callback)}}));
  }
  const bool lacks_entry = spec_entry(context, callback) == nullptr;
  if (!lacks_entry || !IdParts(callback.logical_id).lacks_node()) return std::nullopt;
  const auto may_be = [&](const SpecEntry& entry) { return may_be_entry_of(entry, callback); };
  if (std::ranges::none_of(spec->callbacks(), may_be)) return std::nullopt;
  return without_event(first_sign(context.model, callback), note("owed-unknown-of-untold-node"));
}

std::uint64_t most_allowed(const RuleContext& context, const CallbackFacts& callback,
                           std::optional<std::uint64_t> SpecEntry::*limit) {
  if (context.options.spec == nullptr) return 0;
  const auto is_any = [](const SpecEntry&) { return true; };
  if (!unknown_entry(context, callback, is_any)) {
    const auto* entry = spec_entry(context, callback);
    return entry != nullptr ? (entry->*limit).value_or(0) : 0;
  }
  std::uint64_t most = 0;
  for (const auto& entry : context.options.spec->callbacks()) {
    if (may_be_entry_of(entry, callback)) most = std::max(most, (entry.*limit).value_or(0));
  }
  return most;
}

const SpecEntry* entry_of_name(const RuleContext& context, const ThreadFacts& thread) {
  const auto* spec = context.options.spec;
  return spec == nullptr || !is_of_other_role(thread) ? nullptr : spec->find_thread(thread.name);
}

const SpecEntry* spec_entry_of(const RuleContext& context, ThreadIndex index) {
  if (context.options.spec == nullptr) return nullptr;
  const auto& thread = context.model.threads[at(index)];
  if (const auto* named = entry_of_name(context, thread)) return named;
  for (const auto* pair : thread.ran) {
    const auto& callback = context.model.callbacks[at(pair->callback)];
    if (thread.announced && is_announced_for(thread, callback))
      return spec_entry(context, callback);
  }
  const auto owner = context.isolated.idle_owner(index);
  return owner ? spec_entry(context, context.model.callbacks[at(*owner)]) : nullptr;
}

std::string place(const RuleContext& context, int line) {
  return (context.options.spec != nullptr ? context.options.spec->name() : std::string()) + ':' +
         std::to_string(line);
}

Note asks(const RuleContext& context, const SpecEntry& entry) {
  return note("asks-for",
              {{"spec", place(context, entry.line)}, {"parameters", describe(entry.parameters)}});
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

}  // namespace cie::analysis
