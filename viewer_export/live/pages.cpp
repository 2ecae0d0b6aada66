#include "pages.hpp"

#include "batch_text.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace cie::live {
namespace {

using analysis::Verdict;
using viewer_export::display_width;
using viewer_export::elide;
using viewer_export::Look;

constexpr std::size_t kRowsAround = 6;  // of the table

// Cuts a line to the screen's width.
Line cut(Line line, std::size_t columns) {
  std::size_t used = 0;
  for (auto& span : line.spans) {
    const auto width = display_width(span.text);
    if (used + width > columns) span.text = elide(span.text, columns - used);
    used += std::min(width, columns - used);
  }
  return line;
}

}  // namespace

Pages::Pages(const History& history, SortKey sort, std::string filter,
             const viewer_export::TextStyle& style)
    : history_(history), sort_(sort), filter_(std::move(filter)), style_(style) {}

bool Pages::press(Key key, char character) {
  if (is_filtering_) return press_in_filter(key, character);
  switch (key) {
    case Key::up:
      move(-1);
      break;
    case Key::down:
      move(1);
      break;
    case Key::page_up:
      move(-static_cast<std::ptrdiff_t>(visible_));
      break;
    case Key::page_down:
      move(static_cast<std::ptrdiff_t>(visible_));
      break;
    case Key::home:
      selected_ = 0;
      break;
    case Key::end:
      selected_ = rows_;
      move(0);
      break;
    case Key::enter:
      enter();
      break;
    case Key::back:
    case Key::backspace:
      if (page_ == Page::callbacks) filter_.clear();
      open(Page::callbacks);
      break;
    case Key::character:
      return press_letter(character);
  }
  return true;
}

bool Pages::press_in_filter(Key key, char character) {
  constexpr std::size_t kMaxFilter = 60;
  if (key == Key::enter) is_filtering_ = false;
  if (key == Key::back) {
    is_filtering_ = false;
    filter_.clear();
  }
  if (key == Key::backspace && !filter_.empty()) filter_.pop_back();
  if (key == Key::character && character >= ' ' && filter_.size() < kMaxFilter) {
    filter_ += character;
  }
  selected_ = 0;
  return true;
}

bool Pages::press_letter(char letter) {
  switch (letter) {
    case 'q':
      return false;
    case 'j':
      move(1);
      break;
    case 'k':
      move(-1);
      break;
    case 'c':
      open(Page::callbacks);
      break;
    case 't':
      open(Page::threads);
      break;
    case 'v':
      open(Page::verdicts);
      break;
    case 'h':
    case '?':
      open(Page::help);
      break;
    case 's':
      sort_ = sort_ == SortKey::name ? SortKey::response
                                     : static_cast<SortKey>(static_cast<int>(sort_) + 1);
      break;
    case '/':
      open(Page::callbacks);
      is_filtering_ = true;
      break;
    case 'p':
    case ' ':
      if (paused_) {
        paused_.reset();
      } else {
        paused_ = history_;
      }
      break;
    default:
      break;
  }
  return true;
}

void Pages::move(std::ptrdiff_t distance) {
  const auto last = rows_ == 0 ? 0 : static_cast<std::ptrdiff_t>(rows_) - 1;
  selected_ = static_cast<std::size_t>(
      std::clamp(static_cast<std::ptrdiff_t>(selected_) + distance, std::ptrdiff_t{0}, last));
}

void Pages::open(Page page) {
  if (page_ != page) selected_ = 0;
  page_ = page;
}

void Pages::enter() {
  if (page_ != Page::callbacks || selected_ >= order_.size()) return;
  callback_ = order_[selected_];
  open(Page::instances);
}

void Pages::source_ended(const std::string& failure) {
  is_over_ = true;
  failure_ = printable(failure);
}

void Pages::set_note(const std::string& note) { note_ = printable(note); }

const CallbackView* Pages::opened() const {
  for (const auto& callback : shown().latest().callbacks) {
    if (callback_ == callback.index) return &callback;
  }
  return nullptr;
}

Pages::Table Pages::page(std::size_t columns) {
  switch (page_) {
    case Page::instances:
      return instances(columns);
    case Page::threads:
      return threads(columns);
    case Page::verdicts:
      return verdicts(columns);
    case Page::help:
      return help();
    case Page::callbacks:
      break;
  }
  return callbacks(columns);
}

// What is out of the ordinary: most urgent first.
Line Pages::status() const {
  if (is_filtering_) return text_line("filter: " + printable(filter_) + '_', Look::strong);
  if (!failure_.empty()) return text_line(failure_, Look::bad);
  if (is_over_) return text_line("the session ended; q quits", Look::strong);
  const auto& latest = shown().latest();
  if (latest.sequence == 0) return text_line("waiting for the first events", Look::faint);
  if (!latest.message.empty()) return text_line(printable(latest.message), Look::bad);
  const auto lines = host_lines(latest);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const auto& host = latest.hosts[i];
    const bool is_fine = host.state == SourceState::waiting || host.state == SourceState::streaming;
    if (!is_fine && !(host.state == SourceState::ended && host.message.empty())) {
      return text_line(lines[i], Look::bad);
    }
  }
  std::string text;
  if (paused_) text = "PAUSED, p goes on.  ";
  if (!filter_.empty()) text += "filter: " + printable(filter_) + ", Escape drops it.  ";
  if (const auto open = open_words(latest, names()); !open.text.empty()) {
    Line line = text_line(std::move(text), Look::strong);
    line.spans.push_back({open.text, open.look});
    return line;
  }
  if (!shown().changes().empty()) {
    const auto& change = shown().changes().back();
    Line line = text_line(std::move(text), Look::strong);
    line.spans.push_back(
        {fmt::format("{} {} {}, {}",
                     change.to == Verdict::fail ? "VIOLATED" : analysis::label(change.to),
                     change.rule, change.name, names().in_words(change.subject)),
         look_of(change.to)});
    return line;
  }
  if (text.empty()) return text_line(note_, Look::faint);
  return text_line(std::move(text), Look::strong);
}

// Names are cut in the table.
Line Pages::selected_name() const {
  if (page_ != Page::callbacks || selected_ >= order_.size()) return text_line("");
  for (const auto& callback : shown().latest().callbacks) {
    if (callback.index == order_[selected_])
      return text_line(printable(name_of(callback, shown().latest())));
  }
  return text_line("");
}

Line Pages::keys() const {
  return text_line("q quit  h help  s sort  / filter  p pause  Enter open  t threads  v violations",
                   Look::faint);
}

Frame Pages::draw(Size size) {
  const auto& latest = shown().latest();
  auto lines = headline(latest);
  lines.resize(2);
  Frame frame;
  auto top = text_line(lines[0], latest.verdict == Verdict::fail ? Look::bad : Look::strong);
  top.spans.push_back({"  " + printable(latest.watched)});
  frame.push_back(std::move(top));
  frame.push_back(text_line(lines[1], latest.lost_events != 0 ? Look::bad : Look::plain));
  frame.push_back(status());
  auto table = page(size.columns);
  table.title.is_title = true;
  // Not where it would take the room of the only row.
  const bool is_grouped = table.group && size.rows > kRowsAround + 1;
  if (is_grouped) frame.push_back(std::move(*table.group));
  frame.push_back(std::move(table.title));
  rows_ = table.rows.size();
  move(0);
  const auto around = kRowsAround + (is_grouped ? 1 : 0);
  visible_ = size.rows > around ? size.rows - around : 1;
  // The window of rows that holds the selected one.
  const auto first = selected_ < visible_ ? 0 : selected_ - visible_ + 1;
  for (auto i = first; i < std::min(rows_, first + visible_); ++i) {
    table.rows[i].is_selected = i == selected_ && page_ == Page::callbacks;
    frame.push_back(std::move(table.rows[i]));
  }
  while (frame.size() + 1 < size.rows)
    frame.push_back(text_line(""));
  if (size.rows > kRowsAround) frame.back() = selected_name();
  frame.push_back(keys());
  if (frame.size() > size.rows) frame.resize(size.rows);
  for (auto& line : frame)
    line = cut(std::move(line), size.columns);
  return frame;
}

}  // namespace cie::live
