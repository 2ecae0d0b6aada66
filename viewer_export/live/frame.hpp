// What a full screen shows, as lines of painted text: everything but the terminal.
#pragma once

#include "text_layout.hpp"

#include <cstddef>
#include <string>
#include <vector>

namespace cie::live {

struct Span {
  std::string text;  // printable
  viewer_export::Look look = viewer_export::Look::plain;
};

struct Line {
  std::vector<Span> spans;
  bool is_selected = false;
  bool is_title = false;
};

// At most as many lines, and as wide, as the screen it was made for.
using Frame = std::vector<Line>;

}  // namespace cie::live
