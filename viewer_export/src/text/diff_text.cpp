#include <cie/viewer_export/diff_writers.hpp>

#include "words/text_layout.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

using analysis::CallbackChange;
using analysis::Change;

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

// The callback's name stands on its first line.
void add_quantities(TextTable& table, const CallbackChange& change) {
  auto name = printable(change.logical_id);
  for (const auto& quantity : change.quantities) {
    const bool is_certain = quantity.change == Change::worse || quantity.change == Change::better;
    if (!is_certain) continue;
    table.add({{std::exchange(name, {})},
               {fmt::format("{} {}", quantity.quantity, quantile_name(quantity.per_mille))},
               {format_duration(quantity.before->estimate)},
               {format_duration(quantity.after->estimate)},
               {percent(quantity.before->estimate, quantity.after->estimate)},
               {range(*quantity.after)},
               {std::string(analysis::label(quantity.change)), look_of(quantity.change)}});
  }
  if (change.missed == Change::worse || change.missed == Change::better) {
    table.add({{std::exchange(name, {})},
               {"missed releases"},
               {std::to_string(change.missed_before.value_or(0))},
               {std::to_string(change.missed_after.value_or(0))},
               {"-"},
               {"-"},
               {std::string(analysis::label(change.missed)), look_of(change.missed)}});
  }
}

std::string structural_changes(const std::vector<CallbackChange>& changes, const TextStyle& style) {
  std::string text;
  const auto say = [&](const CallbackChange& change, std::string_view what, Look look) {
    text += fmt::format("{} {}\n", printable(change.logical_id), paint(what, look, style));
  };
  for (const auto& change : changes) {
    if (change.is_before && !change.is_after) say(change, "is gone", Look::bad);
    if (!change.is_before) say(change, "is new", Look::plain);
    if (change.lost_isolation) say(change, "no longer has a thread of its own", Look::bad);
  }
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

void write_diff_text(std::ostream& out, const std::vector<CallbackChange>& changes,
                     const DiffContext& context, const TextStyle& style) {
  const auto regressions = static_cast<std::uint64_t>(
      std::ranges::count_if(changes, [](const auto& change) { return change.is_regression(); }));
  const auto outcome =
      regressions > 0
          ? paint(fmt::format("Worse: {} of {}", regressions, counted(changes.size(), "callback")),
                  Look::bad, style)
          : paint("No regression", Look::good, style);
  out << fmt::format("{}, beyond a tolerance of {:g} %\n", outcome, 100 * context.tolerance)
      << fmt::format("  before  {}\n  after   {}\n\n", printable(context.before),
                     printable(context.after));
  const auto structure = structural_changes(changes, style);
  if (!structure.empty()) out << structure << '\n';
  TextTable table({{"callback", "", TextTable::Align::left},
                   {"quantity", "", TextTable::Align::left},
                   {"before", ""},
                   {"after", ""},
                   {"change", ""},
                   {"after lies in", ""},
                   {"", "", TextTable::Align::left}});
  for (const auto& change : changes)
    add_quantities(table, change);
  if (!table.is_empty()) out << table.render(style) << '\n';
  out << fmt::format(
      "{} within the tolerance; {} undecided: too few instances to tell it from chance.\n"
      "Each statement is certain to {:g} % if instances are independent of each other.\n",
      counted(count_of(changes, Change::within), "quantile"), count_of(changes, Change::undecided),
      100 * (1 - analysis::kComparisonError));
}

}  // namespace cie::viewer_export
