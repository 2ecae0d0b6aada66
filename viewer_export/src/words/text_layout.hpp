// Plain-text building blocks: aligned columns, numbers with units.
#pragma once

#include <cie/analysis/report.hpp>
#include <cie/tracepoints/text_columns.hpp>
#include <cie/tracepoints/utf8.hpp>
#include <cie/viewer_export/text_style.hpp>

#include "base/text.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace cie::viewer_export {

using cie::display_width;
using cie::filled;
using cie::wrap;

// At most `columns` wide: the middle of a longer text becomes `gap`. No digit stands beside it: a number
// is shown whole, or not at all.
std::string elide(std::string_view text, std::size_t columns, std::string_view gap = "...");

// The same with `gap` in place of the end; a word with a digit is left out whole, and a number without its
// unit.
std::string cut(std::string_view text, std::size_t columns, std::string_view gap);

// What stands for what is left out.
std::string_view gap(const TextStyle& style);

// As many of the names as have room, at least one of them, and how many more there are: "a, b, ... 3 more".
std::string first_of(const std::vector<std::string>& names, std::size_t columns,
                     const TextStyle& style);

// "1.235 ms": four digits and a unit that fits, at most nine columns below 10 000 s.
std::string format_duration(std::int64_t ns);

// "115.2 us > 100.0 us"; where both read the same, by how much: "1.000 ms > 1.000 ms by 1 ns".
std::string format_excess(std::int64_t ns, std::int64_t limit_ns);

// " (1 ns less)" of two that read the same though they differ; else empty.
std::string difference_unseen(std::int64_t ns, std::int64_t other_ns);

// "115.2us": a column has one unit less to say than a sentence.
std::string compact_duration(std::int64_t ns);

// "100 ms", "33.33 ms": of a span that is round, as periods are; no more of four digits than it has.
std::string short_duration(std::int64_t ns);

// "-400.0 us to +600.0 us"; "?" stands for a bound that there is not.
std::string format_clock_error(const analysis::ClockError& error);

// "0-3,5".
std::string format_cpus(const std::vector<std::uint32_t>& cpus);

enum class Look : std::uint8_t { plain, strong, good, bad, doubtful, faint };

// `text` in the colour of `look` when the style has colours, else unchanged.
std::string paint(std::string_view text, Look look, const TextStyle& style);

struct TextCell {
  std::string text;
  Look look = Look::plain;
};

// Of a cell that has no value.
inline constexpr std::string_view kNotMeasured = "-";
inline TextCell not_measured() { return {std::string(kNotMeasured), Look::faint}; }

// Columns aligned over all rows; numbers to the right, the first column (names) to the left. A name
// too wide for what the other columns leave stands on a line of its own, if rows may take two; text in a last column that
// is aligned to the left is cut to what is left. Where there is no room for all numbers, columns of
// numbers are left out.
class TextTable {
 public:
  enum class Align : std::uint8_t { left, right };
  struct Column {
    std::string title;
    std::string subtitle;
    Align align = Align::right;
    unsigned rank = 0;  // columns of a higher one are left out first, all of them at once
    bool is_title_shared = false;  // it stands above the next column, too
  };

  explicit TextTable(std::vector<Column> columns) : columns_(std::move(columns)) {}
  // As many cells as columns.
  void add(std::vector<TextCell> row) { rows_.push_back(std::move(row)); }
  bool is_empty() const noexcept { return rows_.empty(); }
  // Columns in which every cell is that text go; the first one stays.
  void drop_columns_of(std::string_view text);
  // Names that are too wide lose their middle.
  void keep_rows_on_one_line() noexcept { is_row_a_line_ = true; }
  // Of its widest line, if nothing is cut.
  std::size_t natural_width() const;
  std::string render(const TextStyle& style) const;

 private:
  // Behind the last column that the column's title stands above.
  std::size_t end_of_title(std::size_t index) const;
  std::vector<std::size_t> natural_widths() const;
  std::vector<std::size_t> widths(std::size_t columns) const;
  void drop_column(std::size_t index);
  // Leaves out columns of numbers until the others are whole in so many.
  void drop_columns_beyond(std::size_t columns);
  std::string titles(const std::vector<std::size_t>& width, const TextStyle& style) const;
  std::string render_all(const TextStyle& style) const;

  bool is_row_a_line_ = false;
  std::vector<Column> columns_;
  std::vector<std::vector<TextCell>> rows_;
};

}  // namespace cie::viewer_export
