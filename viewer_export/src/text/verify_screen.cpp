#include <cie/analysis/rule_pages.hpp>
#include <cie/viewer_export/verify_writers.hpp>

#include "headline.hpp"
#include "screen.hpp"
#include "verify_findings.hpp"
#include "words/recording_words.hpp"
#include "words/text_layout.hpp"
#include "words/verify_words.hpp"

#include <algorithm>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

using analysis::Verdict;

constexpr std::size_t kRowsOfARule = 3;
constexpr std::size_t kLinesOfAWholeRow = 5;

class VerifyScreen {
 public:
  VerifyScreen(const Judged& judged, const TextStyle& style)
      : judged_(judged),
        style_(style),
        gap_(gap(style)),
        findings_(findings_of(judged)),
        doubts_(doubts_of(judged)),
        head_(judged_, findings_, style_) {}

  Lines lines() const {
    auto lines = head_.lines();
    if (!names_unseen()) append(lines, unseen_of_spec(judged_, style_));
    Lines tail = suppressed();
    append(tail, remedy());
    append(tail, counts());
    if (head_.verdict() != Verdict::pass || head_.suppressed() > 0) append(tail, commands());
    append(lines, body(style_.lines - std::min(style_.lines, lines.size() + tail.size())));
    append(lines, std::move(tail));
    return lines;
  }

  std::string line() const { return head_.line(); }

 private:
  // "7 callbacks each"; what has several parts is told of each anyway.
  static std::string detail_of(const FindingRow& row) {
    const bool is_count = std::ranges::count(row.detail, ' ') == 1;
    return row.detail + (row.names.size() > 1 && is_count ? " each" : "");
  }

  // One of a rule's rows: "     pool-0, pool-1   7 callbacks each".
  Lines lines_of(const FindingRow& row, std::size_t width, std::size_t most) const {
    const auto name = names(row, width);
    const std::string blanks(width - std::min(width, display_width(name)), ' ');
    return paragraph("     " + name + blanks + "  ", detail_of(row) + row.more, most, style_);
  }

  // Room for the first of its names, and how many more there are.
  std::size_t width_of_first(const FindingRow& row) const {
    const auto others = row.names.size() - 1;
    const auto more = others > 0 ? fmt::format(", {} {} more", gap_, others) : "";
    return display_width(row.names.front() + more);
  }

  // As many as there is room for: "4005, 4006, … 3 more".
  std::string names(const FindingRow& row, std::size_t width) const {
    auto text = elide(row.names.front(), width, gap_);
    for (std::size_t i = 1; i < row.names.size(); ++i) {
      const auto left = row.names.size() - i;
      const auto rest = left > 1 ? fmt::format(", {} {} more", gap_, left - 1) : "";
      const auto longer = text + ", " + row.names[i];
      if (display_width(longer + rest) <= width) {
        text = longer;
        continue;
      }
      const auto more = fmt::format(", {} {} more", gap_, left);
      return elide(text, width - std::min(width, display_width(more)), gap_) + more;
    }
    return text;
  }

  // Rows of at most so many lines each; what is longer is cut. A short one has nothing but rows.
  Lines block(const Finding& finding, std::size_t rows, std::size_t lines_of_a_row,
              bool is_short = false) const {
    const auto order = rows == 0 || finding.order.empty() ? "" : ", " + finding.order;
    Lines lines{cut(fmt::format("  {:<3}{:<28}{} {}{}", finding.rule->id, finding.rule->name + "  ",
                                finding.subjects, finding.violation, order),
                    style_.columns, gap_)};
    const auto shown = std::min(rows, finding.rows.size());
    std::size_t widest = 0;
    std::size_t least = 0;
    std::size_t details = 0;
    std::size_t most = 0;  // of details, and more of them
    std::size_t told = 0;
    for (std::size_t i = 0; i < shown; ++i) {
      const auto& row = finding.rows[i];
      const auto all = display_width(names(row, style_.columns));
      widest = std::max(widest, all);
      least = std::max(least, std::min(all, width_of_first(row)));
      details = std::max(details, display_width(detail_of(row)));
      most = std::max(most, display_width(detail_of(row) + row.more));
      told += row.names.size();
    }
    const auto columns = style_.columns - 7;
    auto width = std::min(widest, columns - std::min(details, style_.columns * 2 / 5));
    // Names beyond the first leave their room to details that would be cut, or fill many short lines.
    if (lines_of_a_row == 1 || width > columns / 2)
      width = std::min(width, std::max(least, columns - std::min(most, columns)));
    for (std::size_t i = 0; i < shown; ++i) {
      append(lines, lines_of(finding.rows[i], width, lines_of_a_row));
      if (is_short) continue;
      if (i == 0 && !finding.worst.empty())
        append(lines, paragraph("     worst: ", finding.worst, lines_of_a_row, style_));
    }
    if (shown > 0 && told < finding.violating && !is_short)
      lines.push_back(fmt::format("     {} {} more", gap_, finding.violating - told));
    return lines;
  }

  static std::size_t size_of(const std::vector<Lines>& blocks) {
    std::size_t size = 0;
    for (const auto& block : blocks)
      size += block.size();
    return size;
  }

  std::vector<Lines> blocks_of(std::size_t rows, std::size_t lines_of_a_row) const {
    std::vector<Lines> blocks;
    for (const auto& finding : findings_)
      blocks.push_back(block(finding, rows, lines_of_a_row));
    return blocks;
  }

  // Gives rules so many rows, the gravest first, as far as there is room for.
  void grow(std::vector<Lines>& blocks, std::size_t room, std::size_t rows,
            bool is_short = false) const {
    auto size = size_of(blocks);
    for (std::size_t i = 0; i < findings_.size(); ++i) {
      auto longer = block(findings_[i], rows, 1, is_short);
      const auto grown = size - blocks[i].size() + longer.size();
      if (grown > room) continue;
      blocks[i] = std::move(longer);
      size = grown;
    }
  }

  // The violated rules with as many rows as there is room for, then why the others are undecided.
  // Rows are whole where that takes no line from any of it.
  Lines body(std::size_t room) const {
    const std::size_t for_doubts = doubts_.empty() ? 0 : 1;
    auto blocks = blocks_of(kRowsOfARule, kLinesOfAWholeRow);
    if (size_of(blocks) + for_doubts + doubts_.size() > room) {
      const auto without_doubts = room - std::min(room, for_doubts);
      auto rows = kRowsOfARule;
      for (; rows > 0; --rows) {
        blocks = blocks_of(rows, 1);
        if (size_of(blocks) <= without_doubts) break;
      }
      if (rows == 0) {  // the worst of each is worth more than how many others there are
        blocks = blocks_of(0, 1);
        grow(blocks, without_doubts, 1, true);
        grow(blocks, without_doubts, 1);
      } else if (rows < kRowsOfARule) {
        grow(blocks, without_doubts - std::min(without_doubts, doubts_.size()), rows + 1);
      }
    }
    Lines lines;
    for (auto& block : blocks)
      append(lines, std::move(block));
    const auto most = room - std::min(room, for_doubts);
    if (lines.size() > most && most > 0) {
      const auto left = lines.size() - (most - 1);
      lines.resize(most - 1);
      lines.push_back(fmt::format("  {} {} more", gap_, counted(left, "rule")));
    }
    append(lines, undecided(room - std::min(room, lines.size())));
    return lines;
  }

  Lines undecided(std::size_t room) const {
    if (doubts_.empty() || room == 0) return {};
    if (!findings_.empty() && room < 3) return {rules_in_doubt()};
    Lines lines;
    if (!findings_.empty()) lines.push_back("  undecided");
    const std::string indent = findings_.empty() ? "  " : "     ";
    std::size_t rules_width = 0;
    std::size_t subjects_width = 0;
    std::vector<std::string> rules;
    for (const auto& doubt : doubts_) {
      rules.push_back(joined(doubt.rules, style_.columns / 5));
      rules_width = std::max(rules_width, display_width(rules.back()));
      subjects_width = std::max(subjects_width, doubt.subjects.size());
    }
    for (std::size_t i = 0; i < doubts_.size(); ++i) {
      const auto begin = fmt::format("{}{:<{}}  {:<{}}  ", indent, rules[i], rules_width,
                                     doubts_[i].subjects, subjects_width);
      const auto left = room - lines.size();
      const auto after = doubts_.size() - i - 1;
      if (after > 0 && left < 2) {
        lines.push_back(fmt::format("{}{} {}", indent, gap_, counted(after + 1, "more reason")));
        break;
      }
      // More lines than one are for reasons that take none from those after them.
      const auto most = left > after + 1 ? left - after : 1;
      auto reason = paragraph(begin, doubts_[i].reason, most, style_);
      append(lines, std::move(reason));
    }
    return lines;
  }

  // "undecided: T4 M9; in part: M2 M3": those are violated, and undecided of some subjects.
  std::string rules_in_doubt() const {
    std::vector<std::string> whole;
    std::vector<std::string> in_part;
    for (const auto& rule : judged_.verdicts.rules) {
      const bool is_in_doubt = std::ranges::any_of(doubts_, [&rule](const Doubt& doubt) {
        return std::ranges::find(doubt.rules, rule.id) != doubt.rules.end();
      });
      if (is_in_doubt)
        (rule.verdict == analysis::Verdict::inconclusive ? whole : in_part).push_back(rule.id);
    }
    std::string text = "  undecided";
    const std::size_t for_part = in_part.empty() ? 0 : 28;
    if (!whole.empty()) text += ": " + joined(whole, style_.columns - 13 - for_part);
    if (in_part.empty()) return text;
    text += whole.empty() ? " in part: " : "; in part: ";
    const auto used = display_width(text);
    return text + joined(in_part, style_.columns - std::min(style_.columns, used));
  }

  // "T2 T3 T4 … 5 more".
  std::string joined(const std::vector<std::string>& ids, std::size_t width) const {
    std::string text;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      const auto longer = text + (i == 0 ? "" : " ") + ids[i];
      const auto rest =
          i + 1 < ids.size() ? fmt::format(" {} {} more", gap_, ids.size() - i - 1) : std::string();
      if (i > 0 && display_width(longer + rest) > width)
        return text + fmt::format(" {} {} more", gap_, ids.size() - i);
      text = longer;
    }
    return text;
  }

  // The block of a violated M1 does.
  bool names_unseen() const {
    return std::ranges::any_of(findings_, [](const Finding& finding) {
      return finding.rule->id == analysis::kSpecifiedCallbackSeenRule;
    });
  }

  // A process did not end in the recording: it still ran, or it crashed.
  bool is_any_without_end() const {
    const auto& rules = judged_.verdicts.rules;
    const auto rule =
        std::ranges::find(rules, analysis::kRunCompleteRule, &analysis::RuleVerdict::id);
    if (rule == rules.end()) return false;
    return std::ranges::any_of(rule->subjects, [](const analysis::SubjectVerdict& subject) {
      if (subject.verdict != Verdict::inconclusive || subject.evidence.empty()) return false;
      const auto code = subject.evidence.front().note.code;
      return code == "no-run-end" || code == "no-run-end-executed-another-program";
    });
  }

  // T2 is undecided, and the trace has one of these defects.
  bool is_loss_open_by(std::initializer_list<analysis::DefectKind> kinds) const {
    const auto open = head_.rules_with(Verdict::inconclusive);
    return std::ranges::find(open, analysis::kNoLossRule) != open.end() &&
           std::ranges::any_of(kinds,
                               [this](auto kind) { return count_of(judged_.report, kind) > 0; });
  }

  // Of rules that are undecided, when none is violated.
  std::string_view way_to_a_decision() const {
    const auto open = head_.rules_with(Verdict::inconclusive);
    if (std::ranges::find(open, analysis::kReadableRule) != open.end())
      return "mend the copy or record again: no option passes what cannot be read";
    if (judged_.report.callbacks.empty()) {
      return "it holds nothing to judge: record again, with what T5 asks for, while the application "
             "runs";
    }
    using enum analysis::DefectKind;
    if (is_loss_open_by({discarded_events, discarded_packets})) {
      return "record again with larger or more sub-buffers (cie record --subbuf-size, "
             "--num-subbuf), or fewer events";
    }
    if (is_loss_open_by({recorder_problem})) {
      return "record again, or where the recording goes on, read it when it has ended; "
             "--inconclusive=warn exits with 0 whatever stays undecided";
    }
    if (is_any_without_end()) {
      return "of processes that did not end in the recording --allow-crash judges what was seen; "
             "--inconclusive=warn exits with 0 whatever stays undecided";
    }
    return "where these rules may stay undecided: --inconclusive=warn exits with 0";
  }

  Lines remedy() const {
    std::string text;
    if (!findings_.empty()) {
      text = remedy_of(judged_, findings_.front());
    } else if (head_.verdict() == Verdict::inconclusive) {
      text = way_to_a_decision();
    }
    if (text.empty()) return {};
    return paragraph(style_.unicode ? "  → " : "  -> ", text, 2, style_);
  }

  // Rules that are suppressed for the same reason until the same day.
  struct Accepted {
    std::string words;
    std::vector<std::string> rules;
  };
  std::vector<Accepted> accepted() const {
    std::vector<Accepted> all;
    for (const auto& rule : judged_.verdicts.rules) {
      for (const auto& subject : rule.subjects) {
        if (!subject.is_suppressed()) continue;
        const auto& suppression = *subject.suppression;
        auto words = term_of(suppression) + ": " + printable(suppression.reason);
        auto same = std::ranges::find(all, words, &Accepted::words);
        if (same == all.end())
          same = all.insert(all.end(), {.words = std::move(words), .rules = {}});
        if (same->rules.empty() || same->rules.back() != rule.id) same->rules.push_back(rule.id);
      }
    }
    return all;
  }

  // "M2 M3  suppressed until 2026-12-31: the pool is meant". Beside what counts a reason has
  // one line.
  Lines suppressed() const {
    constexpr std::size_t kReasons = 3;
    constexpr std::size_t kLinesOfAReason = 2;
    auto all = accepted();
    std::vector<std::string> others;
    const auto shown = all.size() > kReasons ? kReasons - 1 : all.size();
    for (std::size_t i = shown; i < all.size(); ++i) {
      for (const auto& id : all[i].rules) {
        if (std::ranges::find(others, id) == others.end()) others.push_back(id);
      }
    }
    std::size_t width = 0;
    std::vector<std::string> rules;
    for (std::size_t i = 0; i < shown; ++i) {
      rules.push_back(joined(all[i].rules, style_.columns / 3));
      width = std::max(width, display_width(rules.back()));
    }
    Lines lines;
    const auto most = findings_.empty() && doubts_.empty() ? kLinesOfAReason : 1;
    for (std::size_t i = 0; i < shown; ++i) {
      append(lines,
             paragraph(fmt::format("  {:<{}}  ", rules[i], width), all[i].words, most, style_));
    }
    if (!others.empty()) {
      const auto begin =
          fmt::format("  {} suppressed for {}: ", gap_, counted(all.size() - shown, "more reason"));
      const auto room = style_.columns - std::min(style_.columns, display_width(begin));
      lines.push_back(begin + joined(others, room));
    }
    return lines;
  }

  // " (6 need --spec)" of rules that do not apply. Where nothing ran, a spec would not help.
  std::string wanting_a_spec(const std::vector<std::string>& ids) const {
    if (!judged_.context.spec_name.empty() || judged_.report.callbacks.empty()) return {};
    const auto count = std::ranges::count_if(ids, needs_spec);
    return count == 0 ? "" : fmt::format(" ({} {} --spec)", count, count == 1 ? "needs" : "need");
  }

  Lines counts() const {
    Lines parts;
    if (const auto passed = head_.rules_with(Verdict::pass).size(); passed > 0)
      parts.push_back(counted(passed, "rule") + (passed == 1 ? " passes" : " pass"));
    if (const auto open = head_.rules_with(Verdict::inconclusive).size(); open > 0)
      parts.push_back(fmt::format("{} undecided", open));
    const auto without = head_.rules_with(Verdict::not_applicable);
    if (!without.empty()) {
      parts.push_back(fmt::format("{} {} not apply{}", without.size(),
                                  without.size() == 1 ? "does" : "do", wanting_a_spec(without)));
    }
    if (const auto known = head_.suppressed(); known > 0)
      parts.push_back(counted(known, "verdict") + " suppressed");
    std::string text;
    for (const auto& part : parts)
      text += (text.empty() ? "" : ", ") + part;
    text += (text.empty() ? "" : "; ") + counts_of_runs(judged_.report);
    auto lines = paragraph("  ", text, 3, style_);
    auto before = defects();
    const auto put_first = [&before](std::string said) {
      if (!said.empty()) before.insert(before.begin(), std::move(said));
    };
    put_first(raised_priorities(judged_.verdicts));
    // Findings leave no doubt that not all is as the spec says.
    if (findings_.empty()) put_first(unjudged_parameters(judged_.verdicts));
    append(lines, remarks(judged_, std::move(before), style_));
    return lines;
  }

  // "defects of the trace (what they hide stays undecided): seq-gaps x 5".
  Lines defects() const {
    std::string defects;
    for (const auto& defect : judged_.report.defects) {
      if (defect.severity == analysis::Severity::info) continue;
      defects +=
          (defects.empty() ? "" : ", ") + name_of_defect(defect.kind, defect.count, defect.advice);
    }
    return defects.empty() ? Lines{} : Lines{defects_of_trace(defects)};
  }

  Lines commands() const {
    const auto id = !findings_.empty() ? findings_.front().rule->id
                    : doubts_.empty()  ? std::string()
                                       : doubts_.front().rules.front();
    std::vector<std::pair<std::string_view, std::string>> all{
        {"evidence", "cie verify " + judged_.context.verify_arguments + " --all"}};
    if (!id.empty()) all.emplace_back("rule", "cie verify --explain " + id);
    all.push_back(judged_.look());
    return commands_to_paste(all, style_);
  }

  const Judged& judged_;
  const TextStyle& style_;
  std::string_view gap_;
  std::vector<Finding> findings_;
  std::vector<Doubt> doubts_;
  Headline head_;
};

}  // namespace

void write_verify_screen(std::ostream& out, const analysis::VerdictReport& verdicts,
                         const analysis::Report& report, const VerifyContext& context,
                         const TextStyle& style) {
  const Judged judged(verdicts, report, context, style);
  for (const auto& line : VerifyScreen(judged, style).lines())
    out << line << '\n';
}

void write_verify_line(std::ostream& out, const analysis::VerdictReport& verdicts,
                       const analysis::Report& report, const VerifyContext& context,
                       const TextStyle& style) {
  const Judged judged(verdicts, report, context, style);
  out << VerifyScreen(judged, style).line() << '\n';
}

}  // namespace cie::viewer_export
