#include "text_layout.hpp"

#include <cie/tracepoints/utf8.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <map>
#include <numeric>
#include <system_error>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

// Where the last code point before `end` begins, which is not 0.
std::size_t before(std::string_view text, std::size_t end) {
  const auto goes_on = [&text](std::size_t i) {
    return (static_cast<unsigned char>(text[i]) & 0xC0U) == 0x80U;
  };
  --end;
  while (end > 0 && goes_on(end))
    --end;
  return end;
}

// At most so many columns of the begin, which end in no digit: a part of a number would be another
// one.
std::string_view head_of(std::string_view text, std::size_t columns) {
  const auto head = leading_columns(text, columns);
  if (head.size() == text.size()) return head;
  return head.substr(0, head.find_last_not_of("0123456789.") + 1);  // npos + 1 is 0
}

// At most so many columns of the end, which begin with no digit: with what stands before the number
// where that takes at most `most`, else behind it.
std::string_view tail_of(std::string_view text, std::size_t columns, std::size_t most) {
  const auto is_of_number = [&](std::size_t i) {
    return i < text.size() && (is_digit(text[i]) || text[i] == '.');
  };
  const auto total = display_width(text);
  std::size_t begin = 0;
  for (std::size_t skipped = 0; total - skipped > columns && begin < text.size();) {
    const auto point = first_code_point(text.substr(begin));
    skipped += display_width(text.substr(begin, point.size));
    begin += point.size;
  }
  auto whole = begin;
  while (whole > 0 && is_of_number(whole))
    whole = before(text, whole);
  if (!is_of_number(whole) && display_width(text.substr(whole)) <= most) return text.substr(whole);
  while (is_of_number(begin))
    ++begin;
  return text.substr(begin);
}

// Of a time or a share: its number says nothing without it.
bool is_unit(std::string_view word) {
  constexpr std::array<std::string_view, 5> kUnits{"ns", "us", "ms", "s", "%"};
  word = word.substr(0, word.find_last_not_of(",;:.)") + 1);
  return std::ranges::find(kUnits, word) != kUnits.end();
}

std::string pad(std::string_view text, std::size_t width, TextTable::Align align) {
  const std::size_t own = display_width(text);
  const std::string blanks(width > own ? width - own : 0, ' ');
  return align == TextTable::Align::left ? std::string(text) + blanks : blanks + std::string(text);
}

constexpr std::size_t kIndent = 2;  // of tables

// Of the columns from `begin` up to `end`, with what stands between them.
std::size_t width_of(const std::vector<std::size_t>& widths, std::size_t begin, std::size_t end) {
  const auto at = [&widths](std::size_t i) {
    return widths.begin() + static_cast<std::ptrdiff_t>(i);
  };
  return std::accumulate(at(begin), at(end), 2 * (end - begin - 1));
}

std::string trimmed(std::string line) {
  line.erase(line.find_last_not_of(' ') + 1);
  return line + '\n';
}

}  // namespace

std::string elide(std::string_view text, std::size_t columns, std::string_view gap) {
  // Bytes bound the width from above, so a short text is not measured and a huge one only cut.
  if (text.size() <= columns || (text.size() <= 4 * columns && display_width(text) <= columns)) {
    return std::string(text);
  }
  const auto gap_width = display_width(gap);
  if (columns <= gap_width) {
    return std::string(leading_columns(gap, columns));
  }
  const auto room = columns - gap_width;
  const auto tail = tail_of(text, room / 2, room * 2 / 3);
  const auto head = head_of(text, room - display_width(tail));
  return std::string(head) + std::string(gap) + std::string(tail);
}

std::string cut(std::string_view text, std::size_t columns, std::string_view gap) {
  if (display_width(text) <= columns) return std::string(text);
  const auto room = columns - std::min(columns, display_width(gap));
  auto end = leading_columns(text, room).size();
  // The word in which it ends; a whole one where it ends behind it.
  const auto begin_of_word = [&text](std::size_t at) {
    return at == 0 ? 0 : text.rfind(' ', at - 1) + 1;  // npos + 1 is 0
  };
  const auto word = begin_of_word(end);
  const auto word_end = std::min(text.find(' ', end), text.size());
  const bool has_digit = std::ranges::any_of(text.substr(word, word_end - word), is_digit);
  if (has_digit && word > 0) end = word;
  // A number and its unit are shown together.
  const auto next = begin_of_word(end);
  const auto next_end = std::min(text.find(' ', next), text.size());
  const bool is_cut = end < next_end;
  if (is_cut && next > 1 && is_digit(text[next - 2]) && is_unit(text.substr(next, next_end - next)))
    end = begin_of_word(next - 1);
  const auto shown = head_of(text, display_width(text.substr(0, end)));
  return std::string(shown) + std::string(leading_columns(gap, columns));
}

std::string format_duration(std::int64_t ns) {
  struct Unit {
    double ns;
    std::string_view name;
  };
  constexpr std::array<Unit, 3> kUnits{{{1e3, "us"}, {1e6, "ms"}, {1e9, "s"}}};
  if (ns > -1000 && ns < 1000) {
    return fmt::format("{} ns", ns);
  }
  for (const auto& unit : kUnits) {
    const double value = static_cast<double>(ns) / unit.ns;
    const double size = std::abs(value);
    if (size < 999.95 || unit.ns == kUnits.back().ns) {
      const int decimals = size < 9.9995 ? 3 : size < 99.995 ? 2 : size < 999.95 ? 1 : 0;
      return fmt::format("{:.{}f} {}", value, decimals, unit.name);
    }
  }
  return {};
}

std::string format_excess(std::int64_t ns, std::int64_t limit_ns) {
  const auto value = format_duration(ns);
  const auto limit = format_duration(limit_ns);
  const auto difference = value == limit ? " by " + format_duration(ns - limit_ns) : std::string();
  return fmt::format("{} > {}{}", value, limit, difference);
}

std::string compact_duration(std::int64_t ns) {
  auto text = format_duration(ns);
  text.erase(text.find(' '), 1);
  return text;
}

std::string short_duration(std::int64_t ns) {
  struct Unit {
    double ns;
    std::string_view name;
  };
  constexpr std::array<Unit, 4> kUnits{{{1e9, "s"}, {1e6, "ms"}, {1e3, "us"}, {1, "ns"}}};
  const auto value = static_cast<double>(ns);
  const auto* const unit =
      std::ranges::find_if(kUnits, [value](const Unit& u) { return value >= u.ns || u.ns == 1; });
  return fmt::format("{:.4g} {}", value / unit->ns, unit->name);
}

std::string difference_unseen(std::int64_t ns, std::int64_t other_ns) {
  if (ns == other_ns || format_duration(ns) != format_duration(other_ns)) return {};
  return fmt::format(" ({} {})", format_duration(std::abs(ns - other_ns)),
                     ns < other_ns ? "less" : "more");
}

std::string format_clock_error(const analysis::ClockError& error) {
  const auto bound = [](const std::optional<analysis::Duration>& value) -> std::string {
    if (!value) return "?";
    return (value->ns > 0 ? "+" : "") + format_duration(value->ns);
  };
  return bound(error.least) + " to " + bound(error.most);
}

std::string format_cpus(const std::vector<std::uint32_t>& cpus) {
  std::string result;
  for (std::size_t i = 0; i < cpus.size();) {
    std::size_t last = i;
    while (last + 1 < cpus.size() && cpus[last + 1] == cpus[last] + 1) {
      ++last;
    }
    result += result.empty() ? "" : ",";
    result += last == i ? fmt::format("{}", cpus[i]) : fmt::format("{}-{}", cpus[i], cpus[last]);
    i = last + 1;
  }
  return result;
}

std::string paint(std::string_view text, Look look, const TextStyle& style) {
  constexpr std::array<std::string_view, 6> kCodes{"", "1", "32", "1;31", "33", "2"};
  const auto code = kCodes.at(static_cast<std::size_t>(look));
  if (!style.colour || code.empty()) {
    return std::string(text);
  }
  return fmt::format("\x1b[{}m{}\x1b[0m", code, text);
}

void TextTable::drop_columns_of(std::string_view text) {
  for (std::size_t i = columns_.size(); i-- > 1;) {
    if (!std::ranges::all_of(rows_, [&](const auto& row) { return row[i].text == text; })) continue;
    drop_column(i);
  }
}

// A title above several columns goes on to the next one.
void TextTable::drop_column(std::size_t index) {
  if (index + 1 < columns_.size()) {
    const auto& column = columns_[index];
    auto& next = columns_[index + 1];
    if (column.is_title_shared && next.title.empty()) next.title = column.title;
  }
  const auto place = static_cast<std::ptrdiff_t>(index);
  columns_.erase(columns_.begin() + place);
  for (auto& row : rows_)
    row.erase(row.begin() + place);
}

void TextTable::drop_columns_beyond(std::size_t columns) {
  constexpr std::size_t kFewest = 2;  // the name and one number
  const auto is_too_wide = [&] {
    const auto wanted = natural_widths();
    const auto shown = widths(columns);
    for (std::size_t i = 1; i < shown.size(); ++i) {
      if (columns_[i].align == Align::right && shown[i] < wanted[i]) return true;
    }
    return false;
  };
  while (columns_.size() > kFewest && is_too_wide()) {
    unsigned rank = 0;
    for (const auto& column : columns_)
      rank = std::max(rank, column.rank);
    bool is_any_dropped = false;
    for (auto i = columns_.size(); i-- > 1 && columns_.size() > kFewest;) {
      const bool is_last_of_equals = rank == 0 && is_any_dropped;
      if (columns_[i].align != Align::right || columns_[i].rank != rank || is_last_of_equals)
        continue;
      drop_column(i);
      is_any_dropped = true;
    }
    if (!is_any_dropped) return;
  }
}

std::size_t TextTable::end_of_title(std::size_t index) const {
  auto end = index + 1;
  while (end < columns_.size() && columns_[end - 1].is_title_shared && columns_[end].title.empty())
    ++end;
  return end;
}

std::vector<std::size_t> TextTable::natural_widths() const {
  std::vector<std::size_t> result;
  for (const auto& column : columns_)
    result.push_back(display_width(column.subtitle));
  for (const auto& row : rows_) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      result[i] = std::max(result[i], display_width(row[i].text));
    }
  }
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    const auto title = display_width(columns_[i].title);
    const auto end = end_of_title(i);
    const auto room = width_of(result, i, end);
    if (title > room) result[end - 1] += title - room;
  }
  return result;
}

std::size_t TextTable::natural_width() const {
  const auto widths = natural_widths();
  return std::accumulate(widths.begin(), widths.end(), kIndent + 2 * (widths.size() - 1));
}

std::vector<std::size_t> TextTable::widths(std::size_t columns) const {
  auto result = natural_widths();
  // The names get what is left, but never less than a fifth of the line; than the title, where names
  // may stand above their numbers.
  const std::size_t others =
      std::accumulate(result.begin() + 1, result.end(), kIndent + 2 * (result.size() - 1));
  const std::size_t left = columns > others ? columns - others : 0;
  const auto title =
      std::max(display_width(columns_.front().title), display_width(columns_.front().subtitle));
  const auto least = is_row_a_line_ ? columns / 5 : std::min(columns / 5, title);
  result.front() = std::min(result.front(), std::max(left, least));
  // Text at the end of the line gets what is left after that.
  if (columns_.size() > 1 && columns_.back().align == Align::left) {
    const std::size_t rest = others - result.back() + result.front();
    result.back() = std::min(result.back(), columns > rest + 8 ? columns - rest : 8);
  }
  // Numbers beyond all measure are cut: the line is not to break.
  const auto total = [&] {
    return std::accumulate(result.begin(), result.end(), kIndent + 2 * (result.size() - 1));
  };
  constexpr std::size_t kLeast = 5;
  for (auto widest = std::ranges::max_element(result); total() > columns && *widest > kLeast;
       widest = std::ranges::max_element(result))
    --*widest;
  return result;
}

// The upper titles: each in the middle of the columns that it stands above.
std::string TextTable::titles(const std::vector<std::size_t>& width, const TextStyle& style) const {
  std::string result = " ";
  for (std::size_t i = 0; i < columns_.size();) {
    const auto end = end_of_title(i);
    const auto room = width_of(width, i, end);
    auto text = cut(columns_[i].title, room, gap(style));
    if (end - i > 1) text += std::string((room - display_width(text)) / 2, ' ');
    result += i == 0 ? " " : "  ";
    result += paint(pad(text, room, columns_[i].align), Look::faint, style);
    i = end;
  }
  return trimmed(result);
}

std::string_view gap(const TextStyle& style) { return style.unicode ? "…" : "..."; }

std::string first_of(const std::vector<std::string>& names, std::size_t columns,
                     const TextStyle& style) {
  const auto more = [&](std::size_t shown) {
    const auto left = names.size() - shown;
    return left > 0 ? fmt::format(", {} {} more", gap(style), left) : std::string();
  };
  const auto rest = more(1);
  auto best = cut(names.front(), columns - std::min(columns, rest.size()), gap(style)) + rest;
  auto text = names.front();
  for (std::size_t shown = 2; shown <= names.size() && display_width(text) <= columns; ++shown) {
    text += ", " + names[shown - 1];
    auto whole = text + more(shown);
    if (display_width(whole) <= columns) best = std::move(whole);
  }
  return best;
}

std::string TextTable::render(const TextStyle& style) const {
  auto shown = *this;
  shown.drop_columns_beyond(style.columns);
  return shown.render_all(style);
}

std::string TextTable::render_all(const TextStyle& style) const {
  const auto width = widths(style.columns);
  const auto line = [&](const auto& text_of) {
    std::string result = " ";
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      result += i == 0 ? " " : "  ";
      result += text_of(i);
    }
    return trimmed(result);
  };
  std::string text;
  const bool has_two_lines = std::any_of(columns_.begin(), columns_.end(),
                                         [](const Column& c) { return !c.subtitle.empty(); });
  const bool has_upper =
      std::ranges::any_of(columns_, [](const auto& c) { return !c.title.empty(); });
  if (has_upper || !has_two_lines) text += titles(width, style);
  if (has_two_lines) {
    text += line([&](std::size_t i) {
      return paint(
          pad(cut(columns_[i].subtitle, width[i], gap(style)), width[i], columns_[i].align),
          Look::faint, style);
    });
  }
  for (const auto& row : rows_) {
    const bool is_split = !is_row_a_line_ && display_width(row.front().text) > width.front();
    if (is_split) {
      text +=
          "  " + paint(elide(row.front().text, style.columns - 2), row.front().look, style) + "\n";
    }
    text += line([&](std::size_t i) {
      const auto shown = i == 0 && is_split ? std::string_view{} : std::string_view(row[i].text);
      return paint(pad(elide(shown, width[i], gap(style)), width[i], columns_[i].align),
                   row[i].look, style);
    });
  }
  return text;
}

}  // namespace cie::viewer_export
