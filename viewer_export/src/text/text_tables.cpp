#include "json/json.hpp"
#include "tables/csv.hpp"
#include "tables/table.hpp"

#include <algorithm>
#include <iterator>
#include <string>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

// Text that stands for itself in CSV: most names.
bool is_plain(std::string_view text) {
  return std::ranges::all_of(
      text, [](char c) { return c >= ' ' && c <= '~' && c != '"' && c != ',' && c != '\\'; });
}

void append_number(std::string& out, const Cell& cell) {
  if (const auto* integer = std::get_if<std::int64_t>(&cell)) {
    const fmt::format_int digits(*integer);
    out.append(digits.data(), digits.size());
  } else if (const auto* natural = std::get_if<std::uint64_t>(&cell)) {
    const fmt::format_int digits(*natural);
    out.append(digits.data(), digits.size());
  } else if (const auto* real = std::get_if<double>(&cell)) {
    fmt::format_to(std::back_inserter(out), "{}", *real);
  } else if (const auto* boolean = std::get_if<bool>(&cell)) {
    out += *boolean ? "true" : "false";
  }
}

// Collects lines; the stream gets them in pieces.
class LineWriter {
 public:
  explicit LineWriter(std::ostream& out) : out_(out) {}
  std::string& text() noexcept { return text_; }
  void end_line() {
    constexpr std::size_t kMuch = 32768;
    text_ += '\n';
    if (text_.size() >= kMuch) flush();
  }
  void flush() {
    out_.write(text_.data(), static_cast<std::streamsize>(text_.size()));
    text_.clear();
  }

 private:
  std::ostream& out_;
  std::string text_;
};

class CsvTable final : public TableWriter {
 public:
  CsvTable(std::ostream& out, std::span<const Column> columns) : lines_(out) {
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (i > 0) lines_.text() += ',';
      lines_.text() += columns[i].name;
    }
    lines_.end_line();
  }

  void row(std::span<const Cell> cells) override {
    std::string& out = lines_.text();
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (i > 0) out += ',';
      if (const auto* text = std::get_if<std::string_view>(&cells[i])) {
        if (text->empty()) {
          out += "\"\"";  // known to be empty; nothing is unknown
        } else if (is_plain(*text) && !is_formula(*text)) {
          out += *text;
        } else {
          out += csv_field(*text);
        }
      } else {
        append_number(out, cells[i]);
      }
    }
    lines_.end_line();
  }

  void finish() override { lines_.flush(); }

 private:
  LineWriter lines_;
};

class JsonLinesTable final : public TableWriter {
 public:
  JsonLinesTable(std::ostream& out, std::span<const Column> columns) : lines_(out) {
    for (const Column& column : columns) {
      keys_.push_back((keys_.empty() ? '{' : ',') + json_string(column.name) + ':');
    }
  }

  void row(std::span<const Cell> cells) override {
    std::string& out = lines_.text();
    for (std::size_t i = 0; i < cells.size(); ++i) {
      out += keys_[i];
      if (const auto* text = std::get_if<std::string_view>(&cells[i])) {
        append_json_string(out, *text);
      } else if (std::holds_alternative<std::monostate>(cells[i])) {
        out += "null";
      } else {
        append_number(out, cells[i]);
      }
    }
    out += '}';
    lines_.end_line();
  }

  void finish() override { lines_.flush(); }

 private:
  LineWriter lines_;
  std::vector<std::string> keys_;  // with what stands before them
};

}  // namespace

std::unique_ptr<TableWriter> make_csv_table(std::ostream& out, std::span<const Column> columns) {
  return std::make_unique<CsvTable>(out, columns);
}

std::unique_ptr<TableWriter> make_json_lines_table(std::ostream& out,
                                                   std::span<const Column> columns) {
  return std::make_unique<JsonLinesTable>(out, columns);
}

std::unique_ptr<TableWriter> make_table(TableFormat format, std::ostream& out,
                                        std::span<const Column> columns) {
  switch (format) {
    case TableFormat::csv:
      return make_csv_table(out, columns);
    case TableFormat::json_lines:
      return make_json_lines_table(out, columns);
    case TableFormat::parquet:
      break;
  }
  return make_parquet_table(out, columns);
}

}  // namespace cie::viewer_export
