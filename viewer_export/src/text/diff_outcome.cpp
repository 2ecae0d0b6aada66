#include "diff_outcome.hpp"

#include <cie/analysis/statistics.hpp>

#include "diff_changes.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace cie::viewer_export {
namespace {

using analysis::Absence;
using analysis::CallbackChange;
using analysis::Change;
using analysis::QuantityChange;

// How many comparisons came to what.
struct Tally {
  std::uint64_t within = 0;     // quantiles
  std::uint64_t undecided = 0;  // quantiles
  std::uint64_t too_close = 0;  // quantiles that no number of instances would decide
  std::uint64_t bounded = 0;    // quantiles of which a bound is known only
  std::uint64_t one_sided = 0;  // quantiles measured on one side only
  std::uint64_t counts = 0;     // that differ by no more than chance explains

  std::uint64_t open() const { return undecided + too_close + bounded + one_sided; }
};

// Whether the interval is as narrow as histograms know values.
bool is_a_bucket(const analysis::QuantileInterval& interval) {
  if (!interval.lower || !interval.upper) return false;
  const auto bucket = analysis::values_like(*interval.lower);
  return *interval.upper - *interval.lower <= bucket.greatest - bucket.least + 1;
}

void add_to(Tally& tally, const QuantityChange& change) {
  if (change.before.has_value() != change.after.has_value()) {
    ++tally.one_sided;
  } else if (change.change == Change::within) {
    ++tally.within;
  } else if (change.change != Change::undecided) {
    return;
  } else if (change.before->estimate.is_bound || change.after->estimate.is_bound) {
    ++tally.bounded;
  } else {
    const bool is_narrow = is_a_bucket(*change.before) && is_a_bucket(*change.after);
    ++(is_narrow ? tally.too_close : tally.undecided);
  }
}

Tally tally_of(const std::vector<CallbackChange>& changes) {
  Tally tally;
  for (const auto& change : changes) {
    for (const auto& each : change.quantities)
      add_to(tally, each);
    for (const bool is_undecided :
         {is_late_open(change), is_open(change.missed_before, change.missed_after, change.missed),
          is_open(change.exceptions_before, change.exceptions_after, change.exceptions),
          is_open(change.lost_before, change.lost_after, change.lost),
          is_open(change.overwritten_before, change.overwritten_after, change.overwritten)}) {
      tally.counts += is_undecided ? 1U : 0U;
    }
  }
  return tally;
}

std::string count_words(const Tally& tally) {
  return tally.counts > 0
             ? fmt::format("; {} that may differ by chance", counted(tally.counts, "count"))
             : std::string();
}

std::size_t quantiles_of(const std::vector<CallbackChange>& changes) {
  return std::accumulate(
      changes.begin(), changes.end(), std::size_t{0},
      [](auto sum, const CallbackChange& change) { return sum + change.quantities.size(); });
}

bool has(const CallbackChange& change, Change kind) {
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
  const auto is_worse = [](Change CallbackChange::*part) {
    return [part](const CallbackChange& change) { return change.*part == Change::worse; };
  };
  add("slower", [](const CallbackChange& change) { return has(change, Change::worse); });
  add("late more often", is_worse(&CallbackChange::late));
  add("with more missed releases", is_worse(&CallbackChange::missed));
  add("not isolated any more", [](const CallbackChange& change) { return change.lost_isolation; });
  add("gone", is_absent(Absence::gone));
  add("gone from processes", is_absent(Absence::gone_from_process));
  add("never running any more", is_absent(Absence::never_runs));
  add("with an instance that never ends",
      [](const CallbackChange& change) { return change.never_ends; });
  add("with more exceptions", is_worse(&CallbackChange::exceptions));
  add("with more lost samples", is_worse(&CallbackChange::lost));
  add("with more overwritten samples", is_worse(&CallbackChange::overwritten));
  return fmt::format(" ({})", fmt::join(kinds, ", "));
}

std::string undecided_times(const std::vector<CallbackChange>& changes) {
  const auto quantiles = quantiles_of(changes);
  const auto why = quantiles == 0
                       ? std::string("none was measured on both sides")
                       : fmt::format("of {} none is certain", counted(quantiles, "quantile"));
  return "Times undecided: " + why + "; no other regression";
}

}  // namespace

bool is_decided(const analysis::Comparison& comparison) {
  const auto outcome = comparison.outcome();
  return outcome == analysis::Outcome::regression || outcome == analysis::Outcome::no_regression;
}

std::string outcome_words(const analysis::Comparison& comparison, double tolerance,
                          const TextStyle& style) {
  const auto& changes = comparison.callbacks;
  const auto regressions =
      std::ranges::count_if(changes, [](const auto& change) { return change.is_regression(); });
  const auto better = static_cast<std::uint64_t>(std::ranges::count_if(changes, is_better));
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
  std::string more;
  if (better > 0) {
    const auto of =
        regressions > 0 ? fmt::format("{}", better) : fmt::format("{} of {}", better, all);
    more = "; better: " + of;
  }
  // What else became worse has no tolerance.
  const bool has_times = std::ranges::any_of(changes, [](const CallbackChange& change) {
    return has(change, Change::worse) || has(change, Change::better);
  });
  const auto limit = regressions > 0 && !has_times
                         ? std::string()
                         : fmt::format(", beyond a tolerance of {:g} %", 100 * tolerance);
  const auto kinds = regressions > 0 ? kinds_of_regression(changes) : std::string();
  constexpr std::size_t kIndent = 2;
  const auto text = filled(fact.text + kinds + more + limit, style.columns, kIndent);
  const auto rest = std::string_view(text).substr(fact.text.size());
  const auto told = rest.starts_with(kinds + more) ? more.size() : 0;
  const auto plain = told > 0 ? kinds.size() : 0;
  return paint(fact.text, fact.look, style) + std::string(rest.substr(0, plain)) +
         (told > 0 ? paint(rest.substr(plain, told), Look::good, style) : "") +
         std::string(rest.substr(plain + told));
}

std::string tally_words(const std::vector<CallbackChange>& changes, const TextStyle& style) {
  const auto tally = tally_of(changes);
  if (tally.within + tally.open() + tally.counts == 0) return {};
  auto text = counted(tally.within, "quantile") + " within the tolerance";
  if (tally.undecided > 0) {
    text +=
        fmt::format("; {} undecided: too few instances to tell it from chance", tally.undecided);
  }
  if (tally.bounded > 0)
    text += fmt::format("; {} undecided: releases are not known", tally.bounded);
  if (tally.too_close > 0)
    text += fmt::format("; {} too close to tell: values are known within 1.6 %", tally.too_close);
  if (tally.one_sided > 0) text += fmt::format("; {} measured on one side only", tally.one_sided);
  return filled(text + count_words(tally) + '.', style.columns);
}

std::string undecided_words(const std::vector<CallbackChange>& changes, const TextStyle& style) {
  const auto tally = tally_of(changes);
  if (tally.open() + tally.counts == 0) return {};
  return filled(fmt::format("{} of {} undecided{}.", tally.open(),
                            counted(quantiles_of(changes), "quantile"), count_words(tally)),
                style.columns);
}

}  // namespace cie::viewer_export
