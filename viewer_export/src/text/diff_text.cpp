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

constexpr std::size_t kLabel = 11;  // columns of what a fact is about

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
  return fmt::format("  {:<{}}", label, kLabel) + cut(text, room, gap(style)) + '\n';
}

// Counts that differ, by no more than chance explains.
bool is_open(const std::optional<std::uint64_t>& before, const std::optional<std::uint64_t>& after,
             Change change) {
  return before && after && *before != *after && change == Change::undecided;
}

using Row = std::vector<TextCell>;

// The callback's name stands on its first line.
void add_quantities(std::vector<Row>& rows, const CallbackChange& change,
                    const CallbackNames& names) {
  auto name = names.of_id(change.logical_id);
  for (const auto& quantity : change.quantities) {
    if (!is_certain(quantity.change)) continue;
    rows.push_back({{std::exchange(name, {})},
                    {in_words(quantity)},
                    {format_duration(quantity.before->estimate)},
                    {format_duration(quantity.after->estimate)},
                    {percent(quantity.before->estimate, quantity.after->estimate)},
                    {range(*quantity.after)},
                    {std::string(analysis::label(quantity.change)), look_of(quantity.change)}});
  }
  const auto add_count = [&](const char* what, const std::optional<std::uint64_t>& before,
                             const std::optional<std::uint64_t>& after, Change kind) {
    if (!is_certain(kind) && !is_open(before, after, kind)) return;
    rows.push_back({{std::exchange(name, {})},
                    {what},
                    {std::to_string(*before)},
                    {std::to_string(*after)},
                    not_measured(),
                    not_measured(),
                    {std::string(analysis::label(kind)), look_of(kind)}});
  };
  add_count("missed releases", change.missed_before, change.missed_after, change.missed);
  add_count("exceptions", change.exceptions_before, change.exceptions_after, change.exceptions);
  add_count("lost samples", change.lost_before, change.lost_after, change.lost);
  add_count("overwritten samples", change.overwritten_before, change.overwritten_after,
            change.overwritten);
}

constexpr std::size_t kRangeColumn = 5;

// Where ranges have no room, they are left out.
std::string table_of(std::span<const Row> rows, const TextStyle& style) {
  TextTable table({{"callback", "", TextTable::Align::left},
                   {"quantity", "", TextTable::Align::left},
                   {"before", "", TextTable::Align::right, 1},
                   {"after", ""},
                   {"change", ""},
                   {"after lies in", ""},
                   {"", "", TextTable::Align::left}});
  const auto fill = [](TextTable empty, std::span<const Row> all, bool has_range) {
    for (auto row : all) {
      if (!has_range) row[kRangeColumn] = not_measured();
      empty.add(std::move(row));
    }
    if (!has_range) empty.drop_columns_of(kNotMeasured);
    return empty;
  };
  auto whole = fill(table, rows, true);
  return (whole.natural_width() > style.columns ? fill(table, rows, false) : whole).render(style);
}

// As many of the changes as that many lines have room for, and how many more there are.
std::string changes_in(std::size_t lines, std::span<const Row> rows, const TextStyle& style) {
  for (auto shown = std::min(rows.size(), lines); shown > 0; --shown) {
    auto text = table_of(rows.first(shown), style);
    if (shown < rows.size())
      text += fmt::format("  {} {}\n", gap(style), counted(rows.size() - shown, "more change"));
    if (std::cmp_less_equal(std::ranges::count(text, '\n'), lines)) return text;
  }
  return rows.empty() ? "" : fmt::format("  {} {}\n", gap(style), counted(rows.size(), "change"));
}

// "26 of 26 callbacks had a thread of their own before, 0 to 11 of 26 after": of 11 it is not known.
std::string isolation_words(const DiffContext& context) {
  const auto& before = context.isolation_before;
  const auto& after = context.isolation_after;
  const auto isolated = [](const IsolationCount& count) {
    return count.unknown == 0
               ? fmt::format("{}", count.own_thread)
               : fmt::format("{} to {}", count.own_thread, count.own_thread + count.unknown);
  };
  const auto told = fmt::format("{} of {} had a thread of their own", isolated(before),
                                counted(before.ran, "callback"));
  if (before == after) return told + " before and after";
  return fmt::format("{} before, {} of {} after", told, isolated(after), after.ran);
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
  return fmt::format("  {:<{}}{} another deadline than before: not compared\n", "deadlines", kLabel,
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

// Deadlines kept and missed, side by side, of at most so many callbacks.
std::string deadline_table(const std::vector<const CallbackChange*>& changes,
                           const DiffContext& context, const CallbackNames& names, std::size_t most,
                           const TextStyle& style) {
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

// Empty where nothing was compared.
std::string tally_words(const std::vector<CallbackChange>& changes, const TextStyle& style) {
  const auto tally = tally_of(changes);
  if (tally.within + tally.undecided + tally.too_close + tally.one_sided == 0) return {};
  auto text = counted(tally.within, "quantile") + " within the tolerance";
  if (tally.undecided > 0) {
    text +=
        fmt::format("; {} undecided: too few instances to tell it from chance", tally.undecided);
  }
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
      if (!comparison.has_compared())
        return paint("Undecided: no callback ran in both recordings\n", Look::doubtful, style);
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

std::size_t line_count(std::string_view text) {
  return static_cast<std::size_t>(std::ranges::count(text, '\n'));
}

std::string text_of(const Lines& lines) {
  std::string text;
  for (const auto& line : lines)
    text += line + '\n';
  return text;
}

class DiffText {
 public:
  DiffText(const analysis::Comparison& comparison, const DiffContext& context,
           const TextStyle& style)
      : comparison_(comparison),
        context_(context),
        style_(style),
        names_(ids_of(comparison.callbacks), style),
        by_rank_(comparison.callbacks),
        urgent_(with_deadline(comparison.callbacks)) {
    std::ranges::stable_sort(by_rank_, {}, rank);
    for (const auto& change : by_rank_)
      add_quantities(changes_, change, names_);
  }

  std::string whole() const {
    auto text = facts(ListLength::whole, true) +
                fmt::format("  {:<{}}{}\n  {:<{}}{}\n\n", "before", kLabel,
                            printable(context_.before), "after", kLabel, printable(context_.after));
    if (const auto lines = structure(ListLength::whole); !lines.empty())
      text += text_of(lines) + '\n';
    if (!urgent_.empty())
      text += deadline_table(urgent_, context_, names_, urgent_.size(), style_) + '\n';
    if (!changes_.empty()) text += table_of(changes_, style_) + '\n';
    return text + statistics();
  }

  // At most kScreenLines: what is left out, the command at its end prints.
  std::string screen() const {
    auto text = facts(ListLength::screen, urgent_.empty());
    const auto lists = first_of_structure();
    if (!lists.empty()) text += '\n' + text_of(lists);
    auto end = urgent_.empty() ? statistics() : std::string();
    if (!lists.empty() || !changes_.empty() || !urgent_.empty()) {
      end += text_of(commands_to_paste(
          {{"every change", "cie diff " + context_.arguments + " --all"}}, style_));
    }
    const auto taken = line_count(text) + line_count(end) + 1;  // and a blank line
    const auto room = kScreenLines - std::min(kScreenLines, taken);
    if (!urgent_.empty()) return text + '\n' + deadlines_in(room) + end;
    if (!changes_.empty())
      text += '\n' + changes_in(room - std::min<std::size_t>(room, 1), changes_, style_);
    return text + (end.empty() ? "" : "\n") + end;
  }

 private:
  static std::vector<std::string> ids_of(const std::vector<CallbackChange>& changes) {
    std::vector<std::string> ids;
    ids.reserve(changes.size());
    for (const auto& change : changes)
      ids.push_back(change.logical_id);
    return ids;
  }

  // Up to the worst and, where wanted, the best change.
  std::string facts(ListLength length, bool has_best) const {
    const auto outcome = outcome_words(comparison_, context_.tolerance, style_);
    const auto lateness = urgent_.empty() ? std::string() : lateness_words(urgent_, style_);
    auto text = (is_decided(comparison_) ? lateness + outcome : outcome + lateness) +
                text_of(record_lines(comparison_, length, style_));
    if (context_.isolation_before.ran != 0 && context_.isolation_after.ran != 0) {
      text += filled(fmt::format("  {:<{}}{}", "isolation", kLabel, isolation_words(context_)),
                     style_.columns, kLabel);
    }
    text += other_deadlines(comparison_.callbacks);
    if (by_rank_.empty()) return text;
    text += extreme("worst", by_rank_.front(), Change::worse, names_, style_);
    if (has_best) text += extreme("best", by_rank_.back(), Change::better, names_, style_);
    return text;
  }

  Lines structure(ListLength length) const {
    return structural_changes(comparison_.callbacks, names_, length, style_);
  }

  // What is worse comes first.
  Lines first_of_structure() const {
    constexpr std::size_t kMost = 5;
    auto lines = structure(ListLength::screen);
    if (lines.size() <= kMost) return lines;
    const auto left = lines.size() - kMost + 1;
    lines.resize(kMost - 1);
    lines.push_back(fmt::format("  {} {} more kinds of change", gap(style_), left));
    return lines;
  }

  std::string deadlines_in(std::size_t lines) const {
    constexpr std::size_t kAround = 3;  // two of titles, one of what is left out
    constexpr std::size_t kMost = 5;
    const auto room = lines - std::min(lines, kAround);
    return deadline_table(urgent_, context_, names_, std::clamp<std::size_t>(room, 1, kMost),
                          style_);
  }

  // How sure the comparison is; empty where there was nothing to compare.
  std::string statistics() const {
    const auto tally = tally_words(comparison_.callbacks, style_);
    if (tally.empty() && changes_.empty()) return {};
    return tally + filled(fmt::format("Each statement is certain to {:g} % if instances are "
                                      "independent of each other.",
                                      100 * (1 - analysis::kComparisonError)),
                          style_.columns);
  }

  const analysis::Comparison& comparison_;
  const DiffContext& context_;
  const TextStyle& style_;
  CallbackNames names_;
  std::vector<CallbackChange> by_rank_;
  std::vector<const CallbackChange*> urgent_;
  std::vector<Row> changes_;  // those that are certain
};

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
  const DiffText text(comparison, context, style);
  out << (context.is_all ? text.whole() : text.screen());
}

}  // namespace cie::viewer_export
