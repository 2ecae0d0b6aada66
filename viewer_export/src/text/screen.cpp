#include "screen.hpp"

#include "words/text_layout.hpp"

#include <algorithm>
#include <iterator>
#include <sstream>

namespace cie::viewer_export {
namespace {

// Ends of the arguments of a command line for a shell, the last one's included.
std::vector<std::size_t> argument_ends(std::string_view command) {
  std::vector<std::size_t> ends;
  bool is_quoted = false;
  for (std::size_t i = 0; i < command.size(); ++i) {
    if (command[i] == '\\' && !is_quoted) {
      ++i;
    } else if (command[i] == '\'') {
      is_quoted = !is_quoted;
    } else if (command[i] == ' ' && !is_quoted) {
      ends.push_back(i);
    }
  }
  ends.push_back(command.size());
  return ends;
}

// An argument that is wider than the screen stays whole.
Lines broken(std::string_view label, std::string_view command, const TextStyle& style) {
  constexpr std::string_view kGoOn = " \\";
  Lines lines;
  auto line = "  " + std::string(label) + ": ";
  bool is_empty = true;
  std::size_t begin = 0;
  const auto ends = argument_ends(command);
  for (const auto end : ends) {
    const auto argument = command.substr(begin, end - begin);
    const auto room = style.columns - (end == command.size() ? 0 : kGoOn.size());
    if (!is_empty && display_width(line) + 1 + display_width(argument) > room) {
      lines.push_back(line + std::string(kGoOn));
      line = "     ";
    }
    line += (is_empty ? "" : " ") + std::string(argument);
    is_empty = false;
    begin = std::min(end + 1, command.size());
  }
  lines.push_back(line);
  return lines;
}

}  // namespace

void append(Lines& lines, Lines more) { std::ranges::move(more, std::back_inserter(lines)); }

Lines paragraph(std::string_view begin, std::string_view text, std::size_t most,
                const TextStyle& style) {
  const auto indent = display_width(begin);
  // Names take three fifths of a line at most, whatever comes before the text (verify_screen.cpp).
  const auto width = style.columns - std::min(indent, style.columns * 3 / 5);
  auto parts = wrap(text, width);
  if (parts.size() > most) {
    parts[most - 1] = cut(parts[most - 1] + ' ' + parts[most], width, gap(style));
    parts.resize(most);
  }
  Lines lines;
  for (const auto& part : parts) {
    const auto blanks = std::string(indent, ' ');
    lines.push_back(
        cut((lines.empty() ? std::string(begin) : blanks) + part, style.columns, gap(style)));
  }
  return lines;
}

Lines table_lines(const TextTable& table, const TextStyle& style) {
  Lines lines{""};
  std::istringstream text(table.render(style));
  for (std::string line; std::getline(text, line);)
    lines.push_back(line);
  return lines;
}

Lines commands_to_paste(const std::vector<std::pair<std::string_view, std::string>>& commands,
                        const TextStyle& style) {
  Lines lines;
  bool is_room = false;  // behind the last line
  for (const auto& [label, command] : commands) {
    const auto text = std::string(label) + ": " + command;
    if (is_room && display_width(lines.back()) + 4 + display_width(text) <= style.columns) {
      lines.back() += "    " + text;
      continue;
    }
    is_room = display_width(text) + 2 <= style.columns;
    append(lines, is_room ? Lines{"  " + text} : broken(label, command, style));
  }
  return lines;
}

}  // namespace cie::viewer_export
