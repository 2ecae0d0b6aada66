#include <cie/viewer_export/diff_writers.hpp>

#include "diff_lists.hpp"
#include "screen.hpp"
#include "words/callback_names.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

using analysis::CallbackChange;
using analysis::Change;
using analysis::QuantityChange;

Look look_of(Change change) {
  switch (change) {
    case Change::worse:
      return Look::bad;
    case Change::better:
      return Look::good;
    case Change::undecided:
      return Look::doubtful;
    case Change::within:
      break;
  }
  return Look::plain;
}

std::string quantile_name(unsigned per_mille) { return fmt::format("p{}", per_mille / 10); }

std::string percent(std::int64_t before, std::int64_t after) {
  if (before == 0) return std::string(kNotMeasured);
  return fmt::format("{:+.1f} %",
                     100 * (static_cast<double>(after) / static_cast<double>(before) - 1));
}

std::string range(const analysis::QuantileInterval& interval) {
  const auto bound = [](const std::optional<std::int64_t>& value) {
    return value ? format_duration(*value) : std::string("?");
  };
  return fmt::format("{} .. {}", bound(interval.lower), bound(interval.upper));
}

bool is_certain(Change change) { return change == Change::worse || change == Change::better; }

// "response time p99".
std::string in_words(const QuantityChange& change) {
  auto name = change.quantity;
  std::ranges::replace(name, '_', ' ');
  return name + ' ' + quantile_name(change.per_mille);
}

double growth(const QuantityChange& change) {
  return static_cast<double>(change.after->estimate) /
         static_cast<double>(std::max<std::int64_t>(change.before->estimate, 1));
}

// Of a callback's certain changes of a kind the largest one; null: there is none.
const QuantityChange* largest(const CallbackChange& callback, Change kind) {
  const QuantityChange* found = nullptr;
  for (const auto& change : callback.quantities) {
    if (change.change != kind) continue;
    const bool is_larger =
        found == nullptr ||
        (kind == Change::worse ? growth(change) > growth(*found) : growth(change) < growth(*found));
    if (is_larger) found = &change;
  }
  return found;
}

bool is_better(const CallbackChange& change) {
  return !change.is_regression() &&
         (change.missed == Change::better || change.exceptions == Change::better ||
          change.lost == Change::better || change.overwritten == Change::better ||
          largest(change, Change::better) != nullptr);
}

// The worst first, the best last.
double rank(const CallbackChange& change) {
  if (const auto* worst = largest(change, Change::worse)) return -growth(*worst);
  if (change.is_regression()) return -1;
  const auto* best = largest(change, Change::better);
  return best == nullptr ? 0 : 1 / std::max(growth(*best), 1e-9);
}

// "  worst      plan timer 20 ms: response time p99 399.4 us -> 4.360 ms, +991.7 %"; the last of it
// where there is room.
std::string extreme(std::string_view label, const CallbackChange& callback, Change kind,
                    const CallbackNames& names, const TextStyle& style) {
  const auto* change = largest(callback, kind);
  if (change == nullptr) return {};
  const auto room = style.columns - 13;
  auto text = fmt::format("{}: {} {} {} {}", names.of_id(callback.logical_id), in_words(*change),
                          format_duration(change->before->estimate), style.unicode ? "→" : "->",
                          format_duration(change->after->estimate));
  const auto share = ", " + percent(change->before->estimate, change->after->estimate);
  if (display_width(text) + share.size() <= room) text += share;
  return fmt::format("  {:<11}", label) + cut(text, room, gap(style)) + '\n';
}

// Counts that differ, by no more than chance explains.
bool is_open(const std::optional<std::uint64_t>& before, const std::optional<std::uint64_t>& after,
             Change change) {
  return before && after && *before != *after && change == Change::undecided;
}

// The callback's name stands on its first line.
void add_quantities(TextTable& table, const CallbackChange& change, const CallbackNames& names,
                    bool has_range) {
  auto name = names.of_id(change.logical_id);
  for (const auto& quantity : change.quantities) {
    if (!is_certain(quantity.change)) continue;
    table.add({{std::exchange(name, {})},
               {in_words(quantity)},
               {format_duration(quantity.before->estimate)},
               {format_duration(quantity.after->estimate)},
               {percent(quantity.before->estimate, quantity.after->estimate)},
               {has_range ? range(*quantity.after) : std::string(kNotMeasured)},
               {std::string(analysis::label(quantity.change)), look_of(quantity.change)}});
  }
  const auto add_count = [&](const char* what, const std::optional<std::uint64_t>& before,
                             const std::optional<std::uint64_t>& after, Change kind) {
    if (!is_certain(kind) && !is_open(before, after, kind)) return;
    table.add({{std::exchange(name, {})},
               {what},
               {std::to_string(*before)},
               {std::to_string(*after)},
               {std::string(kNotMeasured)},
               {std::string(kNotMeasured)},
               {std::string(analysis::label(kind)), look_of(kind)}});
  };
  add_count("missed releases", change.missed_before, change.missed_after, change.missed);
  add_count("exceptions", change.exceptions_before, change.exceptions_after, change.exceptions);
  add_count("lost samples", change.lost_before, change.lost_after, change.lost);
  add_count("overwritten samples", change.overwritten_before, change.overwritten_after,
            change.overwritten);
}

TextTable table_of(const std::vector<CallbackChange>& changes, const CallbackNames& names,
                   bool has_range) {
  TextTable table({{"callback", "", TextTable::Align::left},
                   {"quantity", "", TextTable::Align::left},
                   {"before", "", TextTable::Align::right, 1},
                   {"after", ""},
                   {"change", ""},
                   {"after lies in", ""},
                   {"", "", TextTable::Align::left}});
  for (const auto& change : changes)
    add_quantities(table, change, names, has_range);
  if (!has_range) table.drop_columns_of(kNotMeasured);
  return table;
}

// "26 of 26 callbacks had a thread of their own before, 0 of 26 after".
std::string isolation_words(const DiffContext& context) {
  const auto& before = context.isolation_before;
  const auto& after = context.isolation_after;
  const auto unknown = [](const IsolationCount& count) {
    return count.unknown == 0 ? std::string() : fmt::format(" ({} not known)", count.unknown);
  };
  if (before == after) {
    return fmt::format("{} of {} had a thread of their own{}, before and after", before.own_thread,
                       counted(before.ran, "callback"), unknown(before));
  }
  return fmt::format("{} of {} had a thread of their own{} before, {} of {}{} after",
                     before.own_thread, counted(before.ran, "callback"), unknown(before),
                     after.own_thread, after.ran, unknown(after));
}

// How late runs were before and after is compared against one deadline.
std::vector<const CallbackChange*> with_deadline(const std::vector<CallbackChange>& changes) {
  std::vector<const CallbackChange*> found;
  for (const auto& change : changes) {
    if (change.lateness_before && change.lateness_after &&
        change.lateness_before->deadline == change.lateness_after->deadline) {
      found.push_back(&change);
    }
  }
  // Those that were late most often, then the slowest.
  std::ranges::stable_sort(found, std::greater{}, [](const CallbackChange* change) {
    const auto& before = *change->lateness_before;
    const auto& after = *change->lateness_after;
    return std::tuple(before.late + after.late, std::max(before.max, after.max));
  });
  return found;
}

// "Late: 96 of 970 runs before, 0 of 968 after; 19 callbacks have a deadline".
std::string lateness_words(const std::vector<const CallbackChange*>& changes,
                           const TextStyle& style) {
  analysis::Lateness before{};
  analysis::Lateness after{};
  for (const auto* change : changes) {
    before.late += change->lateness_before->late;
    before.instances += change->lateness_before->instances;
    after.late += change->lateness_after->late;
    after.instances += change->lateness_after->instances;
  }
  const auto share = [&style](const analysis::Lateness& all) {
    return paint(fmt::format("{} of {}", all.late, all.instances),
                 all.late > 0 ? Look::bad : Look::good, style);
  };
  return fmt::format("Late: {} runs before, {} after; {} {} a deadline\n", share(before),
                     share(after), counted(changes.size(), "callback"),
                     changes.size() == 1 ? "has" : "have");
}

// Empty where each callback has the deadline that it had.
std::string other_deadlines(const std::vector<CallbackChange>& changes) {
  const auto deadline = [](const std::optional<analysis::Lateness>& lateness) {
    return lateness ? std::optional(lateness->deadline) : std::nullopt;
  };
  const auto others = std::ranges::count_if(changes, [&deadline](const CallbackChange& change) {
    return change.is_before && change.is_after &&
           deadline(change.lateness_before) != deadline(change.lateness_after);
  });
  if (others == 0) return {};
  return fmt::format("  {:<11}{} another deadline than before: not compared\n", "deadlines",
                     others == 1 ? "1 callback has" : fmt::format("{} callbacks have", others));
}

// What the sides are called above columns: their last names where these are short and differ.
std::pair<std::string, std::string> column_names(const DiffContext& context) {
  constexpr std::size_t kWidest = 8;
  const auto last = [](const std::string& path) {
    const auto end = path.find_last_not_of('/') + 1;
    return printable(path.substr(0, end).substr(path.substr(0, end).rfind('/') + 1));
  };
  auto before = last(context.before);
  auto after = last(context.after);
  const auto is_short = [](const std::string& name) {
    return !name.empty() && display_width(name) <= kWidest;
  };
  if (before == after || !is_short(before) || !is_short(after)) return {"before", "after"};
  return {std::move(before), std::move(after)};
}

// Deadlines kept and missed, side by side.
std::string deadline_table(const std::vector<const CallbackChange*>& changes,
                           const DiffContext& context, const CallbackNames& names,
                           const TextStyle& style) {
  constexpr std::size_t kMost = 5;
  const auto most = context.is_all ? changes.size() : kMost;
  const auto deadline = changes.front()->lateness_after->deadline;
  const auto is_common = std::ranges::all_of(changes, [deadline](const CallbackChange* change) {
    return change->lateness_after->deadline == deadline;
  });
  const auto [name_before, name_after] = column_names(context);
  using Align = TextTable::Align;
  TextTable table(
      {{is_common ? "deadline " + compact_duration(deadline.ns) : "", "callback", Align::left},
       {"", "deadline"},
       {"late", name_before},
       {"", name_after},
       {"p99", name_before, Align::right, 2},
       {"", name_after, Align::right, 2},
       {"max", name_before, Align::right, 1},
       {"", name_after, Align::right, 1}});
  const auto shown = std::min(most, changes.size());
  const auto time = [](const std::optional<std::int64_t>& ns, std::string_view mark = {}) {
    return ns ? TextCell{std::string(mark) + compact_duration(*ns)} : not_measured();
  };
  const auto longest = [&time](const analysis::Lateness& all) {
    return time(all.max, all.is_max_bound ? ">" : "");
  };
  const auto late = [](std::uint64_t count) {
    return TextCell{std::to_string(count), count > 0 ? Look::bad : Look::plain};
  };
  for (const auto* change : std::span(changes).first(shown)) {
    const auto& before = *change->lateness_before;
    const auto& after = *change->lateness_after;
    std::optional<std::int64_t> p99_before;
    std::optional<std::int64_t> p99_after;
    for (const auto& quantity : change->quantities) {
      if (quantity.quantity != "response_time" || quantity.per_mille != 990) continue;
      if (quantity.before) p99_before = quantity.before->estimate;
      if (quantity.after) p99_after = quantity.after->estimate;
    }
    table.add({{names.of_id(change->logical_id)},
               {is_common ? "-" : compact_duration(after.deadline.ns)},
               late(before.late),
               late(after.late),
               time(p99_before),
               time(p99_after),
               longest(before),
               longest(after)});
  }
  table.drop_columns_of(kNotMeasured);
  table.keep_rows_on_one_line();
  auto text = table.render(style);
  const auto rest = std::span(changes).subspan(shown);
  if (rest.empty()) return text;
  const auto are_late = std::ranges::any_of(rest, [](const CallbackChange* change) {
    return change->lateness_before->late + change->lateness_after->late > 0;
  });
  return text + fmt::format("  {} {}{}\n", gap(style), counted(rest.size(), "more callback"),
                            are_late ? "" : ", never late");
}

// How many comparisons came to what.
struct Tally {
  std::uint64_t within = 0;     // quantiles
  std::uint64_t undecided = 0;  // quantiles and counts
  std::uint64_t too_close = 0;  // which no number of instances would decide
  std::uint64_t one_sided = 0;  // measured on one side only
};

// Whether the interval is as narrow as histograms know values: a bucket is 1/64 of its least value.
bool is_a_bucket(const analysis::QuantileInterval& interval) {
  constexpr std::int64_t kPerBucket = 64;
  return interval.lower && interval.upper &&
         *interval.upper - *interval.lower <= *interval.lower / kPerBucket;
}

void add_to(Tally& tally, const QuantityChange& change) {
  if (change.before.has_value() != change.after.has_value()) {
    ++tally.one_sided;
  } else if (change.change == Change::within) {
    ++tally.within;
  } else if (change.change == Change::undecided) {
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
         {is_open(change.missed_before, change.missed_after, change.missed),
          is_open(change.exceptions_before, change.exceptions_after, change.exceptions),
          is_open(change.lost_before, change.lost_after, change.lost),
          is_open(change.overwritten_before, change.overwritten_after, change.overwritten)}) {
      tally.undecided += is_undecided ? 1U : 0U;
    }
  }
  return tally;
}

std::string tally_words(const std::vector<CallbackChange>& changes, const TextStyle& style) {
  const auto tally = tally_of(changes);
  auto text =
      fmt::format("{} within the tolerance; {} undecided: too few instances to tell it from chance",
                  counted(tally.within, "quantile"), tally.undecided);
  if (tally.too_close > 0)
    text += fmt::format("; {} too close to tell: values are known within 1.6 %", tally.too_close);
  if (tally.one_sided > 0) text += fmt::format("; {} measured on one side only", tally.one_sided);
  return filled(text + '.', style.columns);
}

// Empty if something is better, or of some quantile it is certain how it changed or that it did not.
std::string undecided_times(const std::vector<CallbackChange>& changes) {
  const auto has_certain = [](const CallbackChange& change) {
    return is_better(change) ||
           std::ranges::any_of(change.quantities, is_certain, &QuantityChange::change);
  };
  if (tally_of(changes).within > 0 || std::ranges::any_of(changes, has_certain)) return {};
  const auto quantiles = std::accumulate(
      changes.begin(), changes.end(), std::size_t{0},
      [](auto sum, const CallbackChange& change) { return sum + change.quantities.size(); });
  const auto why = quantiles == 0
                       ? std::string("none was measured on both sides")
                       : fmt::format("of {} none is certain", counted(quantiles, "quantile"));
  return "Times undecided: " + why + "; no other regression";
}

// "Worse: 1 of 3 callbacks; better: 1, beyond a tolerance of 5 %".
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
      fact = {"Undecided: no regression in what was recorded", Look::doubtful};
      break;
    case analysis::Outcome::nothing_compared:
      return paint("Nothing to compare: no callback ran before and after\n", Look::doubtful, style);
    case analysis::Outcome::no_regression:
      if (const auto times = undecided_times(changes); !times.empty())
        return paint(times, Look::doubtful, style) + '\n';
      fact = {is_whole ? "No regression" : "No regression in what was recorded", Look::good};
      break;
  }
  std::string more;
  if (better > 0) {
    const auto of =
        regressions > 0 ? fmt::format("{}", better) : fmt::format("{} of {}", better, all);
    more = "; better: " + of;
  }
  const auto limit = fmt::format(", beyond a tolerance of {:g} %", 100 * tolerance);
  constexpr std::size_t kIndent = 2;
  const auto text = filled(fact.text + more + limit, style.columns, kIndent);
  const auto rest = std::string_view(text).substr(fact.text.size());
  const auto told = rest.starts_with(more) ? more.size() : 0;
  return paint(fact.text, fact.look, style) +
         (told > 0 ? paint(rest.substr(0, told), Look::good, style) : "") +
         std::string(rest.substr(told));
}

bool is_decided(const analysis::Comparison& comparison) {
  const auto outcome = comparison.outcome();
  return outcome == analysis::Outcome::regression ||
         (outcome == analysis::Outcome::no_regression &&
          undecided_times(comparison.callbacks).empty());
}

}  // namespace

IsolationCount isolation_count(const std::vector<analysis::CallbackSample>& samples) {
  IsolationCount count;
  for (const auto& sample : samples) {
    count.own_thread += sample.isolation == analysis::Isolation::isolated ? 1U : 0U;
    count.unknown += sample.isolation ? 0U : 1U;
    count.ran += sample.isolation == analysis::Isolation::never_ran ? 0U : 1U;
  }
  return count;
}

void write_diff_text(std::ostream& out, const analysis::Comparison& comparison,
                     const DiffContext& context, const TextStyle& style) {
  const auto& changes = comparison.callbacks;
  std::vector<std::string> ids;
  ids.reserve(changes.size());
  for (const auto& change : changes)
    ids.push_back(change.logical_id);
  const CallbackNames names(ids, style);
  auto by_rank = changes;
  std::ranges::stable_sort(by_rank, {}, rank);
  const auto print = [&out](const Lines& lines) {
    for (const auto& line : lines)
      out << line << '\n';
  };
  const auto urgent = with_deadline(changes);
  const auto outcome = outcome_words(comparison, context.tolerance, style);
  const auto lateness = urgent.empty() ? std::string() : lateness_words(urgent, style);
  out << (is_decided(comparison) ? lateness + outcome : outcome + lateness);
  print(record_lines(comparison, style));
  constexpr std::size_t kLabel = 11;
  out << filled(fmt::format("  {:<{}}{}", "isolation", kLabel, isolation_words(context)),
                style.columns, kLabel)
      << other_deadlines(changes);
  if (!by_rank.empty()) out << extreme("worst", by_rank.front(), Change::worse, names, style);
  const auto is_brief = !urgent.empty() && !context.is_all;
  if (!is_brief) {
    if (!by_rank.empty()) out << extreme("best", by_rank.back(), Change::better, names, style);
    out << fmt::format("  {:<11}{}\n  {:<11}{}\n", "before", printable(context.before), "after",
                       printable(context.after));
  }
  out << '\n';
  const auto structure = structural_changes(changes, names, style);
  print(structure);
  if (!structure.empty()) out << '\n';
  if (!urgent.empty()) out << deadline_table(urgent, context, names, style);
  if (is_brief) {
    print(commands_to_paste({{"every change", "cie diff " + context.arguments + " --all"}}, style));
    return;
  }
  if (!urgent.empty()) out << '\n';
  auto table = table_of(by_rank, names, true);
  if (table.natural_width() > style.columns) table = table_of(by_rank, names, false);
  if (!table.is_empty()) out << table.render(style) << '\n';
  out << tally_words(changes, style)
      << filled(
             fmt::format(
                 "Each statement is certain to {:g} % if instances are independent of each other.",
                 100 * (1 - analysis::kComparisonError)),
             style.columns);
}

}  // namespace cie::viewer_export
