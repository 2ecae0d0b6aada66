#include <cie/viewer_export/diff_writers.hpp>

#include "diff_changes.hpp"
#include "diff_deadlines.hpp"
#include "diff_lists.hpp"
#include "diff_outcome.hpp"
#include "screen.hpp"
#include "words/callback_names.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace cie::viewer_export {
namespace {

using analysis::CallbackChange;
using analysis::Change;

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

// "edge, robot: runs of one id on any of them count together"; empty where each side is of one host.
std::string host_words(const analysis::Comparison& comparison) {
  const auto& before = comparison.before.hosts;
  const auto& after = comparison.after.hosts;
  if (before.size() < 2 && after.size() < 2) return {};
  auto names = printable(fmt::format("{}", fmt::join(before, ", ")));
  if (before != after)
    names += fmt::format(" before, {} after", printable(fmt::format("{}", fmt::join(after, ", "))));
  return names + ": runs of one id on any of them count together";
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
    std::ranges::stable_sort(by_rank_, {}, change_rank);
    for (const auto& change : by_rank_)
      add_changes(changes_, change, names_);
  }

  std::string whole() const {
    auto text = facts(ListLength::whole, true) + fmt::format("  {:<{}}{}\n  {:<{}}{}\n\n", "before",
                                                             kDiffLabel, printable(context_.before),
                                                             "after", kDiffLabel,
                                                             printable(context_.after));
    if (const auto lines = structure(ListLength::whole); !lines.empty())
      text += text_of(lines) + '\n';
    if (!urgent_.empty())
      text += deadline_table(urgent_, context_, names_, urgent_.size(), style_) + '\n';
    if (!changes_.empty()) text += change_table(changes_, style_) + '\n';
    return text + statistics();
  }

  // At most as many lines as a screen has: what is left out, the command at its end prints.
  std::string screen() const {
    auto text = facts(ListLength::screen, urgent_.empty());
    const auto lists = first_of_structure();
    if (!lists.empty()) text += '\n' + text_of(lists);
    auto end = urgent_.empty() ? statistics() : undecided_words(comparison_.callbacks, style_);
    if (!lists.empty() || !changes_.empty() || !urgent_.empty()) {
      end += text_of(commands_to_paste(
          {{"every change", "cie diff " + context_.arguments + " --all"}}, style_));
    }
    const auto taken = line_count(text) + line_count(end) + 1;  // and a blank line
    const auto room = style_.lines - std::min(style_.lines, taken);
    if (!urgent_.empty()) return text + '\n' + deadlines_in(room) + end;
    if (!changes_.empty())
      text += '\n' + change_table(changes_, room - std::min<std::size_t>(room, 1), style_);
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
                text_of(record_lines(comparison_, length, style_)) +
                text_of(release_lines(comparison_.callbacks, style_));
    if (const auto hosts = host_words(comparison_); !hosts.empty()) {
      text +=
          filled(fmt::format("  {:<{}}{}", "hosts", kDiffLabel, hosts), style_.columns, kDiffLabel);
    }
    if (context_.isolation_before.ran != 0 && context_.isolation_after.ran != 0) {
      text += filled(fmt::format("  {:<{}}{}", "isolation", kDiffLabel, isolation_words(context_)),
                     style_.columns, kDiffLabel);
    }
    text += other_deadlines(comparison_.callbacks);
    if (by_rank_.empty()) return text;
    text += extreme_line("worst", by_rank_.front(), Change::worse, names_, style_);
    if (has_best) text += extreme_line("best", by_rank_.back(), Change::better, names_, style_);
    return text;
  }

  Lines structure(ListLength length) const {
    return structural_changes(comparison_.callbacks, names_, length, style_);
  }

  // What is worse comes first.
  Lines first_of_structure() const {
    constexpr std::size_t kMost = 5;
    constexpr std::size_t kFewest = 2;
    const auto lacking = kScreenLines - std::min(kScreenLines, style_.lines);
    const auto most = kMost - std::min(kMost - kFewest, lacking);
    auto lines = structure(ListLength::screen);
    if (lines.size() <= most) return lines;
    const auto left = lines.size() - most + 1;
    lines.resize(most - 1);
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
  std::vector<ChangeRow> changes_;  // those that are certain
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
