// The terminal in full-screen mode, by ncurses.
#pragma once

#include "frame.hpp"
#include "pages.hpp"

#include <optional>

namespace cie::live {

struct Press {
  Key key = Key::character;
  char character = '\0';
};

// Takes the terminal for its lifetime and gives it back as it was. One at a time.
class Screen {
 public:
  // Throws std::runtime_error if the terminal cannot do it.
  Screen();
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  Size size() const;
  // The next key that was pressed; empty if there is none. Takes note of a new size of the window.
  std::optional<Press> press();
  void draw(const Frame& frame);

 private:
  bool has_colours_ = false;
  bool is_utf8_ = false;
};

}  // namespace cie::live
