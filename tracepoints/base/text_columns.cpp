#include <cie/tracepoints/text_columns.hpp>
#include <cie/tracepoints/utf8.hpp>

#include <algorithm>
#include <span>
#include <utility>

#include <sys/ioctl.h>

namespace cie {
namespace {

struct Range {
  char32_t first;
  char32_t last;
};
constexpr Range kCombining[] = {
    {0x300, 0x36F}, {0x1AB0, 0x1AFF}, {0x20D0, 0x20FF}, {0xFE00, 0xFE0F}, {0xFE20, 0xFE2F}};
constexpr Range kWide[] = {  // East Asian wide and emoji, coarsely
    {0x1100, 0x115F}, {0x2E80, 0xA4CF}, {0xAC00, 0xD7A3},   {0xF900, 0xFAFF},
    {0xFE30, 0xFE6F}, {0xFF00, 0xFF60}, {0x1F300, 0x1FAFF}, {0x20000, 0x3FFFD}};

bool is_in(std::span<const Range> ranges, char32_t c) {
  return std::ranges::any_of(
      ranges, [c](const Range& range) { return c >= range.first && c <= range.last; });
}

std::size_t width_of(char32_t c) {
  if (is_in(kCombining, c)) return 0;
  return is_in(kWide, c) ? 2 : 1;
}

}  // namespace

std::size_t display_width(std::string_view text) noexcept {
  std::size_t width = 0;
  while (!text.empty()) {
    const auto point = first_code_point(text);
    width += width_of(point.value);
    text.remove_prefix(point.size);
  }
  return width;
}

std::string_view leading_columns(std::string_view text, std::size_t columns) noexcept {
  std::size_t size = 0;
  std::size_t width = 0;
  while (size < text.size()) {
    const auto point = first_code_point(text.substr(size));
    width += width_of(point.value);
    if (width > columns) {
      break;
    }
    size += point.size;
  }
  return text.substr(0, size);
}

std::vector<std::string> wrap(std::string_view text, std::size_t columns) {
  std::vector<std::string> lines;
  std::string line;
  while (!text.empty()) {
    auto end = std::min(text.find(' '), text.size());
    auto word = text.substr(0, end);
    if (display_width(word) > columns) {  // too long for any line: broken where it ends
      const auto room =
          line.empty() ? columns : columns - std::min(columns, display_width(line) + 1);
      word = leading_columns(word, room > 0 ? room : columns);
      if (word.empty()) word = text.substr(0, first_code_point(text).size);  // wider than the line
      end = word.size();
    }
    if (!line.empty() && display_width(line) + 1 + display_width(word) > columns) {
      lines.push_back(std::move(line));
      line.clear();
    }
    if (!word.empty()) {
      line += line.empty() ? "" : " ";
      line += word;
    }
    text.remove_prefix(end);
    if (text.starts_with(' ')) text.remove_prefix(1);
  }
  if (!line.empty()) {
    lines.push_back(std::move(line));
  }
  return lines;
}

std::size_t terminal_columns(int descriptor) noexcept {
  winsize size{};
  constexpr std::size_t kUsual = 80;
  return ::ioctl(descriptor, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : kUsual;
}

std::string filled(std::string_view text, std::size_t columns, std::size_t indent) {
  const auto first = std::min(text.find_first_not_of(' '), text.size());
  const std::string blanks(first + indent, ' ');
  std::string result;
  std::string line;
  bool is_empty = true;
  for (std::size_t at = 0; at < text.size();) {
    const auto begin = std::min(text.find_first_not_of(' ', at), text.size());
    const auto end = std::min(text.find(' ', begin), text.size());
    const auto word = text.substr(begin, end - begin);
    if (!is_empty && display_width(line) + begin - at + display_width(word) > columns) {
      result += line + '\n';
      line = blanks;
    } else {
      line += text.substr(at, begin - at);
    }
    line += word;
    is_empty = false;
    at = end;
  }
  return result + line + '\n';
}

}  // namespace cie
