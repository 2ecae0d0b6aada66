#include <cie/tracepoints/utf8.hpp>

#include "tables/csv.hpp"
#include "tables/table.hpp"

#include <array>
#include <sstream>
#include <string_view>

#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

TEST(CsvField, QuotesOnlyWhatNeedsIt) {
  EXPECT_EQ(csv_field("/a/plan@Timer(20000000)"), "/a/plan@Timer(20000000)");
  EXPECT_EQ(csv_field("a,b"), "\"a,b\"");
  EXPECT_EQ(csv_field("say \"hi\""), "\"say \"\"hi\"\"\"");
  EXPECT_EQ(csv_field("two\nlines"), "\"two\nlines\"");
  EXPECT_EQ(csv_field(""), "");
}

TEST(CsvField, IsNoFormula) {
  EXPECT_EQ(csv_field("=HYPERLINK(\"x\")"), "\"'=HYPERLINK(\"\"x\"\")\"");
  EXPECT_EQ(csv_field("+1"), "'+1");
  EXPECT_EQ(csv_field("-1+cmd|' /C calc'!A0"), "'-1+cmd|' /C calc'!A0");
  EXPECT_EQ(csv_field("@SUM(A1)"), "'@SUM(A1)");
  EXPECT_EQ(csv_field("\t=1"), "'\t=1");
  EXPECT_EQ(csv_field("\r=1"), "\"'\r=1\"");
  EXPECT_EQ(csv_field("a=1"), "a=1");
  EXPECT_EQ(csv_field("/a -> /b"), "/a -> /b");
}

TEST(CsvTable, GuardsNamesAndLeavesNumbers) {
  constexpr std::array kColumns{Column{"name", ColumnType::text}, Column{"late_ns"}};
  std::ostringstream out;
  const auto table = make_csv_table(out, kColumns);
  table->row(std::array{Cell(std::string_view("=1+1")), Cell(std::int64_t{-5})});
  table->row(std::array{Cell(std::string_view("-5")), Cell(std::int64_t{7})});
  table->finish();
  EXPECT_EQ(out.str(), "name,late_ns\n'=1+1,-5\n'-5,7\n");
}

TEST(ValidUtf8, KeepsWhatIsValid) {
  EXPECT_EQ(valid_utf8("caf\xC3\xA9 \xE2\x82\xAC \xF0\x9F\x9A\x97"),
            "caf\xC3\xA9 \xE2\x82\xAC \xF0\x9F\x9A\x97");
}

TEST(ValidUtf8, ReplacesEachInvalidByte) {
  EXPECT_EQ(valid_utf8("a\xFFz"), "a\xEF\xBF\xBDz");
  EXPECT_EQ(valid_utf8("\xC3"), "\xEF\xBF\xBD") << "cut short";
  EXPECT_EQ(valid_utf8("\xC0\x80"), "\xEF\xBF\xBD\xEF\xBF\xBD") << "overlong";
  EXPECT_EQ(valid_utf8("\xED\xA0\x80"), "\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD") << "surrogate";
  EXPECT_EQ(valid_utf8("\xF4\x90\x80\x80").size(), 12U) << "beyond U+10FFFF";
}

}  // namespace
}  // namespace cie::viewer_export
