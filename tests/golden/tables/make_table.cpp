// Writes a Parquet file of ROWS rows whose values follow from their number. Arguments: ROWS FILE.
#include "tables/table.hpp"

#include <array>
#include <fstream>
#include <string>

int main(int argc, char** argv) {
  using namespace cie::viewer_export;
  if (argc != 3) return 2;
  const std::int64_t rows = std::stoll(argv[1]);
  std::ofstream out(argv[2], std::ios::binary);
  constexpr std::array<Column, 5> kColumns{{{"integer", ColumnType::integer},
                                            {"real", ColumnType::real},
                                            {"boolean", ColumnType::boolean},
                                            {"text", ColumnType::text},
                                            {"nothing", ColumnType::integer}}};
  const auto table = make_parquet_table(out, kColumns);
  for (std::int64_t i = 0; i < rows; ++i) {
    const std::string text = "caf\xC3\xA9 \xFF " + std::to_string(i);
    table->row(std::array<Cell, 5>{i % 7 == 0 ? Cell() : Cell(-i * 1'000'000'007),
                                   i % 5 == 0 ? Cell() : Cell(static_cast<double>(i) / 2),
                                   i % 11 == 0 ? Cell() : Cell(i % 3 == 0),
                                   i % 13 == 0 ? Cell() : Cell(std::string_view(text)), Cell()});
  }
  table->finish();
  return out.flush() ? 0 : 1;
}
