#include "spec_reader.hpp"

#include <cie/tracepoints/logical_id.hpp>
#include <cie/tracepoints/nearest_name.hpp>
#include <cie/tracepoints/utf8.hpp>

#include "base/text.hpp"
#include "base/yaml_fields.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <map>

namespace cie {
namespace {

using yaml::Fields;
using yaml::Keys;
using yaml::Value;

constexpr std::int64_t kMinInteger = std::numeric_limits<std::int64_t>::min();
// Bounds that only a mistake or an attack exceeds; they keep reading linear in the file's size.
constexpr std::size_t kMaxEntries = 100'000;
constexpr std::size_t kMaxChainCallbacks = 1'000;
constexpr std::int64_t kMaxCpu = 1023;              // of cpu_set_t
constexpr std::int64_t kMinDeadlineRuntime = 1024;  // the kernel's resolution: 2^10 ns
constexpr std::int64_t kMinSlice = 100'000;         // beyond these the kernel would clamp it
constexpr std::int64_t kMaxSlice = 100'000'000;
constexpr std::int64_t kMaxForeignWork = 1'000'000'000;  // a second of each second
constexpr std::int64_t kMaxUtilization = 1024;
constexpr std::int64_t kMaxDomain = 232;

constexpr std::array<std::string_view, 14> kParameterKeys{
    "affinity", "policy", "priority",  "nice",  "runtime",    "deadline",   "period",
    "id",       "name",   "domain_id", "slice", "uclamp_min", "uclamp_max", "cpuset"};
constexpr std::array<std::string_view, 7> kBoundKeys{
    "response_deadline",       "wcet",
    "min_inter_arrival",       "max_inter_arrival",
    "missed_releases_allowed", "overwrites_allowed",
    "foreign_work_budget"};
constexpr std::array<std::string_view, 1> kThreadBoundKeys{"foreign_work_budget"};
constexpr std::array<std::string_view, 5> kSections{"callback_groups", "non_ros_threads",
                                                    "dds_threads", "hardware_info", "chains"};
// As Cyclone DDS 0.10 names its threads.
constexpr std::array<std::string_view, 8> kDdsThreads{
    "recvUC", "recv", "recvMC", "tev", "gc", "dq.builtins", "dq.user", kDdsQueues};
constexpr std::array<std::string_view, 5> kChainKeys{"name", "callbacks", "path_latency",
                                                     "reaction_time", "data_age"};
// Sections and keys of the existing configurators that concern neither threads' parameters nor
// their verification: accepted, not read.
constexpr std::array<std::string_view, 3> kForeignSections{"rt_throttling", "kernel_threads",
                                                           "irqs"};

std::vector<std::uint32_t> read_cpus(const Value& affinity) {
  std::vector<std::uint32_t> cpus;
  for (const auto& item : affinity.items("affinity")) {
    const auto cpu = static_cast<std::uint32_t>(item.integer("affinity", 0, kMaxCpu));
    if (std::ranges::find(cpus, cpu) != cpus.end()) {
      item.fail("CPU " + std::to_string(cpu) + " is listed twice; remove one");
    }
    cpus.push_back(cpu);
  }
  std::ranges::sort(cpus);
  return cpus;
}

// Fails when `key` has a value that the policy has no use for.
void reject(const Fields& fields, std::string_view key, std::string_view policy,
            std::string_view remedy) {
  if (const Value* value = fields.find(key)) {
    value->fail("\"" + std::string(key) + "\" does not fit " + std::string(policy) + "; " +
                std::string(remedy));
  }
}

// The existing configurator's template writes `priority: 0` whatever the policy, and its manual
// spells a negative nice value of SCHED_OTHER and SCHED_BATCH as `priority`; both mean one thing
// only. A positive number could be meant either way and is an error.
void read_nice(const Fields& fields, std::string_view policy, ThreadParameters& parameters) {
  const auto nice = fields.integer("nice", -20, 19);
  if (nice) parameters.nice = static_cast<std::int32_t>(*nice);
  const auto priority = fields.integer("priority", kMinInteger);
  if (!priority || *priority == 0) return;
  const std::string number = std::to_string(*priority);
  if (*priority > 0 || *priority < -20) {
    fields.find("priority")
        ->fail("\"priority\" " + number + " does not fit " + std::string(policy) +
               "; write \"nice\" from -20 to 19, or SCHED_FIFO or SCHED_RR as \"policy\"");
  }
  if (nice && *nice != *priority) {
    fields.find("priority")->fail("\"priority\" " + number + " contradicts \"nice\"; remove it");
  }
  parameters.nice = static_cast<std::int32_t>(*priority);
}

void read_real_time_priority(const Fields& fields, std::string_view policy,
                             ThreadParameters& parameters) {
  reject(fields, "nice", policy, "write \"priority\" from 1 to 99 instead");
  const auto priority = fields.integer("priority", 1, 99);
  if (!priority) {
    fields.map().fail(std::string(policy) + " needs \"priority\"; write a number from 1 to 99");
  }
  parameters.priority = static_cast<std::uint32_t>(*priority);
}

void read_deadline(const Fields& fields, ThreadParameters& parameters) {
  reject(fields, "nice", "SCHED_DEADLINE", "remove it");
  if (fields.integer("priority", kMinInteger).value_or(0) != 0) {
    reject(fields, "priority", "SCHED_DEADLINE", "remove it");
  }
  for (const auto key : {"runtime", "deadline", "period"}) {
    if (fields.find(key) == nullptr) {
      fields.map().fail("SCHED_DEADLINE needs \"" + std::string(key) +
                        "\"; write it in nanoseconds, or as in 5ms");
    }
  }
  const auto runtime = *fields.duration("runtime", kMinDeadlineRuntime);
  const auto deadline = *fields.duration("deadline", kMinDeadlineRuntime);
  const auto period = *fields.duration("period", kMinDeadlineRuntime);
  if (runtime > deadline) {
    fields.find("runtime")->fail("\"runtime\" " + std::to_string(runtime) +
                                 " is beyond \"deadline\" " + std::to_string(deadline) +
                                 "; keep runtime <= deadline <= period");
  }
  if (deadline > period) {
    fields.find("deadline")
        ->fail("\"deadline\" " + std::to_string(deadline) + " is beyond \"period\" " +
               std::to_string(period) + "; keep runtime <= deadline <= period");
  }
  parameters.runtime_ns = static_cast<std::uint64_t>(runtime);
  parameters.deadline_ns = static_cast<std::uint64_t>(deadline);
  parameters.period_ns = static_cast<std::uint64_t>(period);
}

void reject_deadline_keys(const Fields& fields, std::string_view policy) {
  for (const auto key : {"runtime", "deadline", "period"}) {
    reject(fields, key, policy, "remove it or write SCHED_DEADLINE as \"policy\"");
  }
}

// `nice` and `priority` may stand as 0 where the policy knows neither (or none is asked for).
void reject_priorities(const Fields& fields, std::string_view policy) {
  for (const auto key : {"nice", "priority"}) {
    if (fields.integer(key, kMinInteger).value_or(0) != 0) {
      reject(fields, key, policy, "remove it or write another \"policy\"");
    }
  }
}

void read_clamps(const Fields& fields, std::string_view policy, ThreadParameters& parameters) {
  if (parameters.policy == Policy::deadline) {
    for (const auto key : {"uclamp_min", "uclamp_max"})
      reject(fields, key, policy, "its runtime says how much it needs; remove it");
  }
  const auto min = fields.integer("uclamp_min", 0, kMaxUtilization);
  const auto max = fields.integer("uclamp_max", 1, kMaxUtilization);
  if (min) parameters.util_min = static_cast<std::uint32_t>(*min);
  if (max) parameters.util_max = static_cast<std::uint32_t>(*max);
  if (min && max && *min > *max) {
    fields.find("uclamp_min")->fail("\"uclamp_min\" is beyond \"uclamp_max\"; exchange them");
  }
}

void read_cpuset(const Fields& fields, ThreadParameters& parameters) {
  const Value* const cpuset = fields.find("cpuset");
  if (cpuset == nullptr) return;
  if (parameters.policy != Policy::deadline || !parameters.cpus) {
    cpuset->fail("\"cpuset\" is for SCHED_DEADLINE with \"affinity\"; remove it");
  }
  const std::string& text = cpuset->text("cpuset");
  if (text != "exclusive") {
    cpuset->fail("\"cpuset\" is \"" + text + "\"; write exclusive, or remove it");
  }
  parameters.has_exclusive_cpuset = true;
}

// "FIFO" and "sched_fifo" are near to SCHED_FIFO, too.
std::string nearest_policy(std::string_view name) {
  const auto policies = policy_names();
  std::string upper(name.substr(0, 64));
  std::ranges::transform(upper, upper.begin(), [](char c) {
    return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  });
  for (const auto& text : {upper, "SCHED_" + upper}) {
    if (auto meant = did_you_mean(text, policies); !meant.empty()) return meant;
  }
  return "; write " + joined(policies);
}

ThreadParameters read_parameters(const Fields& fields) {
  ThreadParameters parameters;
  const Value* affinity = fields.find("affinity");
  if (affinity != nullptr && !affinity->is_empty_sequence()) parameters.cpus = read_cpus(*affinity);

  const Value* policy = fields.find("policy");
  if (policy == nullptr || policy->is_empty_sequence()) {
    reject_deadline_keys(fields, "an entry without \"policy\"");
    reject_priorities(fields, "an entry without \"policy\"");
    reject(fields, "slice", "an entry without \"policy\"", "write SCHED_OTHER as \"policy\"");
    for (const auto key : {"uclamp_min", "uclamp_max", "cpuset"})
      reject(fields, key, "an entry without \"policy\"", "write the \"policy\" too");
    return parameters;
  }
  const std::string& name = policy->text("policy");
  parameters.policy = policy_from_name(name);
  if (!parameters.policy) {
    policy->fail("unknown policy \"" + name + "\"" + nearest_policy(name));
  }
  if (*parameters.policy != Policy::deadline) reject_deadline_keys(fields, name);
  if (*parameters.policy == Policy::other) {
    if (const auto slice = fields.duration("slice", kMinSlice, kMaxSlice)) {
      parameters.slice_ns = static_cast<std::uint64_t>(*slice);
    }
  } else {
    reject(fields, "slice", name, "remove it or write SCHED_OTHER as \"policy\"");
  }
  switch (*parameters.policy) {
    case Policy::other:
    case Policy::batch:
      read_nice(fields, name, parameters);
      break;
    case Policy::idle:
      // The configurators take a nice value here, of which the kernel makes nothing.
      static_cast<void>(fields.integer("nice", -20, 19));
      if (fields.integer("priority", kMinInteger).value_or(0) != 0) {
        reject(fields, "priority", name, "remove it or write another \"policy\"");
      }
      break;
    case Policy::fifo:
    case Policy::round_robin:
      read_real_time_priority(fields, name, parameters);
      break;
    case Policy::deadline:
      read_deadline(fields, parameters);
      break;
  }
  read_clamps(fields, name, parameters);
  read_cpuset(fields, parameters);
  return parameters;
}

// Waitables stood in the ids of the first configurator; a callback's id has none behind it.
std::string_view without_waitables(std::string_view id) {
  constexpr std::string_view kWaitable = "@Waitable";
  while (id.ends_with(kWaitable) && LogicalId::node_of(id).size() < id.size() - kWaitable.size()) {
    id.remove_suffix(kWaitable.size());
  }
  return id;
}

void check_id(const Value& value, std::string_view id) {
  const auto star = id.find('*');
  if (star == std::string_view::npos) return;
  const bool names_node = id.size() > kWildcard.size() && LogicalId::node_of(id) == id;
  if (star + 1 != id.size() || !id.ends_with(kWildcard) || !names_node) {
    value.fail("\"*\" stands only at the end of \"<node>/*\", as in \"/planning/lane/*\"");
  }
}

// What traces, executors and people are to recognise: it looks like what it is.
const std::string& name_text(const Value& value, std::string_view what) {
  const std::string& text = value.text(what);
  const std::string shown = printable(text);
  if (shown != text) {
    value.fail("\"" + std::string(what) + "\" is \"" + shown +
               "\" with invisible or bidirectional characters; write plain text");
  }
  return text;
}

std::string read_id(Fields& fields, bool is_callback) {
  const Value* id = fields.find("id");
  const Value* name = fields.find("name");
  if ((id == nullptr) == (name == nullptr)) {
    fields.map().fail(id == nullptr ? "neither \"id\" nor \"name\"; say what it is the entry of"
                                    : "both \"id\" and \"name\"; keep one");
  }
  const Value& value = id != nullptr ? *id : *name;
  std::string text = name_text(value, id != nullptr ? "id" : "name");
  if (text.empty()) value.fail("the id is empty; say what it is the entry of");
  if (is_callback) {
    text = without_waitables(text);
    check_id(value, text);
  }
  fields.set_entry(text);
  return text;
}

void read_bounds(const Fields& fields, SpecEntry& entry) {
  entry.response_deadline_ns = fields.duration("response_deadline", 1);
  entry.wcet_ns = fields.duration("wcet", 1);
  entry.min_inter_arrival_ns = fields.duration("min_inter_arrival", 0);
  entry.max_inter_arrival_ns = fields.duration("max_inter_arrival", 1);
  if (entry.min_inter_arrival_ns && entry.max_inter_arrival_ns &&
      *entry.min_inter_arrival_ns > *entry.max_inter_arrival_ns) {
    fields.find("min_inter_arrival")
        ->fail("\"min_inter_arrival\" is beyond \"max_inter_arrival\"; exchange them");
  }
  entry.missed_releases_allowed = fields.count("missed_releases_allowed");
  entry.overwrites_allowed = fields.count("overwrites_allowed");
  entry.foreign_work_budget_ns = fields.duration("foreign_work_budget", 0, kMaxForeignWork);
}

std::vector<Value> read_section(const Value& value, std::string_view what) {
  if (value.is_null()) return {};
  auto items = value.items(what);
  if (items.size() > kMaxEntries) value.fail("more than 100000 entries; split the file");
  return items;
}

bool asks_the_same(const SpecEntry& a, const SpecEntry& b) {
  SpecEntry at_same_line = b;
  at_same_line.line = a.line;
  return a == at_same_line;
}

using Index = std::map<std::string, std::size_t, std::less<>>;

enum class Section : std::uint8_t { callbacks, non_ros_threads, dds_threads };

std::string_view section_name(Section section) {
  switch (section) {
    case Section::callbacks:
      return "callback_groups";
    case Section::non_ros_threads:
      return "non_ros_threads";
    case Section::dds_threads:
      return "dds_threads";
  }
  return {};
}

// Entries in the order of the file, and where each id stands.
struct Entries {
  std::vector<SpecEntry> list;
  Index index;
};

// The same id in two domains is two entries there and one here, if no domain is chosen: traces do
// not carry it.
void add_entry(const Value& item, SpecEntry entry, bool has_domain, Entries& entries) {
  const auto [position, is_new] = entries.index.try_emplace(entry.id, entries.list.size());
  if (is_new) {
    entries.list.push_back(std::move(entry));
    return;
  }
  const SpecEntry& first = entries.list[position->second];
  if (has_domain && asks_the_same(first, entry)) return;
  item.of_entry(entry.id).fail("the id has an entry already at line " + std::to_string(first.line) +
                               "; remove one");
}

void check_dds_thread(const Fields& fields, std::string_view name) {
  if (std::ranges::find(kDdsThreads, name) != kDdsThreads.end()) return;
  const std::vector<std::string> known(kDdsThreads.begin(), kDdsThreads.end());
  const auto meant = did_you_mean(name, known);
  fields.map().fail("Cyclone DDS has no thread of this name" +
                    (meant.empty()
                         ? "; known are " + joined(known) + "; others belong to non_ros_threads"
                         : meant));
}

void read_entries(const Fields& sections, Section section, std::optional<std::uint32_t> domain,
                  Entries& entries) {
  const std::string_view what = section_name(section);
  const bool is_callback = section == Section::callbacks;
  const Value* const value = sections.find(what);
  if (value == nullptr) return;
  for (const auto& item : read_section(*value, what)) {
    Fields fields(item, what, kParameterKeys, is_callback ? Keys(kBoundKeys) : kThreadBoundKeys, {},
                  "man cie-spec");
    SpecEntry entry;
    entry.id = read_id(fields, is_callback);
    if (section == Section::dds_threads) check_dds_thread(fields, entry.id);
    entry.line = item.line();
    entry.is_dds_thread = section == Section::dds_threads;
    entry.parameters = read_parameters(fields);
    read_bounds(fields, entry);
    const auto entry_domain = fields.integer("domain_id", 0, kMaxDomain);
    if (domain && entry_domain && *entry_domain != *domain) continue;
    add_entry(item, std::move(entry), entry_domain.has_value(), entries);
  }
}

SpecChain read_chain(const Value& item) {
  Fields fields(item, "chains", kChainKeys);
  SpecChain chain;
  chain.line = item.line();
  const Value* name = fields.find("name");
  if (name == nullptr || name->text("name").empty()) item.fail("a chain needs a \"name\"");
  chain.name = name_text(*name, "name");
  fields.set_entry(chain.name);
  const Value* callbacks = fields.find("callbacks");
  if (callbacks == nullptr || callbacks->is_empty_sequence()) {
    fields.map().fail("a chain needs \"callbacks\"; list their logical ids, source first");
  }
  const auto ids = callbacks->items("callbacks");
  if (ids.size() > kMaxChainCallbacks) callbacks->fail("more than 1000 callbacks; split the chain");
  for (const auto& id : ids) {
    const std::string& text = name_text(id, "callbacks");
    if (text.empty() || text.find('*') != std::string::npos) {
      id.fail("a chain is made of exact logical ids, not \"" + text + "\"");
    }
    chain.callbacks.push_back(text);
  }
  chain.path_latency_ns = fields.duration("path_latency", 1);
  chain.reaction_time_ns = fields.duration("reaction_time", 1);
  chain.data_age_ns = fields.duration("data_age", 1);
  return chain;
}

std::vector<SpecChain> read_chains(const Value& section) {
  std::vector<SpecChain> chains;
  Index index;
  std::size_t callbacks = 0;
  for (const auto& item : read_section(section, "chains")) {
    auto chain = read_chain(item);
    const auto [position, is_new] = index.try_emplace(chain.name, chains.size());
    if (!is_new) {
      item.of_entry(chain.name)
          .fail("a chain of this name stands already at line " +
                std::to_string(chains[position->second].line) + "; rename one");
    }
    callbacks += chain.callbacks.size();
    if (callbacks > kMaxEntries) item.fail("chains of more than 100000 callbacks; split the file");
    chains.push_back(std::move(chain));
  }
  return chains;
}

}  // namespace

SpecSections read_spec(const yaml::Value& document, std::optional<std::uint32_t> domain) {
  const Fields fields(document, "the file", kSections, {}, kForeignSections);
  SpecSections sections;
  Entries callbacks;
  read_entries(fields, Section::callbacks, domain, callbacks);
  Entries threads;  // of both sections: a thread has one entry
  read_entries(fields, Section::non_ros_threads, domain, threads);
  read_entries(fields, Section::dds_threads, domain, threads);
  sections.callbacks = std::move(callbacks.list);
  sections.threads = std::move(threads.list);
  for (const auto& [key, value] : document.fields("the file")) {
    if (std::ranges::find(kForeignSections, key) != kForeignSections.end()) {
      sections.not_applied.emplace_back(key, value.line());
    }
  }
  if (const Value* section = fields.find("chains")) sections.chains = read_chains(*section);
  if (const Value* section = fields.find("hardware_info")) {
    for (const auto& [key, value] : section->fields("hardware_info")) {
      sections.hardware_info.emplace_back(key, value.is_null() ? std::string() : value.text(key));
      sections.hardware_info_lines.push_back(value.line());
    }
  }
  return sections;
}

}  // namespace cie
