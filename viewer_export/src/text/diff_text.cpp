#include <cie/viewer_export/diff_writers.hpp>

#include "diff_changes.hpp"
#include "diff_lists.hpp"
#include "diff_outcome.hpp"
#include "screen.hpp"
#include "words/callback_names.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace cie::viewer_export {
namespace {

using analysis::CallbackChange;

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

std::string text_of(const Lines& lines) {
  std::string text;
  for (const auto& line : lines)
    text += line + '\n';
  return text;
}

// Of what is too much for a screen it has the first.
constexpr std::size_t kMostChanges = 7;
constexpr std::size_t kMostLists = 5;

class DiffText {
 public:
  DiffText(const analysis::Comparison& comparison, const DiffContext& context,
           const TextStyle& style)
      : comparison_(comparison),
        context_(context),
        style_(style),
        names_(ids_of(comparison.callbacks), style),
        changes_(change_rows(comparison.callbacks, names_)) {}

  std::string whole() const {
    return facts(ListLength::whole) +
           rows(structure(ListLength::whole), changes_.size(), ListLength::whole) + undecided() +
           commands({});
  }

  // At most as many lines as a screen has: what is left out, a command at its end prints.
  std::string screen() const {
    const auto begin = facts(ListLength::screen);
    const auto end = undecided();
    const auto all = whole();
    const auto lists = structure(ListLength::screen);
    auto shown = std::min(kMostChanges, changes_.size());
    for (auto most = kMostLists;;) {
      const auto text = begin + rows(first_of(lists, most), shown, ListLength::screen) + end;
      const auto left = changes_.size() - shown;
      auto screen = text + commands({});
      if (screen != all)
        screen = text + commands(left > 0 ? counted(left, "more change") : "whole names");
      const bool is_least = shown <= 1 && most <= 1;
      if (is_least || std::cmp_less_equal(std::ranges::count(screen, '\n'), style_.lines))
        return screen;
      --(shown > 1 ? shown : most);
    }
  }

 private:
  static std::vector<std::string> ids_of(const std::vector<CallbackChange>& changes) {
    std::vector<std::string> ids;
    ids.reserve(changes.size());
    for (const auto& change : changes)
      ids.push_back(change.logical_id);
    return ids;
  }

  // What is gone, new or runs otherwise, and what changed.
  std::string rows(const Lines& lists, std::size_t shown, ListLength length) const {
    std::string text;
    if (!lists.empty()) text += '\n' + text_of(lists);
    if (shown > 0) {
      const bool are_names_whole = length == ListLength::whole;
      text += '\n' + change_table(changes_, shown, are_names_whole, style_);
    }
    return text;
  }

  // `left_out`: what only a longer text has.
  std::string commands(const std::string& left_out) const {
    std::vector<std::pair<std::string_view, std::string>> all;
    if (!left_out.empty()) all.emplace_back(left_out, "cie diff " + context_.arguments + " --all");
    if (comparison_.outcome() == analysis::Outcome::regression && !context_.view_arguments.empty())
      all.emplace_back("look", "cie view " + context_.view_arguments);
    return text_of(commands_to_paste(all, style_));
  }

  std::string undecided() const { return undecided_words(comparison_.callbacks, style_); }

  std::string facts(ListLength length) const {
    auto text = outcome_words(comparison_, context_.tolerance, style_) +
                lateness_words(comparison_.callbacks, style_) +
                text_of(record_lines(comparison_, length, style_)) +
                text_of(release_lines(comparison_.callbacks, style_)) +
                text_of(other_deadlines(comparison_.callbacks));
    const auto add = [&text, this](std::string_view label, const std::string& words) {
      text +=
          filled(fmt::format("  {:<{}}{}", label, kDiffLabel, words), style_.columns, kDiffLabel);
    };
    if (const auto hosts = host_words(comparison_); !hosts.empty()) add("hosts", hosts);
    if (context_.isolation_before.ran != 0 && context_.isolation_after.ran != 0)
      add("isolation", isolation_words(context_));
    return text;
  }

  Lines structure(ListLength length) const {
    return structural_changes(comparison_.callbacks, names_, length, style_);
  }

  // What is worse comes first.
  Lines first_of(Lines lists, std::size_t most) const {
    if (lists.size() <= most) return lists;
    const auto left = lists.size() - most + 1;
    lists.resize(most - 1);
    lists.push_back(fmt::format("  {} {} more kinds of change", gap(style_), left));
    return lists;
  }

  const analysis::Comparison& comparison_;
  const DiffContext& context_;
  const TextStyle& style_;
  CallbackNames names_;
  std::vector<ChangeRow> changes_;
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
