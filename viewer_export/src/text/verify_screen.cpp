#include <cie/analysis/rule_pages.hpp>
#include <cie/viewer_export/verify_writers.hpp>

#include "verify_findings.hpp"
#include "words/recording_words.hpp"
#include "words/text_layout.hpp"
#include "words/verify_words.hpp"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

using analysis::Verdict;

constexpr std::size_t kLines = 24;
constexpr std::size_t kRowsOfARule = 3;

using Lines = std::vector<std::string>;

std::string_view gap(const TextStyle& style) { return style.unicode ? "…" : "..."; }

void append(Lines& lines, Lines more) { std::ranges::move(more, std::back_inserter(lines)); }

// Wrapped, at most `most` lines; those after the first begin as far in as the text of the first.
Lines paragraph(std::string_view begin, std::string_view text, std::size_t most,
                const TextStyle& style) {
  const auto indent = display_width(begin);
  const auto width = style.columns - std::min(indent, style.columns / 2);
  auto parts = wrap(text, width);
  if (parts.size() > most) {
    parts[most - 1] = cut(parts[most - 1] + ' ' + parts[most], width, gap(style));
    parts.resize(most);
  }
  Lines lines;
  for (const auto& part : parts) {
    const auto blanks = std::string(indent, ' ');
    lines.push_back(
        cut((lines.empty() ? std::string(begin) : blanks) + part, style.columns, gap(style)));
  }
  return lines;
}

class Screen {
 public:
  Screen(const Judged& judged, const TextStyle& style)
      : judged_(judged),
        style_(style),
        gap_(gap(style)),
        findings_(findings_of(judged)),
        doubts_(doubts_of(judged)) {}

  Lines lines() const {
    auto lines = head();
    Lines tail = remedy();
    append(tail, counts());
    if (verdict() != Verdict::pass) append(tail, commands());
    append(lines, body(kLines - std::min(kLines, lines.size() + tail.size())));
    append(lines, std::move(tail));
    return lines;
  }

  std::string line() const {
    std::string text = "  " + title() + fact();
    for (const auto listed : {Verdict::fail, Verdict::inconclusive}) {
      const auto ids = with(listed);
      if (ids.empty()) continue;
      text += listed == Verdict::fail ? "; violated" : "; undecided";
      for (const auto& id : ids)
        text += " " + id;
    }
    return paint(word(), look(), style_) + text;
  }

 private:
  Verdict verdict() const { return std::max(judged_.verdicts.verdict, Verdict::pass); }

  Look look() const {
    return verdict() == Verdict::fail   ? Look::bad
           : verdict() == Verdict::pass ? Look::good
                                        : Look::doubtful;
  }

  // "FAIL", with a symbol where there are such.
  std::string word() const {
    const std::string_view symbol = !style_.unicode              ? ""
                                    : verdict() == Verdict::fail ? "✗ "
                                    : verdict() == Verdict::pass ? "✓ "
                                                                 : "? ";
    return std::string(symbol) + std::string(analysis::label(verdict()));
  }

  // "run1: ", what was judged.
  std::string title() const {
    const auto& paths = judged_.report.trace.paths;
    if (paths.empty()) return {};
    std::filesystem::path path = paths.front();
    if (!path.has_filename()) path = path.parent_path();
    auto name = elide(printable(path.filename().string()), style_.columns / 3);
    if (paths.size() > 1) name += fmt::format(" and {} more", paths.size() - 1);
    return name + ": ";
  }

  // Without those that would have another verdict if nothing were suppressed.
  std::vector<std::string> with(Verdict verdict) const {
    std::vector<std::string> ids;
    for (const auto& rule : judged_.verdicts.rules) {
      const auto counted = analysis::counted_verdict(rule);
      const bool is_suppressed = counted < Verdict::inconclusive && rule.verdict > Verdict::pass;
      if (counted == verdict && !is_suppressed) ids.push_back(rule.id);
    }
    return ids;
  }

  bool passes(std::string_view id) const {
    const auto ids = with(Verdict::pass);
    return std::ranges::find(ids, id) != ids.end();
  }

  std::size_t suppressed() const {
    std::size_t count = 0;
    for (const auto& rule : judged_.verdicts.rules) {
      for (const auto& subject : rule.subjects)
        count += subject.is_suppressed() ? 1U : 0U;
    }
    return count;
  }

  std::string fact() const {
    if (!findings_.empty()) return gravest_fact(judged_, findings_);
    const auto is_mapped = passes("M2") && passes("M3");
    if (verdict() == Verdict::pass) {
      const auto kept = fmt::format("{} kept", counted(with(Verdict::pass).size(), "rule"));
      return is_mapped ? isolation_fact(judged_.report) : kept;
    }
    const auto open = with(Verdict::inconclusive);
    auto undecided = counted(open.size(), "rule") + " undecided";
    if (is_mapped) return isolation_fact(judged_.report) + "; " + undecided;
    const auto names_mapping = [](const auto& id) { return id == "M2" || id == "M3"; };
    if (std::ranges::any_of(open, names_mapping))
      return "whether callbacks share threads is undecided, with " + counted(open.size(), "rule");
    return undecided;
  }

  // The blanks behind the word are none to wrap(), which takes several for one.
  Lines head() const {
    constexpr char kBlank = '\x01';
    auto lines = wrap(word() + kBlank + title() + fact(), style_.columns - 2);
    auto& first = lines.front();
    first = paint(word(), look(), style_) + "  " + first.substr(word().size() + 1);
    for (std::size_t i = 1; i < lines.size(); ++i)
      lines[i] = "  " + lines[i];
    return lines;
  }

  // "7 callbacks each"; what has several parts is told of each anyway.
  static std::string detail_of(const FindingRow& row) {
    const bool is_count = std::ranges::count(row.detail, ' ') == 1;
    return row.detail + (row.names.size() > 1 && is_count ? " each" : "");
  }

  // One of a rule's rows: "     pool-0, pool-1   7 callbacks each".
  std::string line_of(const FindingRow& row, std::size_t width) const {
    const auto name = names(row, width);
    const std::string blanks(width - std::min(width, display_width(name)), ' ');
    return cut("     " + name + blanks + "  " + detail_of(row) + row.more, style_.columns, gap_);
  }

  // As many as there is room for: "4005, 4006, … 3 more".
  std::string names(const FindingRow& row, std::size_t width) const {
    auto text = elide(row.names.front(), width);
    for (std::size_t i = 1; i < row.names.size(); ++i) {
      const auto left = row.names.size() - i;
      const auto rest = left > 1 ? fmt::format(", {} {} more", gap_, left - 1) : "";
      const auto longer = text + ", " + row.names[i];
      if (display_width(longer + rest) <= width) {
        text = longer;
        continue;
      }
      const auto more = fmt::format(", {} {} more", gap_, left);
      return elide(text, width - std::min(width, display_width(more))) + more;
    }
    return text;
  }

  Lines block(const Finding& finding, std::size_t rows) const {
    Lines lines{
        cut(fmt::format("  {:<3}{:<28}{}", finding.rule->id, finding.rule->name, finding.subjects),
            style_.columns, gap_)};
    const auto shown = std::min(rows, finding.rows.size());
    std::size_t widest = 0;
    std::size_t details = 0;
    std::size_t told = 0;
    for (std::size_t i = 0; i < shown; ++i) {
      const auto& row = finding.rows[i];
      widest = std::max(widest, display_width(names(row, style_.columns)));
      details = std::max(details, display_width(detail_of(row)));
      told += row.names.size();
    }
    const auto width =
        std::min(widest, style_.columns - 7 - std::min(details, style_.columns * 2 / 5));
    for (std::size_t i = 0; i < shown; ++i)
      lines.push_back(line_of(finding.rows[i], width));
    if (shown > 0 && told < finding.violating)
      lines.push_back(fmt::format("     {} {} more", gap_, finding.violating - told));
    if (shown > 0 && !finding.worst.empty())
      lines.push_back("     " + cut(finding.worst, style_.columns - 5, gap_));
    return lines;
  }

  static std::size_t size_of(const std::vector<Lines>& blocks) {
    std::size_t size = 0;
    for (const auto& block : blocks)
      size += block.size();
    return size;
  }

  // The violated rules with as many rows as there is room for, then why the others are undecided.
  Lines body(std::size_t room) const {
    const std::size_t for_doubts = doubts_.empty() ? 0 : 1;
    std::vector<Lines> blocks;
    for (auto rows = kRowsOfARule + 1; rows-- > 0;) {
      blocks.clear();
      for (const auto& finding : findings_)
        blocks.push_back(block(finding, rows));
      if (size_of(blocks) + for_doubts <= room) break;
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
    const auto ids = joined(with(Verdict::inconclusive), style_.columns - 13);
    if (!findings_.empty() && room < 3) return {"  undecided: " + ids};
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
      // A second line is for reasons that take none from those after them.
      auto reason = paragraph(begin, doubts_[i].reason, left >= after + 2 ? 2 : 1, style_);
      append(lines, std::move(reason));
    }
    return lines;
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

  Lines remedy() const {
    std::string text;
    if (!findings_.empty()) {
      text = remedy_of(judged_, findings_.front());
    } else if (verdict() == Verdict::inconclusive) {
      const auto open = with(Verdict::inconclusive);
      const auto is_readable = std::ranges::find(open, analysis::kReadableRule) == open.end();
      text = is_readable ? "where these rules may stay undecided: --inconclusive=warn exits with 0"
                         : "mend the copy or record again: no option passes what cannot be read";
    }
    if (text.empty()) return {};
    return paragraph(style_.unicode ? "  → " : "  -> ", text, 2, style_);
  }

  std::string losses() const {
    const auto& lost = judged_.report.trace.lost_events;
    if (!lost) return "whole packets lost";
    if (*lost > 0) return counted(*lost, "event") + " lost";
    return "nothing lost";
  }

  Lines counts() const {
    std::uint64_t runs = 0;
    std::uint64_t incomplete = 0;
    std::uint64_t thrown = 0;
    for (const auto& callback : judged_.report.callbacks) {
      runs += callback.instances;
      incomplete += callback.incomplete;
      thrown += callback.exceptions.value_or(0);
    }
    Lines parts;
    if (const auto passed = with(Verdict::pass).size(); passed > 0)
      parts.push_back(counted(passed, "rule") + (passed == 1 ? " passes" : " pass"));
    if (const auto open = with(Verdict::inconclusive).size(); open > 0)
      parts.push_back(fmt::format("{} undecided", open));
    if (const auto without = with(Verdict::not_applicable).size(); without > 0) {
      parts.push_back(fmt::format("{} {} not apply{}", without, without == 1 ? "does" : "do",
                                  judged_.context.spec_name.empty() ? " (no --spec)" : ""));
    }
    if (const auto known = suppressed(); known > 0)
      parts.push_back(counted(known, "verdict") + " suppressed");
    std::string text;
    for (const auto& part : parts)
      text += (text.empty() ? "" : ", ") + part;
    text += fmt::format("{}{}, {}", text.empty() ? "" : "; ", counted(runs, "run"), losses());
    if (incomplete > 0) text += fmt::format(", {} cut or never ended", incomplete);
    if (thrown > 0) text += fmt::format("; {} ended by an exception", counted(thrown, "run"));
    auto lines = paragraph("  ", text, 3, style_);
    append(lines, remarks());
    return lines;
  }

  // What else whoever relies on the verdict has to know, a line each.
  Lines remarks() const {
    constexpr std::size_t kMost = 4;
    Lines said;
    std::string defects;
    for (const auto& defect : judged_.report.defects) {
      if (defect.severity == analysis::Severity::info) continue;
      defects += fmt::format("{}{} x {}", defects.empty() ? "tainted by " : ", ",
                             analysis::label(defect.kind), defect.count);
    }
    if (!defects.empty()) said.push_back(defects);
    if (const auto& window = judged_.verdicts.window) {
      said.push_back(fmt::format("judged is the window {}..{} ns ({}) alone", window->from.ns,
                                 window->to.ns, format_duration((window->to - window->from).ns)));
    }
    append(said, useless_suppressions(judged_.verdicts));
    for (const auto& recording : judged_.report.recordings) {
      const bool is_clean = recording.exit && recording.exit->code == 0;
      auto sentences = sentences_of(recording);
      if (is_clean && !sentences.empty()) sentences.erase(sentences.begin());
      append(said, std::move(sentences));
    }
    const auto all = said.size();
    if (all > kMost) {
      said.resize(kMost - 1);
      said.push_back(fmt::format("{} {} more", gap_, all - said.size()));
    }
    for (auto& line : said)
      line = "  " + cut(line, style_.columns - 2, gap_);
    return said;
  }

  // Side by side where there is room; one that is longer than the line is not broken.
  Lines commands() const {
    const auto id = !findings_.empty() ? findings_.front().rule->id
                    : doubts_.empty()  ? std::string()
                                       : doubts_.front().rules.front();
    Lines all{"evidence: cie verify " + judged_.context.verify_arguments + " --all"};
    if (!id.empty()) all.push_back("rule: cie verify --explain " + id);
    all.push_back("look: cie view " + judged_.context.view_arguments);
    Lines lines;
    for (const auto& command : all) {
      const auto is_room =
          !lines.empty() &&
          display_width(lines.back()) + 4 + display_width(command) <= style_.columns;
      if (is_room) {
        lines.back() += "    " + command;
      } else {
        lines.push_back("  " + command);
      }
    }
    return lines;
  }

  const Judged& judged_;
  const TextStyle& style_;
  std::string_view gap_;
  std::vector<Finding> findings_;
  std::vector<Doubt> doubts_;
};

}  // namespace

void write_verify_screen(std::ostream& out, const analysis::VerdictReport& verdicts,
                         const analysis::Report& report, const VerifyContext& context,
                         const TextStyle& style) {
  const Judged judged(verdicts, report, context);
  for (const auto& line : Screen(judged, style).lines())
    out << line << '\n';
}

void write_verify_line(std::ostream& out, const analysis::VerdictReport& verdicts,
                       const analysis::Report& report, const VerifyContext& context,
                       const TextStyle& style) {
  const Judged judged(verdicts, report, context);
  out << Screen(judged, style).line() << '\n';
}

}  // namespace cie::viewer_export
