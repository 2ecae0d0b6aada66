#include "schedulability_words.hpp"

#include <cie/analysis/report_rows.hpp>

#include "words/callback_names.hpp"
#include "words/recording_words.hpp"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <limits>
#include <map>
#include <utility>

#include <fmt/format.h>

namespace cie::viewer_export {

using analysis::CallbackSchedulability;
using analysis::SchedulabilityReport;

namespace {

std::string on_host(const std::string& host) {
  return host.empty() ? std::string() : " on " + printable(host);
}

// Rounded up: what is demanded, and a whole number of percents otherwise.
std::string percent(std::int64_t ppb) {
  constexpr std::int64_t kHundredth = 100'000;
  const auto hundredths = ppb / kHundredth + (ppb % kHundredth != 0 ? 1 : 0);
  return fmt::format("{}.{:02} %", hundredths / 100, hundredths % 100);
}

// Which CPUs, where others are judged apart from them.
std::string on_cpus(const analysis::DeadlineAdmission& admission,
                    const SchedulabilityReport& report) {
  if (admission.cpus.empty()) return " on unknown CPUs";
  if (report.deadline.size() < 2) return {};
  return fmt::format(" on CPU{} {}", admission.cpus.size() == 1 ? "" : "s",
                     format_cpus(admission.cpus));
}

std::string edf_test(const analysis::DeadlineAdmission& admission) {
  if (!admission.is_guaranteed) return "says nothing, because " + printable(admission.unknown);
  return *admission.is_guaranteed ? "shows that each gets its runtime by its deadline"
                                  : "does NOT show that each gets its runtime by its deadline";
}

// Those that the EDF test says nothing of, whatever it shows; empty: there are none.
std::string beyond_runtime(const SchedulabilityReport& report) {
  std::size_t count = 0;
  const CallbackSchedulability* most = nullptr;
  for (const auto& callback : report.callbacks) {
    if (!callback.executes_beyond_runtime()) continue;
    ++count;
    if (most == nullptr || callback.beyond_runtime_ns() > most->beyond_runtime_ns())
      most = &callback;
  }
  if (most == nullptr) return {};
  const auto id = printable(most->logical_id);
  const auto subject =
      count == 1 ? id + " executes" : fmt::format("{} execute", counted(count, "callback"));
  const auto most_words =
      fmt::format("{} of {}", format_duration(most->runtime_ns.value() + most->beyond_runtime_ns()),
                  format_duration(*most->runtime_ns));
  return fmt::format("{} for longer than the runtime of {}, which is then throttled: {}{}", subject,
                     count == 1 ? "its thread" : "their threads", count == 1 ? "" : id + " ",
                     most_words);
}

}  // namespace

std::string outcome(const SchedulabilityReport& report) {
  const auto count = [&report](const auto& is_so) {
    return static_cast<std::uint64_t>(std::ranges::count_if(report.callbacks, is_so));
  };
  const auto bounded = count([](const auto& callback) { return callback.bound_ns.has_value(); });
  const auto missed = count([](const auto& callback) { return callback.has_missed_deadline(); });
  const auto failed =
      count([](const auto& callback) { return callback.meets_deadline() == false; });
  const auto flagged = count([](const auto& callback) { return callback.is_flagged; });
  auto text =
      fmt::format("{} of {} {} a bound", bounded, counted(report.callbacks.size(), "callback"),
                  bounded == 1 || report.callbacks.size() == 1 ? "has" : "have");
  const auto all = report.deadlines();
  if (all > 0) {
    std::string parts;
    for (const auto& [number, what] :
         {std::pair(missed, "missed"), std::pair(failed - missed, "not guaranteed"),
          std::pair(all - report.decided_deadlines(), "undecided")}) {
      if (number == 0) continue;
      const auto of = parts.empty() ? fmt::format(" of {}", counted(all, "deadline")) : "";
      parts += fmt::format("{}{}{} {}", parts.empty() ? "" : ", ", number, of, what);
    }
    text += "; " + (parts.empty() ? counted(all, "deadline") + " guaranteed" : parts);
  }
  if (flagged > 0) text += fmt::format("; {} above the bound without explanation", flagged);
  return text;
}

Look outcome_look(const SchedulabilityReport& report) {
  if (report.has_finding()) return Look::bad;
  return report.is_undecided() ? Look::doubtful : Look::good;
}

std::string undecided(const SchedulabilityReport& report) {
  if (!report.is_undecided()) return {};
  return printable(counted(report.deadlines(), "deadline") +
                   ", none decided: " + report.why_undecided());
}

bool has_fixed_priority(const CallbackSchedulability& callback) {
  return callback.policy == "SCHED_FIFO" || callback.policy == "SCHED_RR";
}

std::string policy_of(const CallbackSchedulability& callback) {
  if (callback.policy.empty()) return "-";
  const auto name = callback.policy.substr(callback.policy.find('_') + 1);
  return has_fixed_priority(callback) ? fmt::format("{} {}", name, callback.priority) : name;
}

std::string parameter(const std::optional<analysis::TaskParameter>& value, DurationFormat format,
                      std::int64_t measured_besides) {
  if (!value) return "-";
  const bool is_declared =
      value->source == analysis::ParameterSource::declared && measured_besides == 0;
  return (is_declared ? "=" : "") + format(value->ns);
}

std::string time_or_dash(const std::optional<std::int64_t>& ns, DurationFormat format) {
  return ns ? format(*ns) : std::string(kNotMeasured);
}

std::string longest_observed(const CallbackSchedulability& callback, DurationFormat format) {
  const auto& least = callback.observed_at_least_ns;
  const bool is_bound = least && (callback.may_have_taken_longer || !callback.observed_ns ||
                                  *least > *callback.observed_ns);
  return is_bound ? ">" + format(*least) : time_or_dash(callback.observed_ns, format);
}

std::vector<std::string> why_above(const CallbackSchedulability& callback) {
  const auto excess = callback.longest_ns() - *callback.bound_ns;
  std::vector<std::string> lines{"observed is " + format_duration(excess) + " above the bound" +
                                 (callback.is_flagged ? ", NOT explained by what is known:" : ":")};
  for (const auto& explanation : callback.explanations)
    lines.push_back("- " + explanation.text);
  if (callback.explanations.empty()) {
    lines.emplace_back("- nothing known accounts for it; look at cie export --to perfetto");
  }
  return lines;
}

TextCell standing(const CallbackSchedulability& callback) {
  if (callback.has_missed_deadline()) return {"MISSED", Look::bad};
  if (callback.is_flagged) return {"ABOVE R", Look::bad};
  if (!callback.deadline) return not_measured();
  const auto is_met = callback.meets_deadline();
  if (!is_met) return {"?", Look::doubtful};
  return *is_met ? TextCell{"yes", Look::good} : TextCell{"NO", Look::bad};
}

namespace {

// Of it there is nothing to tell but why there is no bound.
bool is_unmeasured(const CallbackSchedulability& callback) {
  return !callback.execution && !callback.bound_ns && !callback.observed_at_least_ns &&
         !callback.observed_ns;
}

double ratio(const std::optional<std::int64_t>& ns, std::int64_t of) {
  constexpr auto kWorst = std::numeric_limits<double>::infinity();
  return ns && of > 0 ? static_cast<double>(*ns) / static_cast<double>(of) : kWorst;
}

// Deadlines that were missed, what is flagged, deadlines that are not guaranteed, those of which
// nothing is known; then the rest.
std::pair<int, double> badness(const CallbackSchedulability& callback) {
  const auto longest = std::max(callback.observed_ns, callback.observed_at_least_ns);
  if (callback.has_missed_deadline()) return {5, ratio(longest, callback.deadline->ns)};
  if (callback.is_flagged) return {4, ratio(longest, *callback.bound_ns)};
  const auto as_time = static_cast<double>(longest.value_or(0));
  if (!callback.deadline) return {0, as_time};
  const auto is_met = callback.meets_deadline();
  if (!is_met) return {2, ratio(longest.value_or(0), callback.deadline->ns)};
  return {*is_met ? 1 : 3, ratio(callback.bound_ns, callback.deadline->ns)};
}

std::vector<const CallbackSchedulability*> all_worst_first(const SchedulabilityReport& report) {
  std::vector<const CallbackSchedulability*> rows;
  for (const auto& callback : report.callbacks)
    rows.push_back(&callback);
  std::ranges::stable_sort(rows, std::ranges::greater{},
                           [](const auto* callback) { return badness(*callback); });
  return rows;
}

}  // namespace

std::vector<const CallbackSchedulability*> worst_first(const SchedulabilityReport& report) {
  auto rows = all_worst_first(report);
  std::erase_if(rows, [](const auto* callback) { return is_unmeasured(*callback); });
  return rows;
}

namespace {

std::vector<CommonReason> reasons_of(const SchedulabilityReport& report, Sameness sameness,
                                     bool (*is_wanted)(const CallbackSchedulability& callback)) {
  std::vector<CommonReason> reasons;
  std::map<std::string, std::size_t> places;
  for (const auto* callback : all_worst_first(report)) {
    if (!is_wanted(*callback)) continue;
    const auto key =
        sameness == Sameness::alike ? without_subjects(callback->reason) : callback->reason;
    const auto [place, is_new] = places.try_emplace(key, reasons.size());
    if (is_new) reasons.emplace_back();
    reasons[place->second].callbacks.push_back(callback);
  }
  std::ranges::stable_sort(reasons, std::ranges::greater{},
                           [](const auto& reason) { return reason.callbacks.size(); });
  return reasons;
}

}  // namespace

bool CommonReason::is_equal() const {
  return std::ranges::all_of(callbacks,
                             [this](const auto* callback) { return callback->reason == reason(); });
}

std::vector<CommonReason> without_bound(const SchedulabilityReport& report, Sameness sameness) {
  return reasons_of(report, sameness, [](const auto& callback) { return !callback.bound_ns; });
}

std::vector<CommonReason> undecided_by_bound(const SchedulabilityReport& report,
                                             Sameness sameness) {
  return reasons_of(report, sameness, [](const auto& callback) {
    return callback.bound_ns && callback.deadline && !callback.meets_deadline();
  });
}

std::string measured_window(const analysis::Report& report) {
  const auto window = analysis::asked_window(report.trace);
  return window ? "measured in " + window_words(*window) : std::string();
}

std::vector<std::string> processors(const SchedulabilityReport& report) {
  std::vector<std::string> sentences;
  auto demands = report.cpus;
  std::ranges::stable_sort(demands, std::ranges::greater{}, [](const auto& demand) {
    constexpr std::int64_t kWhole = 1'000'000'000;
    return demand.real_time_ppb.value_or(kWhole);
  });
  for (const auto& demand : demands) {
    const auto on = fmt::format("CPU {}{}: ", demand.cpu, on_host(demand.host));
    sentences.push_back(
        on +
        (demand.real_time_ppb
             ? "real-time callbacks demand up to " + percent(*demand.real_time_ppb)
             : "what real-time callbacks demand is unknown, because what one of them demands is"));
  }
  for (const auto& admission : report.deadline) {
    sentences.push_back(fmt::format(
        "SCHED_DEADLINE{}{}: {} reserve{} {} of {}; the kernel admits {} by default; the EDF test {}",
        on_cpus(admission, report), on_host(admission.host), counted(admission.servers, "thread"),
        admission.servers == 1 ? "s" : "",
        admission.reserved_ppb ? percent(*admission.reserved_ppb) : "an unknown share",
        counted(admission.processors, "CPU"), percent(admission.admissible_ppb),
        edf_test(admission)));
  }
  if (auto beyond = beyond_runtime(report); !beyond.empty()) sentences.push_back(std::move(beyond));
  return sentences;
}

}  // namespace cie::viewer_export
