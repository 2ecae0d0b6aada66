#include "headline.hpp"

#include <cie/analysis/rule_pages.hpp>
#include <cie/tracepoints/logical_id.hpp>

#include "words/recording_words.hpp"
#include "words/verify_words.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace cie::viewer_export {

using analysis::Verdict;

Verdict Headline::verdict() const { return std::max(judged_.verdicts.verdict, Verdict::pass); }

Look Headline::look() const {
  return verdict() == Verdict::fail   ? Look::bad
         : verdict() == Verdict::pass ? Look::good
                                      : Look::doubtful;
}

// "FAIL", with a symbol where there are such.
std::string Headline::word() const {
  const std::string_view symbol = !style_.unicode              ? ""
                                  : verdict() == Verdict::fail ? "✗ "
                                  : verdict() == Verdict::pass ? "✓ "
                                                               : "? ";
  return std::string(symbol) + std::string(analysis::label(verdict()));
}

// "run1: ", what was judged.
std::string Headline::title() const {
  const auto name = name_of_recording(judged_.report, style_.columns / 3, gap(style_));
  return name.empty() ? name : name + ": ";
}

std::vector<std::string> Headline::rules_with(Verdict verdict) const {
  std::vector<std::string> ids;
  for (const auto& rule : judged_.verdicts.rules) {
    const auto counted = analysis::counted_verdict(rule);
    const bool is_suppressed = counted < Verdict::inconclusive && rule.verdict > Verdict::pass;
    if (counted == verdict && !is_suppressed) ids.push_back(rule.id);
  }
  return ids;
}

std::vector<std::string> Headline::rules_suppressed() const {
  std::vector<std::string> ids;
  for (const auto& rule : judged_.verdicts.rules) {
    if (std::ranges::any_of(rule.subjects, &analysis::SubjectVerdict::is_suppressed))
      ids.push_back(rule.id);
  }
  return ids;
}

std::size_t Headline::suppressed() const {
  std::size_t count = 0;
  for (const auto& rule : judged_.verdicts.rules) {
    for (const auto& subject : rule.subjects)
      count += subject.is_suppressed() ? 1U : 0U;
  }
  return count;
}

std::string Headline::fact() const {
  if (!findings_.empty()) return gravest_fact(judged_, findings_);
  const auto kept = rules_with(Verdict::pass);
  const auto names = [](const std::vector<std::string>& ids, std::string_view id) {
    return std::ranges::find(ids, id) != ids.end();
  };
  const bool is_mapped = names(kept, analysis::kOneCallbackPerThreadRule) &&
                         names(kept, analysis::kOneThreadPerCallbackRule);
  if (verdict() == Verdict::pass) {
    if (kept.empty() && suppressed() > 0) {
      return fmt::format("no rule is kept without what is suppressed: {}",
                         fmt::join(rules_suppressed(), " "));
    }
    return is_mapped ? isolation_fact(judged_.report)
                     : fmt::format("{} kept", counted(kept.size(), "rule"));
  }
  const auto open = rules_with(Verdict::inconclusive);
  if (open.empty()) return "nothing was judged, for no rule that was asked for applies";
  auto undecided = counted(open.size(), "rule") + " undecided";
  if (is_mapped) return isolation_fact(judged_.report) + "; " + undecided;
  if (names(open, analysis::kOneCallbackPerThreadRule) ||
      names(open, analysis::kOneThreadPerCallbackRule))
    return "whether callbacks share threads is not known; " + undecided;
  return undecided;
}

// The blanks behind the word are none to wrap(), which takes several for one.
Lines Headline::lines() const {
  constexpr char kBlank = '\x01';
  auto lines = wrap(word() + kBlank + title() + fact(), style_.columns - 2);
  auto& first = lines.front();
  first = paint(word(), look(), style_) + "  " + first.substr(word().size() + 1);
  for (std::size_t i = 1; i < lines.size(); ++i)
    lines[i] = "  " + lines[i];
  return lines;
}

std::string Headline::line() const {
  std::string text = "  " + title() + fact();
  for (const auto listed : {Verdict::fail, Verdict::inconclusive}) {
    const auto ids = rules_with(listed);
    if (ids.empty()) continue;
    const bool is_said = listed == Verdict::inconclusive && findings_.empty();  // by the fact
    text += is_said ? ":" : listed == Verdict::fail ? "; violated" : "; undecided";
    for (const auto& id : ids)
      text += " " + id;
  }
  if (const auto known = suppressed(); known > 0)
    text += "; " + counted(known, "verdict") + " suppressed";
  if (const auto& window = judged_.verdicts.window)
    text += fmt::format("; only the window {}..{} ns", window->from.ns, window->to.ns);
  return paint(word(), look(), style_) + text;
}

Lines Headline::lines_of(const std::string& fact) const {
  auto lines = wrap(title() + fact, style_.columns - 2);
  for (std::size_t i = 1; i < lines.size(); ++i)
    lines[i] = "  " + lines[i];
  return lines;
}

namespace {

// Instances that numbers show to be missing between others. Totals may prove more: of callbacks that
// were not seen, after the last one, or from before the recording began.
Lines missing_instances(const analysis::Report& report) {
  const auto between = count_of(report, analysis::DefectKind::seq_gaps);
  if (between == 0) return {};
  std::uint64_t proven = 0;
  for (const auto& callback : report.callbacks)
    proven += callback.runs_not_seen - callback.outside_window.value_or(0);
  return {fmt::format("{}{} missing", proven > between ? "at least " : "", between)};
}

// What the trace itself shows to be missing, whatever the tracer counted: "5 missing, 1 packet
// damaged"; the first of it where there is more.
Lines missing_of(const analysis::Report& report) {
  using analysis::DefectKind;
  struct Words {
    DefectKind kind{};
    std::string_view noun;
    std::string_view what;
  };
  constexpr std::array<Words, 13> kMissing{
      {{DefectKind::damaged_packets, "packet", "damaged"},
       {DefectKind::missing_files, "file", "missing or changed"},
       {DefectKind::shared_pid, "process", "of a shared pid"},
       {DefectKind::host_gap, "gap", "not recorded"},
       {DefectKind::streams_left_out, "stream", "left out"},
       {DefectKind::unseen_process, "process", "not recorded"},
       {DefectKind::unseen_chunk, "chunk", "missing"},
       {DefectKind::unseen_kernel, "kernel record", "missing"},
       {DefectKind::sched_switch_gaps, "gap", "in context switches"},
       {DefectKind::cpus_not_recorded, "CPU", "not recorded"},
       {DefectKind::publish_gaps, "publication", "missing"},
       {DefectKind::ends_without_start, "start", "missing"},
       {DefectKind::read_back_gaps, "read-back", "missing"}}};
  constexpr std::size_t kMost = 2;
  auto lines = missing_instances(report);
  for (const auto& [kind, noun, what] : kMissing) {
    const auto count = count_of(report, kind);
    if (count == 0 || lines.size() == kMost) continue;
    lines.push_back(fmt::format("{} {}", counted(count, noun), what));
  }
  return lines;
}

// ", 7 more outside of what all streams cover (45.00 ms of 125.0 ms)".
std::string outside_of_window(const analysis::TraceSummary& trace) {
  if (!trace.outside) return {};
  auto text = fmt::format(", {} more outside of what all streams cover", trace.outside->instances);
  if (trace.begin && trace.end && trace.outside->length.ns > 0) {
    const auto window = *trace.end - *trace.begin;
    text += fmt::format(" ({} of {})", format_duration(window.ns),
                        format_duration((window + trace.outside->length).ns));
  }
  return text;
}

}  // namespace

std::string counts_of_runs(const analysis::Report& report) {
  std::uint64_t instances = 0;
  std::uint64_t incomplete = 0;
  std::uint64_t thrown = 0;
  for (const auto& callback : report.callbacks) {
    instances += callback.instances;
    incomplete += callback.partly_seen();
    thrown += callback.exceptions.value_or(0);
  }
  const auto& lost = report.trace.lost_events;
  auto missing = missing_of(report);
  if (!lost) missing.emplace_back(unknown_losses(report));
  if (lost.value_or(0) > 0) missing.push_back(counted(*lost, "event") + " lost");
  const auto problems = count_of(report, analysis::DefectKind::recorder_problem);
  if (missing.empty() && problems > 0)
    missing.push_back(counted(problems, "problem") + " of the recorder");
  if (missing.empty()) missing.emplace_back("nothing lost");
  auto text = counted(instances, "instance");
  for (const auto& part : missing)
    text += ", " + part;
  text += outside_of_window(report.trace);
  if (incomplete > 0) text += fmt::format(", {} cut or never ended", incomplete);
  if (thrown > 0) text += fmt::format("; {} ended by an exception", counted(thrown, "instance"));
  return text;
}

Lines unseen_of_spec(const Judged& judged, const TextStyle& style) {
  const auto* spec = judged.context.spec;
  if (spec == nullptr) return {};
  std::set<std::string_view> seen;  // entries by their period mean timers with a name, too
  std::set<std::string_view> nodes;
  for (const auto& callback : judged.report.callbacks) {
    seen.insert(callback.logical_id);
    nodes.insert(callback.node);
    nodes.insert(LogicalId::node_of(callback.logical_id));
    const auto* entry = spec->find_callback(callback.logical_id, callback.period_ns.value_or(0));
    if (entry != nullptr) seen.insert(entry->id);
  }
  std::set<std::string_view> asked;
  Lines unseen;
  const auto ask = [&](std::string_view id, int line) {
    if (!asked.insert(id).second || seen.contains(id)) return;
    unseen.push_back(
        fmt::format("{} ({}:{})", printable(id), printable(file_name(spec->name())), line));
  };
  bool has_wildcard = false;
  for (const auto& entry : spec->callbacks()) {
    has_wildcard = has_wildcard || entry.is_wildcard();
    // Of a node whose callbacks all have entries of their own nothing is left for it.
    if (entry.is_wildcard() && nodes.contains(entry.node())) seen.insert(entry.id);
    ask(entry.id, entry.line);
  }
  for (const auto& chain : spec->chains()) {
    for (const auto& id : chain.callbacks)
      ask(id, chain.line);
  }
  if (unseen.empty()) return {};
  const auto begin = fmt::format("  spec: {} of {} not in the recording: ", unseen.size(),
                                 counted(asked.size(), has_wildcard ? "id" : "callback"));
  constexpr std::size_t kLines = 2;
  const auto width = style.columns - std::min(style.columns, begin.size());
  const auto lost_by_wrapping = width / 6;
  return paragraph(begin, first_of(unseen, kLines * width - lost_by_wrapping, style), kLines + 1,
                   style);
}

namespace {

// "2 recordings, one after the other, are read as one: run1, run2": of one host. Nobody needs to know of
// those that were made at the same time, as several sessions are.
Lines recordings_apart(const analysis::Report& report, const TextStyle& style) {
  constexpr std::size_t kNamed = 4;
  std::vector<const analysis::RecordingReport*> all;
  for (const auto& recording : report.recordings)
    all.push_back(&recording);
  std::ranges::stable_sort(all, {},
                           [](const auto* recording) { return recording->begin.realtime_ns; });
  std::string names;
  std::size_t count = 0;
  const auto is_apart_from = [](const auto& recording, const auto& other) {
    return other.host == recording.host && (other.end.realtime_ns < recording.begin.realtime_ns ||
                                            recording.end.realtime_ns < other.begin.realtime_ns);
  };
  for (const auto* recording : all) {
    const auto is_apart = [&](const auto* other) { return is_apart_from(*recording, *other); };
    if (!std::ranges::any_of(all, is_apart) || ++count > kNamed) continue;
    names += (count == 1 ? "" : ", ") + printable(file_name(recording->path));
  }
  if (count == 0) return {};
  if (count > kNamed) names += fmt::format(", {} {} more", gap(style), count - kNamed);
  return {fmt::format("{} recordings, one after the other, are read as one: {}", count, names)};
}

}  // namespace

Lines remarks(const Judged& judged, Lines before, const TextStyle& style) {
  constexpr std::size_t kMost = 4;
  auto said = recordings_apart(judged.report, style);
  append(said, std::move(before));
  if (const auto& window = judged.verdicts.window) {
    said.push_back(fmt::format("only the window {}..{} ns ({}) is judged", window->from.ns,
                               window->to.ns, format_duration((window->to - window->from).ns)));
  }
  append(said, useless_suppressions(judged.verdicts));
  for (const auto& recording : judged.report.recordings) {
    const bool is_clean = recording.exit && recording.exit->code == 0;
    auto sentences = sentences_of(recording);
    if (is_clean && !sentences.empty()) sentences.erase(sentences.begin());
    append(said, std::move(sentences));
  }
  const auto all = said.size();
  if (all > kMost) {
    said.resize(kMost - 1);
    said.push_back(fmt::format("{} {} more", gap(style), all - said.size()));
  }
  constexpr std::size_t kLinesOfOne = 2;
  Lines lines;
  for (const auto& sentence : said)
    append(lines, paragraph("  ", sentence, kLinesOfOne, style));
  return lines;
}

}  // namespace cie::viewer_export
