#include "diff_outcome.hpp"

#include <cie/analysis/statistics.hpp>

#include "diff_changes.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace cie::viewer_export {
namespace {

using analysis::Absence;
using analysis::CallbackChange;
using analysis::Change;
using analysis::Count;
using analysis::QuantityChange;

// Why a quantile is undecided.
enum Reason : std::size_t { too_few, bounded, too_close, one_sided, reasons };
constexpr std::array<std::string_view, reasons> kReasons{
    "too few instances", "releases not known", "values known within 1.6 %", "measured on one side"};

struct Tally {
  std::size_t quantiles = 0;
  std::array<std::size_t, reasons> undecided{};
  std::size_t counts = 0;  // that differ by no more than chance explains
};

// Whether the interval is as narrow as histograms know values: more instances do not help.
bool is_a_bucket(const analysis::QuantileInterval& interval) {
  if (!interval.lower || !interval.upper) return false;
  const auto bucket = analysis::values_like(*interval.lower);
  return *interval.upper - *interval.lower <= bucket.greatest - bucket.least + 1;
}

Reason reason_of(const QuantityChange& change) {
  if (!change.before || !change.after) return one_sided;
  if (change.before->estimate.is_bound || change.after->estimate.is_bound) return bounded;
  return is_a_bucket(*change.before) && is_a_bucket(*change.after) ? too_close : too_few;
}

Tally tally_of(const std::vector<CallbackChange>& changes) {
  Tally tally;
  for (const auto& change : changes) {
    tally.quantiles += change.quantities.size();
    for (const auto& each : change.quantities)
      if (each.change == Change::undecided) ++tally.undecided.at(reason_of(each));
    tally.counts += static_cast<std::size_t>(std::ranges::count_if(
        analysis::kCounts, [&change](Count count) { return may_be_chance(change, count); }));
  }
  return tally;
}

bool has_times(const CallbackChange& change, Change kind) {
  return std::ranges::find(change.quantities, kind, &QuantityChange::change) !=
         change.quantities.end();
}

// " (1 slower, 28 gone)": a callback may be worse in several ways.
std::string kinds_of_regression(const std::vector<CallbackChange>& changes) {
  std::vector<std::string> kinds;
  const auto add = [&](std::string_view what, const auto& is_so) {
    if (const auto count = std::ranges::count_if(changes, is_so); count > 0)
      kinds.push_back(fmt::format("{} {}", count, what));
  };
  const auto is_absent = [](Absence absence) {
    return [absence](const CallbackChange& change) {
      return change.is_absence_proved && change.absence == absence;
    };
  };
  add("slower", [](const CallbackChange& change) { return has_times(change, Change::worse); });
  add("not isolated any more", [](const CallbackChange& change) { return change.lost_isolation; });
  add("gone", is_absent(Absence::gone));
  add("gone from processes", is_absent(Absence::gone_from_process));
  add("never running any more", is_absent(Absence::never_runs));
  add("with an instance that never ends",
      [](const CallbackChange& change) { return change.never_ends; });
  for (const auto count : analysis::kCounts) {
    auto what = "with more " + std::string(analysis::label(count));
    std::ranges::replace(what, '_', ' ');
    add(count == Count::late ? "late more often" : what,
        [count](const CallbackChange& change) { return change.of(count).change == Change::worse; });
  }
  return fmt::format(" ({})", fmt::join(kinds, ", "));
}

std::string undecided_times(const std::vector<CallbackChange>& changes) {
  const auto quantiles = tally_of(changes).quantiles;
  const auto why = quantiles == 0
                       ? std::string("none was measured on both sides")
                       : fmt::format("of {} none is certain", counted(quantiles, "quantile"));
  return "Times undecided: " + why + "; no other regression";
}

}  // namespace

std::string outcome_words(const analysis::Comparison& comparison, double tolerance,
                          const TextStyle& style) {
  const auto& changes = comparison.callbacks;
  const auto regressions =
      std::ranges::count_if(changes, [](const auto& change) { return change.is_regression(); });
  const auto better = std::ranges::count_if(changes, [](const auto& change) {
    return !change.is_regression() && change.has(Change::better);
  });
  const auto all = counted(changes.size(), "callback");
  const bool is_whole = comparison.before.is_complete && comparison.after.is_complete;
  TextCell fact;
  switch (comparison.outcome()) {
    case analysis::Outcome::regression:
      fact = {fmt::format("Worse: {} of {}", regressions, all), Look::bad};
      break;
    case analysis::Outcome::undecided:
      if (!comparison.has_compared())
        return paint("Undecided: no callback ran in both recordings\n", Look::doubtful, style);
      if (!comparison.may_lack_runs())
        return paint(undecided_times(changes), Look::doubtful, style) + '\n';
      fact = {"Undecided: no regression in what was recorded", Look::doubtful};
      break;
    case analysis::Outcome::nothing_compared:
      return paint("Nothing to compare: no callback ran before and after\n", Look::doubtful, style);
    case analysis::Outcome::no_regression:
      if (comparison.is_equal() && is_whole && better == 0)
        return paint("No regression: all runs and times are the same\n", Look::good, style);
      fact = {is_whole ? "No regression" : "No regression in what was recorded", Look::good};
      break;
  }
  auto text = fact.text + (regressions > 0 ? kinds_of_regression(changes) : "");
  if (better > 0)
    text += fmt::format("; better: {}{}", better, regressions > 0 ? "" : " of " + all);
  // What else became worse has no tolerance.
  const bool is_of_times = std::ranges::any_of(changes, [](const CallbackChange& change) {
    return has_times(change, Change::worse) || has_times(change, Change::better);
  });
  if (regressions == 0 || is_of_times)
    text += fmt::format(", beyond a tolerance of {:g} %", 100 * tolerance);
  constexpr std::size_t kIndent = 2;
  const auto lines = filled(text, style.columns, kIndent);
  const auto first = std::min(fact.text.size(), lines.find('\n'));
  return paint(lines.substr(0, first), fact.look, style) + lines.substr(first);
}

std::string lateness_words(const std::vector<CallbackChange>& changes, const TextStyle& style) {
  analysis::Lateness before{};
  analysis::Lateness after{};
  std::size_t callbacks = 0;
  for (const auto& change : changes) {
    if (!change.has_one_deadline()) continue;
    ++callbacks;
    before.late += change.lateness_before->late;
    before.instances += change.lateness_before->instances;
    after.late += change.lateness_after->late;
    after.instances += change.lateness_after->instances;
  }
  if (callbacks == 0) return {};
  constexpr std::size_t kIndent = 2;
  return filled(fmt::format("Late: {} of {} instances before, {} of {} after; {} {} a deadline",
                            before.late, before.instances, after.late, after.instances,
                            counted(callbacks, "callback"), callbacks == 1 ? "has" : "have"),
                style.columns, kIndent);
}

std::string undecided_words(const std::vector<CallbackChange>& changes, const TextStyle& style) {
  const auto tally = tally_of(changes);
  std::vector<std::string> why;
  std::size_t undecided = 0;
  for (std::size_t i = 0; i < kReasons.size(); ++i) {
    if (tally.undecided.at(i) == 0) continue;
    undecided += tally.undecided.at(i);
    why.push_back(fmt::format("{} ({})", kReasons.at(i), tally.undecided.at(i)));
  }
  std::vector<std::string> parts;
  if (undecided > 0) {
    parts.push_back(fmt::format("{} of {} undecided: {}", undecided,
                                counted(tally.quantiles, "quantile"), fmt::join(why, ", ")));
  }
  if (tally.counts > 0)
    parts.push_back(fmt::format("{} may be chance", counted(tally.counts, "count")));
  return parts.empty() ? "" : filled(fmt::format("{}.", fmt::join(parts, "; ")), style.columns);
}

}  // namespace cie::viewer_export
