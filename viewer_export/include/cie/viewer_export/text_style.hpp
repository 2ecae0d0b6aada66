// How text for people is laid out.
#pragma once

#include <cstddef>

namespace cie::viewer_export {

struct TextStyle {
  bool colour = false;        // ANSI colours; only for a terminal, and not when NO_COLOR is set
  std::size_t columns = 100;  // lines keep within it where names allow
  bool unicode = false;       // symbols besides ASCII; only for a terminal whose locale has them
  bool ids = false;           // callbacks by their logical ids, not by short names
};

}  // namespace cie::viewer_export
