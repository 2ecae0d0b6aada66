#include "spec_template.hpp"

#include <cie/analysis/report_rows.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>

#include "words/recording_words.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace cie::cli {
namespace {

using analysis::CallbackReport;
using analysis::ProcessIndex;
using analysis::Rare;
using analysis::Report;
using analysis::ReportRows;
using analysis::Summary;
using analysis::ThreadReport;
using analysis::ThreadSchedReport;

constexpr std::uint32_t kMaxCpu = 1023;  // of a spec: sched_setaffinity is given a cpu_set_t
constexpr std::array<std::string_view, 7> kDdsThreads{"recvUC", "recv",        "recvMC", "tev",
                                                      "gc",     "dq.builtins", "dq.user"};

// The lines of one entry below its id, or why there are none.
struct Parameters {
  std::string lines;
  std::string remark;
  friend bool operator==(const Parameters&, const Parameters&) = default;
};

Parameters unknown(std::string remark) {
  return {.lines = "    policy: ~\n    affinity: ~\n", .remark = std::move(remark)};
}

// What was asked for beside the policy's own values; nothing that a spec would refuse.
std::string slice_and_clamp_lines(const ThreadSchedReport& sched) {
  std::string text;
  const bool has_slice = sched.policy == static_cast<std::int32_t>(Policy::other) &&
                         sched.slice_ns >= 100'000U && sched.slice_ns <= 100'000'000U;
  if (has_slice) text += fmt::format("    slice: {}\n", *sched.slice_ns);
  if (sched.policy == static_cast<std::int32_t>(Policy::deadline)) return text;
  const auto min = sched.util_min.value_or(0);
  const auto max = sched.util_max.value_or(1024);
  if (max > 1024 || min > max) return text;
  if (min > 0) text += fmt::format("    uclamp_min: {}\n", min);
  if (max < 1024) text += fmt::format("    uclamp_max: {}\n", max);
  return text;
}

// The policy with its values; empty if the spec has no words for it.
std::string policy_lines(const ThreadSchedReport& sched) {
  const auto policy = static_cast<Policy>(sched.policy);
  std::string text = fmt::format("    policy: {}\n", policy_name(policy));
  switch (policy) {
    case Policy::other:
    case Policy::batch:
      if (sched.nice < -20 || sched.nice > 19) return {};
      return text + fmt::format("    nice: {}\n", sched.nice);
    case Policy::idle:
      return text;
    case Policy::fifo:
    case Policy::round_robin:
      if (sched.priority < 1 || sched.priority > 99) return {};
      return text + fmt::format("    priority: {}\n", sched.priority);
    case Policy::deadline: {
      constexpr std::uint64_t kMinRuntime = 1024;
      constexpr std::uint64_t kMaxPeriod = std::uint64_t{1} << 62U;
      const bool is_usable = kMinRuntime <= sched.runtime_ns &&
                             sched.runtime_ns <= sched.deadline_ns &&
                             sched.deadline_ns <= sched.period_ns && sched.period_ns <= kMaxPeriod;
      if (!is_usable) return {};
      return text + fmt::format("    runtime: {}\n    deadline: {}\n    period: {}\n",
                                sched.runtime_ns, sched.deadline_ns, sched.period_ns);
    }
  }
  return {};
}

// Its CPUs, or none and why.
std::pair<std::string, std::string> affinity_of(const ThreadSchedReport& sched) {
  auto cpus = sched.cpus;
  std::ranges::sort(cpus);
  cpus.erase(std::unique(cpus.begin(), cpus.end()), cpus.end());
  if (cpus.empty()) return {"~", "its CPUs are not in the trace"};
  if (cpus.back() > kMaxCpu) {
    return {"~", fmt::format("a spec has no CPUs above {}, and it may use CPU {}", kMaxCpu,
                             cpus.back())};
  }
  return {fmt::format("[{}]", fmt::join(cpus, ", ")), {}};
}

Parameters parameters_of(const ThreadReport& thread) {
  const auto& read_back = thread.applied ? thread.applied : thread.sched;
  if (!read_back) return unknown("its parameters are not in the trace");
  const std::string policy = policy_lines(*read_back);
  if (policy.empty()) return unknown("a spec cannot ask for the policy that was read back");
  auto [cpus, remark] = affinity_of(*read_back);
  return {.lines = policy + slice_and_clamp_lines(*read_back) + "    affinity: " + cpus + '\n',
          .remark = std::move(remark)};
}

Parameters merged(const std::optional<Parameters>& first, Parameters second) {
  if (!first || *first == second) return second;
  return unknown("it ran with different parameters");
}

Parameters parameters_of(const CallbackReport& callback, const ReportRows& rows) {
  std::optional<Parameters> found;
  for (const auto& place : callback.threads) {
    const auto* thread = rows.find(place.thread);
    if (thread == nullptr) continue;
    if (thread->callbacks.size() > 1) return unknown("it shared a thread with other callbacks");
    found = merged(found, parameters_of(*thread));
  }
  return found ? *found : unknown("the threads that it ran on are not in the trace");
}

void keep_most(std::optional<std::int64_t>& most, const Rare<Summary>& summary) {
  if (summary) most = std::max(most.value_or(summary->max), summary->max);
}

// All callbacks of one id: of several processes, or of one that was restarted.
struct CallbackEntry {
  std::optional<Parameters> parameters;  // empty: it never ran
  std::uint64_t instances = 0;
  std::uint64_t missed_releases = 0;
  std::uint64_t overwritten_samples = 0;
  std::map<ProcessIndex, bool> has_run;  // in one of its lifetimes there
  std::optional<std::int64_t> response_time;
  bool is_response_bound = false;  // a release is not known: the longest may be longer
  bool lacks_releases = false;
  std::optional<std::int64_t> execution_time;
  std::uint64_t executions_measured = 0;
  std::optional<std::int64_t> duration;
  std::optional<std::int64_t> least_inter_arrival;
  std::optional<std::int64_t> most_inter_arrival;

  void add(const CallbackReport& callback, const ReportRows& rows) {
    const bool ran = !callback.never_ran();
    if (ran) parameters = merged(parameters, parameters_of(callback, rows));
    instances += callback.instances;
    has_run[callback.process] |= ran;
    overwritten_samples = std::max(overwritten_samples, callback.overwritten_samples.value_or(0));
    missed_releases = std::max(missed_releases, callback.missed_releases.value_or(0));
    add_response(callback);
    keep_most(execution_time, callback.execution_time);
    if (callback.execution_time) executions_measured += callback.execution_time->count;
    keep_most(duration, callback.duration);
    keep_most(most_inter_arrival, callback.inter_arrival);
    if (const auto& summary = callback.inter_arrival) {
      least_inter_arrival = std::min(least_inter_arrival.value_or(summary->min), summary->min);
    }
  }
  void add_response(const CallbackReport& callback) {
    lacks_releases |= callback.response_time_lower.has_value();
    const auto longest = analysis::longest_response(callback);
    if (!longest) return;
    is_response_bound |= longest->is_bound;
    response_time = std::max(response_time.value_or(longest->ns), longest->ns);
  }
};

std::string observed(const CallbackEntry& entry) {
  std::string text = fmt::format("    # seen: {}", counted(entry.instances, "instance"));
  const auto add = [&text](std::string_view what, const std::optional<std::int64_t>& value) {
    if (value) text += fmt::format("; {} {}", what, *value);
  };
  add(entry.is_response_bound ? "longest response time at least" : "response time at most",
      entry.response_time);
  if (entry.execution_time) {
    add("execution time at most", entry.execution_time);
    if (entry.executions_measured < entry.instances)
      text += fmt::format(" of {} of {} measured", entry.executions_measured, entry.instances);
  } else {
    add("duration at most", entry.duration);
  }
  if (entry.least_inter_arrival && entry.most_inter_arrival) {
    text += fmt::format("; inter-arrival time at least {} and at most {}{}",
                        *entry.least_inter_arrival, *entry.most_inter_arrival,
                        entry.lacks_releases ? " where releases are known" : "");
  }
  return text + "\n";
}

// True if a spec can name it; otherwise a comment says that it cannot. "?" stands for the id of a
// callback whose registration was not recorded.
bool begin_entry(std::ostream& out, std::string_view key, const std::string& id) {
  const std::string shown = printable(id);
  const bool is_callback = key == "id";
  if (id.empty() || shown != id ||
      (is_callback &&
       (id.starts_with('?') || id.find('*') != std::string::npos || id.ends_with("@Waitable")))) {
    out << fmt::format("  # a spec cannot name \"{}\"\n", shown);
    return false;
  }
  std::string quoted;
  for (const char c : id) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  out << fmt::format("  - {}: \"{}\"\n", key, quoted);
  return true;
}

void write_parameters(std::ostream& out, const Parameters& parameters) {
  out << parameters.lines;
  if (!parameters.remark.empty()) out << fmt::format("    # {}\n", parameters.remark);
}

void write_allowed(std::ostream& out, std::string_view key, std::uint64_t seen) {
  if (seen > 0) out << fmt::format("    {}: {}   # as many as were seen; 0 if absent\n", key, seen);
}

// The lines of an entry, each in its place if `# ` is taken away.
void write_commented(std::ostream& out, const std::string& entry) {
  std::istringstream lines(entry);
  for (std::string line; std::getline(lines, line);)
    out << "  # " << line.substr(2) << '\n';
}

bool never_ran(const CallbackEntry& entry) {
  return std::ranges::none_of(entry.has_run, [](const auto& in) { return in.second; });
}

// Commented out, if it did not run in each of its processes; for those that never ran the section says so.
void write_entry(std::ostream& out, const std::string& id, const CallbackEntry& entry) {
  std::ostringstream lines;
  if (!begin_entry(lines, "id", id)) {
    out << lines.str();
    return;
  }
  write_parameters(lines, entry.parameters.value_or(unknown({})));
  write_allowed(lines, "missed_releases_allowed", entry.missed_releases);
  write_allowed(lines, "overwrites_allowed", entry.overwritten_samples);
  lines << observed(entry);
  if (std::ranges::all_of(entry.has_run, [](const auto& in) { return in.second; })) {
    out << lines.str();
    return;
  }
  if (!never_ran(entry)) {
    out << "  # It did not run in each of its processes, and verify fails entries of such (M1). If it is\n"
           "  # meant to run in all, uncomment:\n";
  }
  write_commented(out, lines.str());
}

void write_callbacks(std::ostream& out, const Report& report) {
  const ReportRows rows(report);
  std::vector<std::pair<std::string, CallbackEntry>> entries;  // in the report's order
  std::map<std::string, std::size_t> places;
  for (const CallbackReport& callback : report.callbacks) {
    const auto [place, is_new] = places.try_emplace(callback.logical_id, entries.size());
    if (is_new) entries.emplace_back(callback.logical_id, CallbackEntry{});
    entries[place->second].second.add(callback, rows);
  }
  out << (entries.empty() ? "callback_groups: []\n" : "callback_groups:\n");
  const auto silent = std::stable_partition(
      entries.begin(), entries.end(), [](const auto& entry) { return !never_ran(entry.second); });
  for (auto entry = entries.begin(); entry != entries.end(); ++entry) {
    if (entry == silent) {
      out << "  # These did not run, and verify fails entries of such (M1). Uncomment what is meant to run:\n";
    }
    write_entry(out, entry->first, entry->second);
  }
}

void write_workers(std::ostream& out, const Report& report, std::string_view section,
                   bool are_of_dds) {
  std::map<std::string, std::optional<Parameters>> entries;
  for (const ThreadReport& thread : report.threads) {
    const bool is_of_dds = std::ranges::find(kDdsThreads, thread.name) != kDdsThreads.end();
    if (thread.role != ThreadRole::worker || is_of_dds != are_of_dds) continue;
    auto& entry = entries[thread.name];
    entry = merged(entry, parameters_of(thread));
  }
  if (entries.empty()) return;
  out << '\n' << section << ":\n";
  for (const auto& [name, parameters] : entries) {
    if (begin_entry(out, "name", name)) write_parameters(out, *parameters);
  }
}

void write_damages(std::ostream& out, const Report& report) {
  constexpr std::size_t kColumns = 78;
  for (const auto& damage : viewer_export::damages_of(report, "...")) {
    for (const auto& part : viewer_export::wrap(damage, kColumns))
      out << "# " << part << '\n';
  }
}

}  // namespace

void write_spec_template(std::ostream& out, const Report& report) {
  out << "# Scheduling spec from what a trace showed, by cie spec template. Times are "
         "nanoseconds.\n"
         "# What was seen is no bound: add response_deadline, wcet, min_inter_arrival and\n"
         "# max_inter_arrival where they are meant to be kept, and chains.\n";
  write_damages(out, report);
  write_callbacks(out, report);
  write_workers(out, report, "dds_threads", true);
  write_workers(out, report, "non_ros_threads", false);
}

}  // namespace cie::cli
