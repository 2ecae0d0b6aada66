// How text for people is laid out.
#pragma once

#include <cstddef>

namespace cie::viewer_export {

// A terminal of 24 lines needs one for the prompt that follows, or the headline scrolls away.
constexpr std::size_t kScreenLines = 23;

struct TextStyle {
  bool colour = false;        // ANSI colours; only for a terminal, and not when NO_COLOR is set
  std::size_t columns = 100;  // lines keep within it where names allow
  std::size_t lines = kScreenLines;  // that a screen has room for
  bool unicode = false;  // symbols besides ASCII; only for a terminal whose locale has them
  bool ids = false;      // callbacks by their logical ids, not by short names
};

}  // namespace cie::viewer_export
