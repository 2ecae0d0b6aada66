#include "diff_deadlines.hpp"

#include "diff_lists.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <tuple>
#include <utility>

#include <fmt/format.h>

namespace cie::viewer_export {

namespace {

using analysis::CallbackChange;

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

}  // namespace

std::vector<const CallbackChange*> with_deadline(const std::vector<CallbackChange>& changes) {
  std::vector<const CallbackChange*> found;
  for (const auto& change : changes) {
    if (change.has_one_deadline()) found.push_back(&change);
  }
  // Those that were late most often, then the slowest.
  std::ranges::stable_sort(found, std::greater{}, [](const CallbackChange* change) {
    const auto& before = *change->lateness_before;
    const auto& after = *change->lateness_after;
    return std::tuple(before.late + after.late, std::max(before.max, after.max));
  });
  return found;
}

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
  const auto words = [&](std::string_view gap, const TextStyle& painted) {
    const auto share = [&painted](const analysis::Lateness& all) {
      return paint(fmt::format("{} of {}", all.late, all.instances),
                   all.late > 0 ? Look::bad : Look::good, painted);
    };
    return fmt::format("Late: {} instances before, {} after;{}{} {} a deadline", share(before),
                       share(after), gap, counted(changes.size(), "callback"),
                       changes.size() == 1 ? "has" : "have");
  };
  auto plain = style;
  plain.colour = false;
  const bool is_one_line = display_width(words(" ", plain)) <= style.columns;
  return words(is_one_line ? " " : "\n  ", style) + '\n';
}

std::string other_deadlines(const std::vector<CallbackChange>& changes) {
  const auto deadline = [](const std::optional<analysis::Lateness>& lateness) {
    return lateness ? std::optional(lateness->deadline) : std::nullopt;
  };
  const auto others = std::ranges::count_if(changes, [&deadline](const CallbackChange& change) {
    return change.is_before && change.is_after &&
           deadline(change.lateness_before) != deadline(change.lateness_after);
  });
  if (others == 0) return {};
  return fmt::format("  {:<{}}{} another deadline than before: not compared\n", "deadlines",
                     kDiffLabel,
                     others == 1 ? "1 callback has" : fmt::format("{} callbacks have", others));
}

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
       {"late", name_before, Align::right, 0, true},
       {"", name_after},
       {"p99", name_before, Align::right, 2, true},
       {"", name_after, Align::right, 2},
       {"max", name_before, Align::right, 1, true},
       {"", name_after, Align::right, 1}});
  const auto shown = std::min(most, changes.size());
  const auto time = [](const std::optional<std::int64_t>& ns, std::string_view mark = {}) {
    return ns ? TextCell{std::string(mark) + compact_duration(*ns)} : not_measured();
  };
  const auto longest = [&time](const analysis::Lateness& all) {
    return time(all.max, all.is_max_bound ? ">" : "");
  };
  const auto quantile = [&time](const std::optional<analysis::QuantileInterval>& interval) {
    return interval ? time(interval->estimate.ns, interval->estimate.is_bound ? ">" : "")
                    : not_measured();
  };
  const auto late = [](std::uint64_t count) {
    return TextCell{std::to_string(count), count > 0 ? Look::bad : Look::plain};
  };
  for (const auto* change : std::span(changes).first(shown)) {
    const auto& before = *change->lateness_before;
    const auto& after = *change->lateness_after;
    auto p99_before = not_measured();
    auto p99_after = not_measured();
    for (const auto& quantity : change->quantities) {
      if (quantity.quantity != "response_time" || quantity.per_mille != 990) continue;
      p99_before = quantile(quantity.before);
      p99_after = quantile(quantity.after);
    }
    table.add({{names.of_id(change->logical_id)},
               {is_common ? "-" : compact_duration(after.deadline.ns)},
               late(before.late),
               late(after.late),
               std::move(p99_before),
               std::move(p99_after),
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

}  // namespace cie::viewer_export
