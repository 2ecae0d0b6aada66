#include "batch_text.hpp"

#include "words/text_layout.hpp"

#include <algorithm>
#include <ctime>

#include <fmt/format.h>

namespace cie::live {
namespace {

using analysis::Verdict;
using viewer_export::format_duration;
using viewer_export::Look;
using viewer_export::TextTable;

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::size_t kMaxThreads = 20;

std::string duration_or_dash(const analysis::Rare<analysis::Summary>& summary,
                             std::int64_t analysis::Summary::*field, bool is_exact) {
  if (!summary) return "-";
  return (is_exact ? "" : ">") + format_duration(*summary.*field);
}

std::string callback_table(const Snapshot& snapshot, SortKey key, std::string_view filter,
                           const Names& names, const viewer_export::TextStyle& style) {
  const auto chosen = choose(snapshot, key, filter);
  if (chosen.empty()) return {};
  const bool has_hosts = !snapshot.hosts.empty();
  const auto seconds = static_cast<double>(std::max(snapshot.window_ns, kSecond / 10)) / kSecond;
  const auto window = fmt::format("last {:.0f} s", std::max(seconds, 1.0));
  TextTable table({{"", "callback", TextTable::Align::left},
                   {"", has_hosts ? "host" : "pid"},
                   {"", "inst/s"},
                   {"response time, " + window, "p50", TextTable::Align::right, 1, true},
                   {"", "p99", TextTable::Align::right, 0, true},
                   {"", "max"},
                   {"", "last", TextTable::Align::right, 2},
                   {"since start", "late", TextTable::Align::right, 0, true},
                   {"", "missed"}});
  for (const auto* c : chosen) {
    table.add(
        {{names.of(*c), c->has_ended ? Look::faint : Look::plain},
         {has_hosts ? fmt::format("{}:{}", printable(c->host), c->pid) : std::to_string(c->pid),
          Look::faint},
         {fmt::format("{:.1f}", static_cast<double>(c->instances) / seconds), {}},
         {duration_or_dash(c->response, &analysis::Summary::p50, c->is_exact), {}},
         {duration_or_dash(c->response, &analysis::Summary::p99, c->is_exact), {}},
         {duration_or_dash(c->response, &analysis::Summary::max, c->is_exact), {}},
         last_response(*c),
         {c->total_late ? std::to_string(*c->total_late) : "-",
          c->total_late.value_or(0) > 0 ? Look::bad : Look::plain},
         {c->total_missed ? std::to_string(*c->total_missed) : "-",
          c->is_missing_too_many ? Look::bad : Look::plain}});
  }
  return table.render(style);
}

std::string thread_table(const Snapshot& snapshot, const viewer_export::TextStyle& style) {
  std::vector<const ThreadView*> busy;
  for (const auto& thread : snapshot.threads) {
    if (thread.cpu_percent) busy.push_back(&thread);
  }
  if (busy.empty()) return {};
  std::ranges::stable_sort(busy, [](const ThreadView* a, const ThreadView* b) {
    return *a->cpu_percent > *b->cpu_percent;
  });
  const auto left_out = busy.size() > kMaxThreads ? busy.size() - kMaxThreads : 0;
  busy.resize(busy.size() - left_out);
  TextTable table({{"thread", "", TextTable::Align::left},
                   {"pid", "", {}},
                   {"tid", "", {}},
                   {"CPU %", "", {}}});
  for (const auto* thread : busy) {
    table.add({{printable(thread->name), {}},
               {std::to_string(thread->pid), Look::faint},
               {std::to_string(thread->tid), Look::faint},
               {fmt::format("{:.1f}", *thread->cpu_percent), {}}});
  }
  auto text = '\n' + table.render(style);
  if (left_out > 0) text += fmt::format("and {}\n", counted(left_out, "thread"));
  return text;
}

// "FAIL M2 one-callback-per-thread (4)": the gravest rule, and how many subjects violate it.
// "INCONCLUSIVE T4 run-ended": the first rule that is undecided.
std::string verdict_words(const Snapshot& s) {
  std::string text(analysis::label(s.verdict));
  if (s.violations.empty()) {
    if (s.verdicts.empty()) return text;
    return text + fmt::format(" {} {}", s.verdicts.front().rule, s.verdicts.front().name);
  }
  const auto& gravest = s.violations.front();
  return text + fmt::format(" {} {} ({})", gravest.rule, gravest.name, gravest.subjects);
}

}  // namespace

std::string clock_time(std::int64_t realtime_ns) {
  const auto seconds = static_cast<std::time_t>(realtime_ns / kSecond);
  std::tm local{};
  localtime_r(&seconds, &local);
  return fmt::format("{:02}:{:02}:{:02}", local.tm_hour, local.tm_min, local.tm_sec);
}

std::vector<std::string> headline(const Snapshot& s) {
  std::uint64_t violations = 0;
  for (const auto& rule : s.violations)
    violations += rule.subjects;
  const auto lost = s.lost_events ? std::to_string(*s.lost_events)
                                  : fmt::format("unknown ({} packets)", s.lost_packets);
  std::vector<std::string> lines{
      fmt::format("cie live  {}  {}  {}", clock_time(s.realtime_ns), label(s.state),
                  verdict_words(s)),
      fmt::format("{}, lost {}, {} events, {:.0f}/s{}, {}", counted(violations, "violation"), lost,
                  s.events, s.events_per_second,
                  s.delay_ns ? ", " + format_duration(*s.delay_ns) + " old" : "",
                  counted(s.callbacks.size(), "callback"))};
  if (!s.message.empty()) lines.push_back(printable(s.message));
  return lines;
}

std::string name_of(const CallbackView& callback, const Snapshot& snapshot) {
  return snapshot.hosts.empty() ? callback.logical_id : callback.host + ' ' + callback.logical_id;
}

std::string_view isolation_of(const CallbackView& callback) {
  if (!callback.isolation) return "isolation unknown";
  switch (*callback.isolation) {
    case analysis::Isolation::isolated:
      return "isolated";
    case analysis::Isolation::not_isolated:
      return "not isolated";
    case analysis::Isolation::never_ran:
      break;
  }
  return "never ran";
}

viewer_export::TextCell last_response(const CallbackView& callback) {
  if (callback.is_open_long) {
    return {'>' + format_duration(*callback.open_ns),
            callback.is_open_certain ? Look::bad : Look::doubtful};
  }
  return {callback.last_response_ns ? format_duration(*callback.last_response_ns) : "-", {}};
}

viewer_export::TextCell open_words(const Snapshot& snapshot, const Names& names) {
  const CallbackView* longest = nullptr;
  for (const auto& callback : snapshot.callbacks) {
    if (!callback.is_open_long) continue;
    if (longest == nullptr || *callback.open_ns > *longest->open_ns) longest = &callback;
  }
  if (longest == nullptr) return {};
  const auto name = names.of(*longest);
  const auto open = format_duration(*longest->open_ns);
  auto text = longest->is_open_certain
                  ? fmt::format("{} has not ended for {}", name, open)
                  : fmt::format("{} began {} ago, and its end was not seen", name, open);
  if (longest->deadline_ns)
    text += fmt::format(" (deadline {})", format_duration(*longest->deadline_ns));
  return {std::move(text), longest->is_open_certain ? Look::bad : Look::doubtful};
}

std::vector<std::string> host_lines(const Snapshot& s) {
  std::vector<std::string> lines;
  for (const auto& host : s.hosts) {
    auto line = fmt::format("{}: {}", printable(host.host), label(host.state));
    if (host.state == SourceState::silent || host.state == SourceState::lost) {
      line += " for " + format_duration(host.silent_ns);
    }
    if (!host.message.empty()) line += ", " + printable(host.message);
    lines.push_back(line + "  (" + printable(host.session) + ')');
  }
  return lines;
}

std::string batch_text(const Snapshot& snapshot, SortKey key, std::string_view filter,
                       const viewer_export::TextStyle& style) {
  const Names names(snapshot, style);
  std::string text;
  auto lines = headline(snapshot);
  lines.front() += "  " + printable(snapshot.watched);
  constexpr std::size_t kIndent = 2;
  for (const auto& line : lines)
    text += filled(line, style.columns, kIndent);
  for (const auto& line : host_lines(snapshot))
    text += filled(line, style.columns, kIndent);
  if (const auto open = open_words(snapshot, names); !open.text.empty())
    text += viewer_export::paint(filled(open.text, style.columns, kIndent), open.look, style);
  text += callback_table(snapshot, key, filter, names, style);
  text += thread_table(snapshot, style);
  bool is_first = true;
  for (const auto& change : snapshot.changes) {
    if (is_first) text += '\n';
    is_first = false;
    const auto look = change.to == Verdict::fail ? Look::bad : Look::good;
    const auto verdict = fmt::format(
        "{} {}", change.to == Verdict::fail ? "VIOLATED" : analysis::label(change.to), change.rule);
    const auto sentence =
        fmt::format("{} {}, {}", verdict, change.name, names.in_words(sentence_of(change)));
    text += viewer_export::paint(verdict, look, style) +
            filled(sentence, style.columns, kIndent).substr(verdict.size());
  }
  return text + '\n';
}

}  // namespace cie::live
