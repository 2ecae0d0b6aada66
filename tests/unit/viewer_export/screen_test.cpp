#include "text/screen.hpp"

#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

using testing::ElementsAre;

// Two blanks before the name, and before each number: 2 + 4, and 2 + 6 for each extra column.
TextTable table_with(const std::vector<std::string>& extras) {
  std::vector<TextTable::Column> columns{{"", "name", TextTable::Align::left}};
  std::vector<TextCell> row{{"scan"}};
  for (const auto& extra : extras) {
    columns.push_back({"", extra});
    row.push_back({"1"});
  }
  TextTable table(std::move(columns));
  table.add(std::move(row));
  return table;
}

std::vector<std::string> extras_in(std::size_t columns) {
  std::vector<std::string> extras{"first.", "second"};
  const TextStyle style{.columns = columns};
  const auto table = with_room_for(
      extras, [&extras] { return table_with(extras); }, style);
  EXPECT_EQ(table.natural_width(), 6 + 8 * extras.size());
  return extras;
}

TEST(Screen, HasTheMostUsefulColumnsThatThereIsRoomFor) {
  EXPECT_THAT(extras_in(22), ElementsAre("first.", "second"));
  EXPECT_THAT(extras_in(21), ElementsAre("first."));
  EXPECT_THAT(extras_in(14), ElementsAre("first."));
  EXPECT_THAT(extras_in(13), ElementsAre());
  EXPECT_THAT(extras_in(5), ElementsAre()) << "a table has its other columns in any case";
}

TEST(Screen, HasATableBelowABlankLine) {
  EXPECT_THAT(table_lines(table_with({"first."}), {.columns = 80}),
              ElementsAre("", "  name  first.", "  scan       1"));
}

}  // namespace
}  // namespace cie::viewer_export
