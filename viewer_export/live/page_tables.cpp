#include "batch_text.hpp"
#include "pages.hpp"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <utility>

#include <fmt/format.h>

namespace cie::live {
namespace {

using analysis::Rare;
using analysis::Summary;
using viewer_export::display_width;
using viewer_export::elide;
using viewer_export::format_duration;
using viewer_export::Look;

constexpr std::size_t kMinName = 12;
constexpr std::size_t kRoomyName = 24;
constexpr double kNanosecondsPerSecond = 1e9;

std::string right(std::string_view text, std::size_t width) {
  return fmt::format("{:>{}}", text, width);
}

std::string left(const std::string& name, std::size_t width) {
  const auto text = elide(printable(name), width);
  return text + std::string(width - std::min(width, display_width(text)), ' ');
}

std::string duration(const Rare<Summary>& summary, std::int64_t Summary::*field, bool is_exact) {
  if (!summary) return "-";
  return (is_exact ? "" : ">") + format_duration(*summary.*field);
}

constexpr std::array<std::pair<std::string_view, std::string_view>, 14> kHelp{{
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
    {"p50, p99, max", "of the response time; what there is room for"},
    {">1.2 ms", "a lower bound: when the callback was released is not known"},
    {"late", "response time beyond the deadline; -: it has none"},
    {"last", "in colour: not of one that ended, but since the start of one that has not"},
}};

}  // namespace

// The numbers of a callback, from left to right; where there is no room for all, those of the
// highest rank go first.
std::vector<NumberColumn> Pages::number_columns(std::size_t columns) const {
  const auto of_window = [](std::int64_t Summary::*field) {
    return [field](const CallbackView& c) { return Span{duration(c.response, field, c.is_exact)}; };
  };
  const auto last = [](const CallbackView& c) {
    const auto cell = last_response(c);
    return Span{cell.text, cell.look};
  };
  const auto seconds =
      std::max(static_cast<double>(shown().latest().window_ns) / kNanosecondsPerSecond, 0.1);
  const auto rate = [seconds](const CallbackView& c) {
    return Span{fmt::format("{:.1f}", static_cast<double>(c.instances) / seconds)};
  };
  const auto look_of_count = [](std::uint64_t lately, std::uint64_t total) {
    return lately > 0 ? Look::bad : total > 0 ? Look::doubtful : Look::plain;
  };
  const auto late = [look_of_count](const CallbackView& c) {
    if (!c.total_late) return Span{"-"};
    return Span{std::to_string(*c.total_late), look_of_count(c.late.value_or(0), *c.total_late)};
  };
  const auto missed = [look_of_count](const CallbackView& c) {
    if (!c.total_missed) return Span{"-"};
    return Span{
        std::to_string(*c.total_missed),
        c.is_missing_too_many ? look_of_count(c.missed.value_or(0), *c.total_missed) : Look::plain};
  };
  const auto pid = [](const CallbackView& c) { return Span{std::to_string(c.pid), Look::faint}; };
  using Group = NumberColumn::Group;
  std::vector<NumberColumn> all{
      {"pid", {}, 8, 8, Group::none, pid},
      {"inst/s", SortKey::rate, 8, 5, Group::window, rate},
      {"p50", SortKey::p50, 10, 6, Group::window, of_window(&Summary::p50)},
      {"p99", SortKey::response, 10, 1, Group::window, of_window(&Summary::p99)},
      {"max", SortKey::max, 10, 2, Group::window, of_window(&Summary::max)},
      {"last", {}, 10, 7, Group::window, last},
      {"late", SortKey::late, 7, 3, Group::total, late},
      {"missed", SortKey::missed, 7, 4, Group::total, missed}};
  const auto width = [&all] {
    std::size_t sum = 0;
    for (const auto& column : all)
      sum += column.width;
    return sum;
  };
  const auto drop_last_of_rank = [&all] {
    all.erase(std::ranges::max_element(all, {}, &NumberColumn::rank));
  };
  if (columns < width() + kRoomyName) {
    drop_last_of_rank();
    drop_last_of_rank();
  }
  while (!all.empty() && columns < width() + kMinName)
    drop_last_of_rank();
  return all;
}

Pages::Table Pages::callbacks(std::size_t columns) {
  const auto& latest = shown().latest();
  const auto short_names = names();
  const auto numbers = number_columns(columns);
  const auto width_of = [&numbers](NumberColumn::Group group) {
    std::size_t width = 0;
    for (const auto& column : numbers)
      width += column.group == group ? column.width : 0;
    return width;
  };
  using Group = NumberColumn::Group;
  const auto all = width_of(Group::none) + width_of(Group::window) + width_of(Group::total);
  const auto name = std::max(kMinName, columns - std::min(columns, all));
  const auto mark = [this](std::optional<SortKey> key, std::string_view title) {
    return sort_ == key ? '*' + std::string(title) : std::string(title);
  };
  // The first of these words that there is room for.
  const auto over = [&width_of](Group group, std::initializer_list<std::string> words) {
    const auto width = width_of(group);
    const auto fitting = std::ranges::find_if(
        words, [width](const std::string& text) { return text.size() < width; });
    return right(fitting == words.end() ? std::string() : *fitting, width);
  };
  const auto seconds = static_cast<double>(latest.window_ns) / kNanosecondsPerSecond;
  const auto window = fmt::format("last {:.0f} s", std::max(seconds, 1.0));
  Table table;
  table.group =
      text_line(std::string(name + width_of(Group::none), ' ') +
                over(Group::window, {window + ": response time", "response, " + window, window}) +
                over(Group::total, {"since start", "total"}));
  auto title = left(mark(SortKey::name, "callback"), name);
  for (const auto& column : numbers)
    title += right(mark(column.key, column.title), column.width);
  table.title = text_line(std::move(title));
  order_.clear();
  for (const auto* c : choose(latest, sort_, filter_)) {
    order_.push_back(c->index);
    Line line;
    line.spans.push_back(
        {left(short_names.of(*c), name), c->has_ended ? Look::faint : Look::plain});
    for (const auto& column : numbers) {
      auto cell = column.cell(*c);
      cell.text = right(cell.text, column.width);
      line.spans.push_back(std::move(cell));
    }
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
      isolation_of(*callback), counted(callback->total_instances, "instance"),
      duration(callback->total_response, &Summary::max, callback->is_exact))));
  // In pieces as the rows are, which are cut where there is no room for all.
  auto titles =
      text_line(fmt::format("{:>12}{:>9}{:>5}{:>12}", "seq", "tid", "CPU", "before"), Look::strong);
  for (const auto& title : {right("response", 12), right("execution", 12), right("missed", 8)})
    titles.spans.push_back({title, Look::strong});
  table.rows.push_back(std::move(titles));
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
    const auto text = short_names.in_words(verdict.name + ", " + sentence_of(verdict));
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
