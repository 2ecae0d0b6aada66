#include "diff_lists.hpp"

#include "words/recording_words.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace cie::viewer_export {
namespace {

using analysis::Absence;
using analysis::CallbackChange;

constexpr auto kEveryLine = std::numeric_limits<std::size_t>::max();

std::string losses_in_words(const std::vector<analysis::RecordLoss>& losses) {
  std::string text;
  for (const auto& loss : losses) {
    text += text.empty() ? "" : ", ";
    text += name_of_defect(loss.kind, loss.count, loss.advice);
  }
  return text;
}

std::string before_to_after(std::uint64_t before, std::uint64_t after, const TextStyle& style) {
  return fmt::format("{} {} {}", before, style.unicode ? "→" : "->", after);
}

// Lines of names: those of changes that something is so of.
class NameLists {
 public:
  NameLists(const std::vector<CallbackChange>& changes, const CallbackNames& names,
            ListLength length, const TextStyle& style)
      : changes_(changes), names_(names), length_(length), style_(style) {}

  // `more` tells something of a change, for behind its name.
  template <typename IsSo, typename More>
  void say(std::string_view what, Look look, const IsSo& is_so, const More& more) {
    std::vector<std::string> all;
    for (const auto& change : changes_) {
      if (is_so(change)) all.push_back(names_.of_id(change.logical_id) + more(change));
    }
    if (all.empty()) return;
    const auto begin = fmt::format("  {}: ", what);
    if (length_ == ListLength::screen) {
      const auto room = style_.columns - std::min(style_.columns, display_width(begin));
      lines_.push_back(paint(begin + first_of(all, room, style_), look, style_));
      return;
    }
    const auto text = fmt::format("{}", fmt::join(all, ", "));
    for (const auto& line : paragraph(begin, text, kEveryLine, style_))
      lines_.push_back(paint(line, look, style_));
  }
  template <typename IsSo>
  void say(std::string_view what, Look look, const IsSo& is_so) {
    say(what, look, is_so, [](const CallbackChange& /*change*/) { return std::string(); });
  }
  Lines take() { return std::move(lines_); }

 private:
  const std::vector<CallbackChange>& changes_;
  const CallbackNames& names_;
  ListLength length_;
  const TextStyle& style_;
  Lines lines_;
};

void add_absences(NameLists& lists, const TextStyle& style) {
  const auto has = [](Absence absence, bool is_proved) {
    return [absence, is_proved](const CallbackChange& change) {
      return change.absence == absence && change.is_absence_proved == is_proved;
    };
  };
  const auto processes = [&style](const CallbackChange& change) {
    return fmt::format(" ({} processes)",
                       before_to_after(change.processes_before, change.processes_after, style));
  };
  const auto runs = [](const CallbackChange& change) {
    return fmt::format(" ({} before)",
                       counted(change.instances_before + change.incomplete_before, "instance"));
  };
  lists.say("is gone", Look::bad, has(Absence::gone, true));
  lists.say("is gone from processes", Look::bad, has(Absence::gone_from_process, true), processes);
  lists.say("never runs any more", Look::bad, has(Absence::never_runs, true), runs);
  for (const bool is_proved : {true, false}) {
    lists.say(is_proved ? "is gone, without a run before" : "may be gone, without a run before",
              Look::plain, has(Absence::gone_unused, is_proved));
  }
  lists.say("may be gone", Look::doubtful, has(Absence::gone, false));
  lists.say("may be gone from processes", Look::doubtful, has(Absence::gone_from_process, false),
            processes);
  lists.say("may never run any more", Look::doubtful, has(Absence::never_runs, false), runs);
}

}  // namespace

Lines record_lines(const analysis::Comparison& comparison, ListLength length,
                   const TextStyle& style) {
  Lines lines;
  const std::size_t most = length == ListLength::screen ? 3 : kEveryLine;
  const auto say = [&style, &lines, most](const std::string& what) {
    for (const auto& line : paragraph("  record     ", what, most, style))
      lines.push_back(paint(line, Look::doubtful, style));
  };
  std::string incomplete;
  const auto add = [&](const analysis::ComparedRecord& record, const char* side) {
    if (!record.losses.empty()) {
      say(fmt::format("{} lacks instances: {}", side, losses_in_words(record.losses)));
    } else if (!record.is_complete) {
      incomplete += (incomplete.empty() ? "" : " and ") + std::string(side);
    }
  };
  add(comparison.before, "before");
  add(comparison.after, "after");
  if (!incomplete.empty()) say("not known to be complete: " + incomplete);
  return lines;
}

Lines release_lines(const std::vector<CallbackChange>& changes, const TextStyle& style) {
  const auto timers = std::ranges::count_if(changes, &CallbackChange::has_other_releases);
  if (timers == 0) return {};
  const auto told = counted(static_cast<std::uint64_t>(timers), "timer") +
                    " skipped periods: ROS 2's events tell the oldest expiry that waited, the "
                    "other recording the latest due. Such response times do not compare";
  Lines lines;
  for (const auto& line : paragraph("  releases   ", told, kEveryLine, style))
    lines.push_back(paint(line, Look::doubtful, style));
  return lines;
}

Lines other_deadlines(const std::vector<CallbackChange>& changes) {
  const auto deadline = [](const std::optional<analysis::Lateness>& lateness) {
    return lateness ? std::optional(lateness->deadline) : std::nullopt;
  };
  const auto others = std::ranges::count_if(changes, [&deadline](const CallbackChange& change) {
    return change.is_before && change.is_after &&
           deadline(change.lateness_before) != deadline(change.lateness_after);
  });
  if (others == 0) return {};
  return {fmt::format("  {:<{}}{} another deadline than before: not compared", "deadlines",
                      kDiffLabel,
                      others == 1 ? "1 callback has" : fmt::format("{} callbacks have", others))};
}

Lines structural_changes(const std::vector<CallbackChange>& changes, const CallbackNames& names,
                         ListLength length, const TextStyle& style) {
  NameLists lists(changes, names, length, style);
  add_absences(lists, style);
  lists.say("is new", Look::plain, [](const auto& c) { return !c.is_before; });
  lists.say("no longer has a thread of its own", Look::bad,
            [](const auto& c) { return c.lost_isolation; });
  lists.say("has an instance that never ends", Look::bad,
            [](const auto& c) { return c.never_ends; });
  lists.say(
      "runs less than half as often", Look::doubtful, [](const auto& c) { return c.runs_less; },
      [&style](const CallbackChange& c) {
        return fmt::format(" ({} instances)",
                           before_to_after(c.instances_before, c.instances_after, style));
      });
  return lists.take();
}

}  // namespace cie::viewer_export
