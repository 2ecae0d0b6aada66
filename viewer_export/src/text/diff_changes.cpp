#include "diff_changes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string_view>
#include <tuple>
#include <utility>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

using analysis::CallbackChange;
using analysis::Change;
using analysis::Count;
using analysis::QuantileEstimate;

enum Group : int { late_or_worse, worse_quantiles, better, by_chance };

TextCell verdict(Change change) {
  constexpr std::array<Look, 4> kLooks{Look::plain, Look::good, Look::doubtful, Look::bad};
  return {std::string(analysis::label(change)), kLooks.at(static_cast<std::size_t>(change))};
}

TextCell time(const QuantileEstimate& estimate) {
  return {(estimate.is_bound ? ">" : "") + compact_duration(estimate.ns)};
}

double growth(const QuantileEstimate& before, const QuantileEstimate& after) {
  return static_cast<double>(after.ns) / static_cast<double>(std::max<std::int64_t>(before.ns, 1));
}

// Of what was at least so long nothing says how much it grew.
TextCell percent(const QuantileEstimate& before, const QuantileEstimate& after) {
  if (before.ns == 0 || before.is_bound) return not_measured();
  const auto grown = 100 * (static_cast<double>(after.ns) / static_cast<double>(before.ns) - 1);
  return {fmt::format("{}{:+.{}f} %", after.is_bound ? ">" : "", grown,
                      std::abs(grown) < 99.95 ? 1 : 0)};
}

std::string in_words(std::string_view name) {
  std::string words(name);
  std::ranges::replace(words, '_', ' ');
  return words;
}

class Rows {
 public:
  explicit Rows(const CallbackNames& names) : names_(names) {}

  void add(const CallbackChange& change) {
    name_ = names_.of_id(change.logical_id);
    for (const auto count : analysis::kCounts)
      add(change, count);
    for (const auto& quantity : change.quantities) {
      if (quantity.change != Change::worse && quantity.change != Change::better) continue;
      const bool is_worse = quantity.change == Change::worse;
      const auto& before = quantity.before->estimate;
      const auto& after = quantity.after->estimate;
      const auto grown = growth(before, after);
      add(is_worse ? worse_quantiles : better, is_worse ? -grown : grown,
          {{fmt::format("{} p{}", in_words(quantity.quantity), quantity.per_mille / 10)},
           time(before),
           time(after),
           percent(before, after),
           verdict(quantity.change)});
    }
  }

  std::vector<ChangeRow> sorted() && {
    std::ranges::stable_sort(rows_, {},
                             [](const ChangeRow& row) { return std::tuple(row.group, row.rank); });
    return std::move(rows_);
  }

 private:
  void add(Group group, double rank, std::vector<TextCell> cells) {
    rows_.push_back({group, rank, name_, std::move(cells)});
  }

  void add(const CallbackChange& change, Count which) {
    const auto& [before, after, kind] = change.of(which);
    if (!before || !after) return;
    const bool is_late = which == Count::late && *before + *after > 0;
    const bool is_certain = kind == Change::worse || kind == Change::better;
    if (!is_late && !is_certain && !may_be_chance(change, which)) return;
    const auto group = is_late || kind == Change::worse ? late_or_worse
                       : kind == Change::better         ? better
                                                        : by_chance;
    const auto rank = group == late_or_worse ? -static_cast<double>(*before + *after) : 0;
    add(group, rank,
        {{is_late ? "late beyond " + short_duration(change.lateness_after->deadline.ns)
                  : in_words(analysis::label(which))},
         {std::to_string(*before)},
         {std::to_string(*after)},
         not_measured(),
         verdict(kind)});
    if (is_late) add_longest(*change.lateness_before, *change.lateness_after, rank);
  }

  void add_longest(const analysis::Lateness& before, const analysis::Lateness& after, double rank) {
    if (!before.max || !after.max) return;
    const QuantileEstimate max_before{*before.max, before.is_max_bound};
    const QuantileEstimate max_after{*after.max, after.is_max_bound};
    add(late_or_worse, rank,
        {{"response time max"},
         time(max_before),
         time(max_after),
         percent(max_before, max_after),
         not_measured()});
  }

  const CallbackNames& names_;
  std::string name_;
  std::vector<ChangeRow> rows_;
};

}  // namespace

bool may_be_chance(const CallbackChange& change, Count count) {
  const auto& [before, after, kind] = change.of(count);
  if (!before || !after || *before == *after || kind != Change::undecided) return false;
  return count != Count::late ||
         (!change.lateness_before->is_late_bound && !change.lateness_after->is_late_bound);
}

std::vector<ChangeRow> change_rows(const std::vector<CallbackChange>& changes,
                                   const CallbackNames& names) {
  Rows rows(names);
  for (const auto& change : changes)
    rows.add(change);
  return std::move(rows).sorted();
}

std::string change_table(const std::vector<ChangeRow>& rows, std::size_t shown, bool is_all,
                         const TextStyle& style) {
  TextTable table({{"callback", "", TextTable::Align::left},
                   {"quantity", "", TextTable::Align::left},
                   {"before", ""},
                   {"after", ""},
                   {"change", "", TextTable::Align::right, 1},
                   {"", "", TextTable::Align::left}});
  for (std::size_t i = 0; i < shown; ++i) {
    const bool is_next = i > 0 && rows[i].callback == rows[i - 1].callback;
    std::vector<TextCell> cells{{is_next ? "" : rows[i].callback}};
    cells.insert(cells.end(), rows[i].cells.begin(), rows[i].cells.end());
    table.add(std::move(cells));
  }
  if (!is_all && !style.ids) table.keep_rows_on_one_line();
  return table.render(style);
}

}  // namespace cie::viewer_export
