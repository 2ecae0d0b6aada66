// What a full screen shows, as lines of painted text: everything but the terminal.
#pragma once

#include <cie/analysis/verdict.hpp>

#include "words/text_layout.hpp"

#include <cstddef>
#include <string>
#include <utility>
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

inline Line text_line(std::string text, viewer_export::Look look = viewer_export::Look::plain) {
  return Line{.spans = {{std::move(text), look}}};
}

inline viewer_export::Look look_of(analysis::Verdict verdict) noexcept {
  using analysis::Verdict;
  using viewer_export::Look;
  if (verdict == Verdict::fail) return Look::bad;
  return verdict == Verdict::inconclusive ? Look::doubtful : Look::good;
}

// At most as many lines, and as wide, as the screen it was made for.
using Frame = std::vector<Line>;

}  // namespace cie::live
