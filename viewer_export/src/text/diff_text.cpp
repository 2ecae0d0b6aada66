#include <cie/viewer_export/diff_writers.hpp>

#include "screen.hpp"
#include "words/callback_names.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
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
  if (before == 0) return "-";
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
         (change.missed == Change::better || largest(change, Change::better) != nullptr);
}

// The worst first, the best last.
double rank(const CallbackChange& change) {
  if (const auto* worst = largest(change, Change::worse)) return -growth(*worst);
  if (change.is_regression()) return -1;
  const auto* best = largest(change, Change::better);
  return best == nullptr ? 0 : 1 / std::max(growth(*best), 1e-9);
}

// "  worst      plan timer 20 ms: response time p99 +991.7 %, 399.4 us -> 4.360 ms".
std::string extreme(std::string_view label, const CallbackChange& callback, Change kind,
                    const CallbackNames& names, const TextStyle& style) {
  const auto* change = largest(callback, kind);
  if (change == nullptr) return {};
  const auto text =
      fmt::format("{}: {} {}, {} {} {}", names.of_id(callback.logical_id), in_words(*change),
                  percent(change->before->estimate, change->after->estimate),
                  format_duration(change->before->estimate), style.unicode ? "→" : "->",
                  format_duration(change->after->estimate));
  return fmt::format("  {:<11}", label) + cut(text, style.columns - 13, gap(style)) + '\n';
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
               {has_range ? range(*quantity.after) : "-"},
               {std::string(analysis::label(quantity.change)), look_of(quantity.change)}});
  }
  if (is_certain(change.missed)) {
    table.add({{std::exchange(name, {})},
               {"missed releases"},
               {std::to_string(change.missed_before.value_or(0))},
               {std::to_string(change.missed_after.value_or(0))},
               {"-"},
               {"-"},
               {std::string(analysis::label(change.missed)), look_of(change.missed)}});
  }
}

TextTable table_of(const std::vector<CallbackChange>& changes, const CallbackNames& names,
                   bool has_range) {
  TextTable table({{"callback", "", TextTable::Align::left},
                   {"quantity", "", TextTable::Align::left},
                   {"before", ""},
                   {"after", ""},
                   {"change", ""},
                   {"after lies in", ""},
                   {"", "", TextTable::Align::left}});
  for (const auto& change : changes)
    add_quantities(table, change, names, has_range);
  if (!has_range) table.drop_columns_of("-");
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

std::string structural_changes(const std::vector<CallbackChange>& changes,
                               const CallbackNames& names, const TextStyle& style) {
  std::string text;
  const auto say = [&](std::string_view what, Look look, const auto& is_so) {
    std::string all;
    for (const auto& change : changes) {
      if (is_so(change)) all += (all.empty() ? "" : ", ") + names.of_id(change.logical_id);
    }
    if (all.empty()) return;
    constexpr std::size_t kMost = 3;
    for (const auto& line : paragraph(fmt::format("  {}: ", what), all, kMost, style))
      text += paint(line, look, style) + '\n';
  };
  say("is gone", Look::bad, [](const auto& c) { return c.is_before && !c.is_after; });
  say("is new", Look::plain, [](const auto& c) { return !c.is_before; });
  say("no longer has a thread of its own", Look::bad,
      [](const auto& c) { return c.lost_isolation; });
  return text;
}

std::size_t count_of(const std::vector<CallbackChange>& changes, Change wanted) {
  std::size_t count = 0;
  for (const auto& change : changes) {
    for (const auto& quantity : change.quantities)
      count += quantity.change == wanted ? 1U : 0U;
  }
  return count;
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

void write_diff_text(std::ostream& out, const std::vector<CallbackChange>& changes,
                     const DiffContext& context, const TextStyle& style) {
  std::vector<std::string> ids;
  for (const auto& change : changes)
    ids.push_back(change.logical_id);
  const CallbackNames names(ids, style);
  auto by_rank = changes;
  std::ranges::stable_sort(by_rank, {}, rank);
  const auto regressions = static_cast<std::uint64_t>(
      std::ranges::count_if(changes, [](const auto& change) { return change.is_regression(); }));
  const auto better = static_cast<std::uint64_t>(std::ranges::count_if(changes, is_better));
  const auto all = counted(changes.size(), "callback");
  auto outcome = regressions > 0
                     ? paint(fmt::format("Worse: {} of {}", regressions, all), Look::bad, style)
                     : paint("No regression", Look::good, style);
  if (better > 0) {
    const auto of =
        regressions > 0 ? fmt::format("{}", better) : fmt::format("{} of {}", better, all);
    outcome += "; " + paint("better: " + of, Look::good, style);
  }
  out << fmt::format("{}, beyond a tolerance of {:g} %\n", outcome, 100 * context.tolerance)
      << fmt::format("  {:<11}{}\n", "isolation", isolation_words(context));
  if (!by_rank.empty()) {
    out << extreme("worst", by_rank.front(), Change::worse, names, style)
        << extreme("best", by_rank.back(), Change::better, names, style);
  }
  out << fmt::format("  {:<11}{}\n  {:<11}{}\n\n", "before", printable(context.before), "after",
                     printable(context.after));
  const auto structure = structural_changes(changes, names, style);
  if (!structure.empty()) out << structure << '\n';
  auto table = table_of(by_rank, names, true);
  if (table.natural_width() > style.columns) table = table_of(by_rank, names, false);
  if (!table.is_empty()) out << table.render(style) << '\n';
  out << fmt::format(
      "{} within the tolerance; {} undecided: too few instances to tell it from chance.\n"
      "Each statement is certain to {:g} % if instances are independent of each other.\n",
      counted(count_of(changes, Change::within), "quantile"), count_of(changes, Change::undecided),
      100 * (1 - analysis::kComparisonError));
}

}  // namespace cie::viewer_export
