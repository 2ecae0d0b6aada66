#include "batch_text.hpp"
#include "pages.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

namespace cie::live {
namespace {

using analysis::Summary;
using viewer_export::display_width;
using viewer_export::elide;
using viewer_export::format_duration;
using viewer_export::Look;

constexpr std::size_t kMinName = 12;
constexpr double kNanosecondsPerSecond = 1e9;

std::string right(std::string_view text, std::size_t width) {
  return fmt::format("{:>{}}", text, width);
}

std::string left(const std::string& name, std::size_t width) {
  const auto text = elide(printable(name), width);
  return text + std::string(width - std::min(width, display_width(text)), ' ');
}

std::string duration(const std::optional<Summary>& summary, std::int64_t Summary::*field,
                     bool is_exact) {
  if (!summary) return "-";
  return (is_exact ? "" : ">") + format_duration(*summary.*field);
}

constexpr std::array<std::pair<std::string_view, std::string_view>, 13> kHelp{{
    {"up, down, j, k", "select; also page up and down, home, end"},
    {"Enter", "the last instances of the selected callback"},
    {"Escape", "back"},
    {"c  t  v", "callbacks; threads by CPU; violations and what is undecided"},
    {"s", "sort by the next column: p99, p50, max, rate, late, missed, name"},
    {"/", "filter by name, host or pid; Enter keeps it, Escape drops it"},
    {"p, space", "pause: look at one moment while events go on to be counted"},
    {"h, ?", "this page"},
    {"q", "quit; a command that was started is ended"},
    {"", ""},
    {"runs/s to max", "of the last ten seconds; late and missed since the start"},
    {">1.2 ms", "a lower bound: when the callback was released is not known"},
    {"late", "response time beyond the deadline; -: it has none"},
}};

}  // namespace

Pages::Table Pages::callbacks(std::size_t columns) {
  const auto& latest = shown().latest();
  const auto chosen = choose(latest, sort_, filter_);
  const auto short_names = names();
  constexpr std::size_t kNumbers = 8 + 4 * 10 + 7 + 7;
  const bool is_wide = columns >= kNumbers + 8 + 24;
  const auto numbers = kNumbers + (is_wide ? 8 : 0) - (is_wide ? 0 : 10);
  const auto name = std::max(kMinName, columns - std::min(columns, numbers));
  const auto mark = [this](SortKey key, std::string_view title) {
    return sort_ == key ? '*' + std::string(title) : std::string(title);
  };
  Table table;
  table.title =
      text_line(left(mark(SortKey::name, "callback"), name) + (is_wide ? right("pid", 8) : "") +
                right(mark(SortKey::rate, "runs/s"), 8) + right(mark(SortKey::p50, "p50"), 10) +
                right(mark(SortKey::response, "p99"), 10) + right(mark(SortKey::max, "max"), 10) +
                (is_wide ? right("last", 10) : "") + right(mark(SortKey::late, "late"), 7) +
                right(mark(SortKey::missed, "missed"), 7));
  const auto seconds = std::max(static_cast<double>(latest.window_ns) / kNanosecondsPerSecond, 0.1);
  order_.clear();
  for (const auto* c : chosen) {
    order_.push_back(c->index);
    Line line;
    const auto add = [&line](std::string text, Look look = Look::plain) {
      line.spans.push_back({std::move(text), look});
    };
    add(left(short_names.of(*c), name), c->has_ended ? Look::faint : Look::plain);
    if (is_wide) add(right(std::to_string(c->pid), 8), Look::faint);
    add(right(fmt::format("{:.1f}", static_cast<double>(c->instances) / seconds), 8));
    add(right(duration(c->response, &Summary::p50, c->is_exact), 10));
    add(right(duration(c->response, &Summary::p99, c->is_exact), 10));
    add(right(duration(c->response, &Summary::max, c->is_exact), 10));
    if (is_wide) {
      add(right(c->last_response_ns ? format_duration(*c->last_response_ns) : "-", 10));
    }
    add(right(c->deadline_ns ? std::to_string(c->total_late) : "-", 7), c->late > 0 ? Look::bad
                                                                        : c->total_late > 0
                                                                            ? Look::doubtful
                                                                            : Look::plain);
    add(right(std::to_string(c->total_missed), 7), c->missed > 0         ? Look::bad
                                                   : c->total_missed > 0 ? Look::doubtful
                                                                         : Look::plain);
    table.rows.push_back(std::move(line));
  }
  return table;
}

Pages::Table Pages::instances(std::size_t columns) const {
  Table table;
  const auto* callback = opened();
  const auto& latest = shown().latest();
  const auto id = callback != nullptr ? name_of(*callback, latest) : std::string("gone");
  table.title = text_line(left(id, columns > 3 ? columns - 1 : columns));
  if (callback == nullptr) return table;
  table.rows.push_back(text_line(fmt::format(
      "{}  pid {}  deadline {}  {}  since the start: {}, max {}", callback->kind, callback->pid,
      callback->deadline_ns ? format_duration(*callback->deadline_ns) : "-",
      isolation_of(*callback), viewer_export::counted(callback->total_instances, "instance"),
      duration(callback->total_response, &Summary::max, callback->is_exact))));
  table.rows.push_back(
      text_line(fmt::format("{:>12}{:>9}{:>5}{:>12}{:>12}{:>12}{:>8}", "seq", "tid", "CPU",
                            "before", "response", "execution", "missed"),
                Look::strong));
  const auto& instances = shown().instances(callback->index);
  // Of several machines' clocks only the callback's own is comparable.
  const auto now_ns = latest.hosts.empty() ? latest.time_ns : callback->last_end_ns.value_or(0);
  for (auto i = instances.rbegin(); i != instances.rend(); ++i) {
    auto line = text_line(fmt::format(
        "{:>12}{:>9}{:>5}{:>12}", i->seq, i->tid, i->cpu ? std::to_string(*i->cpu) : "-",
        format_duration(std::max<std::int64_t>(0, now_ns - i->end_ns))));
    line.spans.push_back({right((i->is_exact ? "" : ">") + format_duration(i->response_ns), 12),
                          i->is_late ? Look::bad : Look::plain});
    line.spans.push_back({right(i->execution_ns ? format_duration(*i->execution_ns) : "-", 12)});
    line.spans.push_back(
        {right(std::to_string(i->missed), 8), i->missed > 0 ? Look::bad : Look::plain});
    table.rows.push_back(std::move(line));
  }
  return table;
}

Pages::Table Pages::threads(std::size_t columns) const {
  const auto& latest = shown().latest();
  const auto short_names = names();
  std::vector<const ThreadView*> sorted;
  for (const auto& thread : latest.threads)
    sorted.push_back(&thread);
  std::ranges::stable_sort(sorted, [](const ThreadView* a, const ThreadView* b) {
    return a->cpu_percent.value_or(-1) > b->cpu_percent.value_or(-1);
  });
  Table table;
  constexpr std::size_t kName = 17;
  const auto rest = columns > kName + 28 ? columns - kName - 28 : kMinName;
  table.title =
      text_line(left("thread", kName) + fmt::format("{:>8}{:>9}{:>8}  ", "pid", "tid", "CPU %") +
                left("callbacks", rest));
  for (const auto* thread : sorted) {
    std::string callbacks;
    for (const auto& id : thread->callbacks)
      callbacks += (callbacks.empty() ? "" : ", ") + short_names.in_words(id);
    if (callbacks.empty()) callbacks = thread->role;
    table.rows.push_back(text_line(
        left(latest.hosts.empty() ? thread->name : thread->host + ' ' + thread->name, kName) +
        fmt::format("{:>8}{:>9}{:>8}  ", thread->pid, thread->tid,
                    thread->cpu_percent ? fmt::format("{:.1f}", *thread->cpu_percent) : "-") +
        left(callbacks, rest)));
  }
  return table;
}

Pages::Table Pages::verdicts(std::size_t columns) const {
  const auto& latest = shown().latest();
  Table table;
  table.title = text_line(fmt::format("{:<13}{:<5}{}", "verdict", "rule", "subject: evidence"));
  const auto short_names = names();
  constexpr std::size_t kBefore = 18;
  const auto width = columns > kBefore + kMinName ? columns - kBefore : kMinName;
  for (const auto& verdict : latest.verdicts) {
    const auto text =
        short_names.in_words(verdict.name + ", " + verdict.subject + ": " + verdict.note);
    std::string head = fmt::format("{:<5}", verdict.rule);
    Line line{.spans = {{fmt::format("{:<13}", analysis::label(verdict.verdict)),
                         look_of(verdict.verdict)}}};
    for (const auto& part : viewer_export::wrap(text, width)) {
      line.spans.push_back({head + part});
      table.rows.push_back(std::exchange(line, text_line(std::string(13, ' '))));
      head = std::string(5, ' ');
    }
  }
  if (latest.verdicts_left_out > 0) {
    table.rows.push_back(text_line(fmt::format("and {} more", latest.verdicts_left_out)));
  }
  if (latest.verdicts.empty()) table.rows.push_back(text_line("nothing is violated or undecided"));
  return table;
}

Pages::Table Pages::help() {
  Table table;
  table.title = text_line("keys");
  for (const auto& [key, meaning] : kHelp)
    table.rows.push_back(text_line(fmt::format("{:<16}{}", key, meaning)));
  return table;
}

}  // namespace cie::live
