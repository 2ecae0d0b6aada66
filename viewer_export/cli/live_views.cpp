#include "live_views.hpp"

#include <cie/tracepoints/text_columns.hpp>
#include <cie/viewer_export/output_file.hpp>

#include "batch_text.hpp"
#include "output.hpp"
#include "snapshot_json.hpp"

#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

namespace cie::cli {
namespace {

constexpr const char* kOpenWarning =
    R"(cie live: warning: this is no loopback address. Everybody who reaches this machine can read the command with
its arguments, names of hosts, processes, threads, callbacks and topics, response times and verdicts there: without a password,
and not encrypted. To keep it to this machine: --listen PORT, and a tunnel (ssh -L) for who is elsewhere.
)";

// At once: what reads may be waiting for this line.
void print(const std::string& text) {
  const bool is_written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
  if (!is_written || std::fflush(stdout) != 0) {
    if (errno == EPIPE) throw viewer_export::ClosedPipe("nobody reads standard output any more");
    throw std::system_error(errno, std::generic_category(), "cannot write to standard output");
  }
}

viewer_export::TextStyle style_of(bool is_terminal) {
  auto style = text_style(is_terminal);
  style.unicode = is_terminal && is_utf8_locale();
  if (is_terminal) style.columns = terminal_columns(STDOUT_FILENO);
  return style;
}

}  // namespace

LiveViews::LiveViews(const LiveOptions& options, const live::History& history)
    : options_(options),
      history_(history),
      pages_(history, options.sort, options.filter, style_of(true)) {
  if (options.listen) {
    server_.emplace(options.listen->host, options.listen->port);
    const auto note = fmt::format("{} and {}metrics", server_->url(), server_->url());
    fmt::print(stderr, "cie live: {}\n", note);
    const bool is_open = !server_->is_loopback();
    if (is_open) fmt::print(stderr, "{}", kOpenWarning);
    pages_.set_note((is_open ? "serving to the whole network " : "serving ") + note);
  }
  if (options.view == LiveOptions::View::screen) {
    screen_.emplace();
    screen_->draw(pages_.draw(screen_->size()));
  }
}

LiveViews::~LiveViews() = default;

void LiveViews::show_text() const {
  print(live::batch_text(history_.latest(), options_.sort, options_.filter,
                         style_of(::isatty(STDOUT_FILENO) == 1)));
}

void LiveViews::show_json() const {
  print(live::json_line(history_.latest(), options_.with_instances) + '\n');
}

void LiveViews::show() {
  if (server_) server_->publish(history_.latest());
  switch (options_.view) {
    case LiveOptions::View::screen:
      screen_->draw(pages_.draw(screen_->size()));
      break;
    case LiveOptions::View::text:
      show_text();
      break;
    case LiveOptions::View::json:
      show_json();
      break;
    case LiveOptions::View::none:
      break;
  }
}

bool LiveViews::update() {
  if (!screen_) return true;
  bool is_pressed = false;
  while (const auto press = screen_->press()) {
    if (!pages_.press(press->key, press->character)) return false;
    is_pressed = true;
  }
  const auto size = screen_->size();
  if (is_pressed || size != size_) screen_->draw(pages_.draw(size));
  size_ = size;
  return true;
}

void LiveViews::source_ended(const std::string& failure) {
  if (std::exchange(is_over_, true)) return;
  pages_.source_ended(failure);
  if (server_) {  // whoever follows it must not take what was seen last for what is
    auto last = history_.latest();
    last.state = failure.empty() ? live::SourceState::ended : live::SourceState::lost;
    last.message = failure;
    last.changes.clear();
    for (auto& callback : last.callbacks)
      callback.recent.clear();
    server_->publish(last);
  }
  if (screen_) screen_->draw(pages_.draw(screen_->size()));
}

bool LiveViews::stays_after_the_end() const noexcept { return screen_.has_value(); }

int LiveViews::input_descriptor() const noexcept { return screen_ ? STDIN_FILENO : -1; }

}  // namespace cie::cli
