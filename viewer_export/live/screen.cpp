#include "screen.hpp"

#include <algorithm>
#include <clocale>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string_view>

#include <curses.h>
#include <langinfo.h>
#include <unistd.h>

namespace cie::live {
namespace {

using viewer_export::Look;

constexpr int kEscape = 27;
constexpr int kRedraw = 12;         // Ctrl-L
constexpr int kEscapeDelayMs = 50;  // an arrow key over ssh takes less
enum Pair : short { red = 1, green = 2, yellow = 3 };

int attributes(Look look, bool has_colours) {
  const auto in = [has_colours](short pair, int otherwise) {
    return has_colours ? static_cast<int>(COLOR_PAIR(pair)) : otherwise;
  };
  switch (look) {
    case Look::strong:
      return static_cast<int>(A_BOLD);
    case Look::bad:
      return static_cast<int>(A_BOLD) | in(red, 0);
    case Look::good:
      return in(green, 0);
    case Look::doubtful:
      return in(yellow, 0);
    case Look::faint:
      return static_cast<int>(A_DIM);
    case Look::plain:
      break;
  }
  return static_cast<int>(A_NORMAL);
}

std::string ascii(std::string text) {
  for (auto& c : text) {
    if (static_cast<unsigned char>(c) >= 0x80) c = '?';
  }
  return text;
}

bool is_set(const char* variable) {
  const char* text = std::getenv(variable);
  return text != nullptr && *text != '\0';
}

}  // namespace

Screen::Screen() {
  std::setlocale(LC_CTYPE, "");
  is_utf8_ = std::string_view(nl_langinfo(CODESET)) == "UTF-8";
  // newterm instead of initscr, which ends the program when it does not know the terminal.
  if (newterm(nullptr, stdout, stdin) == nullptr) {
    throw std::runtime_error(
        "this terminal cannot show a full screen (is TERM set?): use --batch, --json or --listen");
  }
  set_escdelay(kEscapeDelayMs);
  cbreak();
  noecho();
  nonl();
  curs_set(0);
  keypad(stdscr, TRUE);
  nodelay(stdscr, TRUE);
  if (!is_set("NO_COLOR") && has_colors()) {
    start_color();
    use_default_colors();
    init_pair(red, COLOR_RED, -1);
    init_pair(green, COLOR_GREEN, -1);
    init_pair(yellow, COLOR_YELLOW, -1);
    has_colours_ = true;
  }
}

Screen::~Screen() { endwin(); }

Size Screen::size() const {
  return {.rows = static_cast<std::size_t>(std::max(1, getmaxy(stdscr))),
          .columns = static_cast<std::size_t>(std::max(1, getmaxx(stdscr)))};
}

std::optional<Press> Screen::press() {
  for (;;) {
    const int key = getch();
    switch (key) {
      case ERR:
        return std::nullopt;
      case KEY_RESIZE:
        erase();
        continue;
      case KEY_UP:
        return Press{.key = Key::up};
      case KEY_DOWN:
        return Press{.key = Key::down};
      case KEY_PPAGE:
        return Press{.key = Key::page_up};
      case KEY_NPAGE:
        return Press{.key = Key::page_down};
      case KEY_HOME:
        return Press{.key = Key::home};
      case KEY_END:
        return Press{.key = Key::end};
      case KEY_ENTER:
      case '\n':
      case '\r':
        return Press{.key = Key::enter};
      case kRedraw:  // something else wrote on the terminal
        clearok(curscr, TRUE);
        return Press{};
      case kEscape:
        return Press{.key = Key::back};
      case KEY_BACKSPACE:
      case '\b':
      case 127:
        return Press{.key = Key::backspace};
      default:
        if (key >= ' ' && key < 127) return Press{.character = static_cast<char>(key)};
    }
  }
}

void Screen::draw(const Frame& frame) {
  ::erase();
  const auto [rows, columns] = size();
  for (std::size_t row = 0; row < std::min(frame.size(), rows); ++row) {
    const auto& line = frame[row];
    const auto whole = static_cast<int>((line.is_selected || line.is_title) ? A_REVERSE : A_NORMAL);
    ::move(static_cast<int>(row), 0);
    std::size_t used = 0;
    for (const auto& span : line.spans) {
      attrset(attributes(span.look, has_colours_) | whole);
      addstr((is_utf8_ ? span.text : ascii(span.text)).c_str());
      used += viewer_export::display_width(span.text);
    }
    attrset(whole);
    if (whole != static_cast<int>(A_NORMAL) && used < columns) {
      addstr(std::string(columns - used, ' ').c_str());
    }
  }
  attrset(A_NORMAL);
  refresh();
}

}  // namespace cie::live
