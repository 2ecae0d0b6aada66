#include "diff_changes.hpp"

#include "diff_lists.hpp"
#include "screen.hpp"

#include <algorithm>
#include <string>
#include <utility>

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

std::string duration_or_bound(const analysis::QuantileEstimate& estimate) {
  return (estimate.is_bound ? ">" : "") + format_duration(estimate.ns);
}

// Of what was at least so long nothing says how much it grew.
std::string percent(const analysis::QuantileEstimate& before,
                    const analysis::QuantileEstimate& after) {
  if (before.ns == 0 || before.is_bound) return std::string(kNotMeasured);
  return fmt::format("{}{:+.1f} %", after.is_bound ? ">" : "",
                     100 * (static_cast<double>(after.ns) / static_cast<double>(before.ns) - 1));
}

std::string range(const analysis::QuantileInterval& interval) {
  const auto bound = [](const std::optional<std::int64_t>& value) {
    return value ? format_duration(*value) : std::string("?");
  };
  return fmt::format("{} .. {}", bound(interval.lower), bound(interval.upper));
}

std::string quantile_name(unsigned per_mille) { return fmt::format("p{}", per_mille / 10); }

// "response time p99".
std::string in_words(const QuantityChange& change) {
  auto name = change.quantity;
  std::ranges::replace(name, '_', ' ');
  return name + ' ' + quantile_name(change.per_mille);
}

double growth(const QuantityChange& change) {
  return static_cast<double>(change.after->estimate.ns) /
         static_cast<double>(std::max<std::int64_t>(change.before->estimate.ns, 1));
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

constexpr std::size_t kRangeColumn = 5;

}  // namespace

bool is_open(const std::optional<std::uint64_t>& before, const std::optional<std::uint64_t>& after,
             Change change) {
  return before && after && *before != *after && change == Change::undecided;
}

bool is_late_open(const CallbackChange& change) {
  if (!change.has_one_deadline()) return false;
  const auto& before = *change.lateness_before;
  const auto& after = *change.lateness_after;
  return !before.is_late_bound && !after.is_late_bound &&
         is_open(before.late, after.late, change.late);
}

bool is_better(const CallbackChange& change) {
  return !change.is_regression() &&
         (change.late == Change::better || change.missed == Change::better ||
          change.exceptions == Change::better || change.lost == Change::better ||
          change.overwritten == Change::better || largest(change, Change::better) != nullptr);
}

double change_rank(const CallbackChange& change) {
  if (const auto* worst = largest(change, Change::worse)) return -growth(*worst);
  if (change.is_regression()) return -1;
  const auto* best = largest(change, Change::better);
  return best == nullptr ? 0 : 1 / std::max(growth(*best), 1e-9);
}

std::string extreme_line(std::string_view label, const CallbackChange& callback, Change kind,
                         const CallbackNames& names, const TextStyle& style) {
  const auto* change = largest(callback, kind);
  if (change == nullptr) return {};
  const auto room = style.columns - 13;
  const auto times =
      fmt::format(": {} {} {} {}", in_words(*change), duration_or_bound(change->before->estimate),
                  style.unicode ? "→" : "->", duration_or_bound(change->after->estimate));
  constexpr std::size_t kLeastOfAName = 8;
  const auto left = room - std::min(room, display_width(times));
  auto text =
      elide(names.of_id(callback.logical_id), std::max(left, kLeastOfAName), gap(style)) + times;
  const auto growth = percent(change->before->estimate, change->after->estimate);
  const auto share = growth == kNotMeasured ? "" : ", " + growth;
  if (display_width(text) + share.size() <= room) text += share;
  return fmt::format("  {:<{}}", label, kDiffLabel) + cut(text, room, gap(style)) + '\n';
}

void add_changes(std::vector<ChangeRow>& rows, const CallbackChange& change,
                 const CallbackNames& names) {
  auto name = names.of_id(change.logical_id);
  for (const auto& quantity : change.quantities) {
    if (!is_certain(quantity.change)) continue;
    rows.push_back({{std::exchange(name, {})},
                    {in_words(quantity)},
                    {duration_or_bound(quantity.before->estimate)},
                    {duration_or_bound(quantity.after->estimate)},
                    {percent(quantity.before->estimate, quantity.after->estimate)},
                    {range(*quantity.after)},
                    {std::string(analysis::label(quantity.change)), look_of(quantity.change)}});
  }
  const auto add_row = [&](const char* what, std::uint64_t before, std::uint64_t after,
                           Change kind) {
    rows.push_back({{std::exchange(name, {})},
                    {what},
                    {std::to_string(before)},
                    {std::to_string(after)},
                    not_measured(),
                    not_measured(),
                    {std::string(analysis::label(kind)), look_of(kind)}});
  };
  const auto add_count = [&](const char* what, const std::optional<std::uint64_t>& before,
                             const std::optional<std::uint64_t>& after, Change kind) {
    if (is_certain(kind) || is_open(before, after, kind)) add_row(what, *before, *after, kind);
  };
  if (is_certain(change.late) || is_late_open(change))
    add_row("late", change.lateness_before->late, change.lateness_after->late, change.late);
  add_count("missed releases", change.missed_before, change.missed_after, change.missed);
  add_count("exceptions", change.exceptions_before, change.exceptions_after, change.exceptions);
  add_count("lost samples", change.lost_before, change.lost_after, change.lost);
  add_count("overwritten samples", change.overwritten_before, change.overwritten_after,
            change.overwritten);
}

std::string change_table(std::span<const ChangeRow> rows, const TextStyle& style) {
  TextTable table({{"callback", "", TextTable::Align::left},
                   {"quantity", "", TextTable::Align::left},
                   {"before", "", TextTable::Align::right, 1},
                   {"after", ""},
                   {"change", ""},
                   {"after lies in", ""},
                   {"", "", TextTable::Align::left}});
  const auto fill = [](TextTable empty, std::span<const ChangeRow> all, bool has_range) {
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

std::string change_table(std::span<const ChangeRow> rows, std::size_t lines,
                         const TextStyle& style) {
  for (auto shown = std::min(rows.size(), lines); shown > 0; --shown) {
    auto text = change_table(rows.first(shown), style);
    if (shown < rows.size())
      text += fmt::format("  {} {}\n", gap(style), counted(rows.size() - shown, "more change"));
    if (std::cmp_less_equal(std::ranges::count(text, '\n'), lines)) return text;
  }
  return rows.empty() ? "" : fmt::format("  {} {}\n", gap(style), counted(rows.size(), "change"));
}

}  // namespace cie::viewer_export
