#include "words/text_layout.hpp"

#include <cstdint>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

TEST(Printable, MakesControlCharactersVisible) {
  EXPECT_EQ(printable("\x1b[31mred\x07"), "\\x1b[31mred\\x07");
  EXPECT_EQ(printable("a\nb\tc\x7f"), "a\\x0ab\\x09c\\x7f");
  EXPECT_EQ(printable("\xC2\x9B"
                      "2J"),
            "\\x9b2J")
      << "C1 control sequence introducer";
  EXPECT_EQ(printable("\xE2\x80\xAE"), "\\u{202e}") << "right-to-left override";
  EXPECT_EQ(printable("\xEF\xBF\xBE\xEF\xBF\xBF"), "\\u{fffe}\\u{ffff}") << "not of XML 1.0";
  EXPECT_EQ(printable("caf\xC3\xA9"), "caf\xC3\xA9");
  EXPECT_EQ(printable("\xFF"), "\xEF\xBF\xBD");
}

TEST(DisplayWidth, CountsColumnsNotBytes) {
  EXPECT_EQ(display_width("caf\xC3\xA9"), 4U);
  EXPECT_EQ(display_width("e\xCC\x81"), 1U) << "combining accent";
  EXPECT_EQ(display_width("\xE6\xBC\xA2"), 2U) << "wide character";
}

TEST(Elide, KeepsBothEnds) {
  EXPECT_EQ(elide("abcdefghij", 10), "abcdefghij");
  EXPECT_EQ(elide("abcdefghijK", 10), "abcd...ijK");
  EXPECT_EQ(elide("abcdefghij", 3), "...");
  EXPECT_EQ(display_width(elide(std::string(1'000'000, 'x'), 40)), 40U);
}

TEST(Elide, LeavesNoPartOfANumber) {
  EXPECT_EQ(elide("fusion timer 200 ms", 16), "fusion... 200 ms") << "taken from the begin";
  EXPECT_EQ(elide("thread 174885 of the pool", 16), "thread ...e pool") << "left out";
  EXPECT_EQ(elide("merger_702679647407438086 <- /tf", 20), "merger_... <- /tf");
  EXPECT_EQ(elide("123456", 5), "...");
  EXPECT_EQ(elide("12.345 ms", 8), "...ms");
}

TEST(Cut, LeavesNoPartOfANumberAndNoneWithoutItsUnit) {
  EXPECT_EQ(cut("3 threads: 6 on 17487", 30, "..."), "3 threads: 6 on 17487");
  EXPECT_EQ(cut("3 threads: 6 on 17487", 20, "..."), "3 threads: 6 on ...");
  EXPECT_EQ(cut("late 3 of 8, up to 12.5 ms", 25, "..."), "late 3 of 8, up to ...");
  EXPECT_EQ(cut("late 3 of 8, up to 12.5 ms, or so", 28, "..."), "late 3 of 8, up to ...");
  EXPECT_EQ(cut("4 of 9 callbacks", 9, "..."), "4 of ...") << "9... may be 90";
  EXPECT_EQ(cut("4 of 9 callbacks", 12, "..."), "4 of 9 ca...");
}

TEST(Filled, IndentsWhatFollowsAndKeepsWordsWhole) {
  EXPECT_EQ(filled("one two three", 13), "one two three\n");
  EXPECT_EQ(filled("one two three", 8), "one two\nthree\n");
  EXPECT_EQ(filled("  one  two three", 11, 2), "  one  two\n    three\n")
      << "blanks within are kept";
  EXPECT_EQ(filled("at /a/long/path here", 8, 1), "at\n /a/long/path\n here\n");
  EXPECT_EQ(filled("", 8), "\n");
}

TEST(Wrap, BreaksBetweenWords) {
  EXPECT_EQ(wrap("one two three", 8), (std::vector<std::string>{"one two", "three"}));
  EXPECT_EQ(wrap("unbreakable", 4), (std::vector<std::string>{"unbr", "eaka", "ble"}));
  EXPECT_EQ(wrap("a toolongword b", 5), (std::vector<std::string>{"a too", "longw", "ord b"}));
  EXPECT_TRUE(wrap("", 10).empty());
}

TEST(FormatDuration, HasFourDigitsAndAUnit) {
  EXPECT_EQ(format_duration(0), "0 ns");
  EXPECT_EQ(format_excess(289'415, 100'000), "289.4 us > 100.0 us");
  EXPECT_EQ(format_excess(1'000'001, 1'000'000), "1.000 ms > 1.000 ms by 1 ns");
  EXPECT_EQ(format_duration(999), "999 ns");
  EXPECT_EQ(format_duration(-999), "-999 ns");
  EXPECT_EQ(format_duration(1'000), "1.000 us");
  EXPECT_EQ(format_duration(12'345), "12.35 us");
  EXPECT_EQ(format_duration(123'456), "123.5 us");
  EXPECT_EQ(format_duration(999'949), "999.9 us");
  EXPECT_EQ(format_duration(999'951), "1.000 ms") << "never \"1000.0 us\"";
  EXPECT_EQ(format_duration(9'999'600), "10.00 ms");
  EXPECT_EQ(format_duration(-1'234'567), "-1.235 ms");
  EXPECT_EQ(format_duration(3'600'000'000'000), "3600 s");
  EXPECT_EQ(format_duration(std::numeric_limits<std::int64_t>::min()), "-9223372037 s");
}

TEST(ShortDuration, HasNoMoreDigitsThanItNeeds) {
  EXPECT_EQ(short_duration(0), "0 ns");
  EXPECT_EQ(short_duration(999), "999 ns");
  EXPECT_EQ(short_duration(100'000'000), "100 ms");
  EXPECT_EQ(short_duration(33'333'333), "33.33 ms");
  EXPECT_EQ(short_duration(9'998'000'000'000), "9998 s");
}

TEST(FormatCpus, JoinsRanges) {
  EXPECT_EQ(format_cpus({0, 1, 2, 5, 7, 8}), "0-2,5,7-8");
  EXPECT_EQ(format_cpus({}), "");
}

TEST(Table, AlignsAndGivesLongNamesTheirOwnLine) {
  TextTable table({{"", "name", TextTable::Align::left}, {"long", "title"}});
  table.add({{"a"}, {"1"}});
  table.add({{"a name that is far too long for it"}, {"22222"}});
  EXPECT_EQ(table.render({.colour = false, .columns = 20}),
            "                long\n"
            "  name         title\n"
            "  a                1\n"
            "  a name t... for it\n"
            "               22222\n");
}

TEST(Table, LeavesOutColumnsWhereNumbersHaveNoRoom) {
  using enum TextTable::Align;
  TextTable table({{"", "name", left}, {"time", "p50", right, 1, true}, {"", "max"}, {"", "late"}});
  table.add({{"a"}, {"123.4us"}, {"567.8ms"}, {"9"}});
  const auto render = [&table](std::size_t columns) {
    return table.render({.colour = false, .columns = columns});
  };
  EXPECT_EQ(render(32),
            "              time\n"
            "  name      p50      max  late\n"
            "  a     123.4us  567.8ms     9\n");
  EXPECT_EQ(render(25),
            "           time\n"
            "  name      max  late\n"
            "  a     567.8ms     9\n");
  EXPECT_EQ(render(18),
            "           time\n"
            "  name      max\n"
            "  a     567.8ms\n");
}

// Of 16 columns in all, "response time" leaves three.
TEST(Table, TitleAboveSeveralColumnsReadsAsOne) {
  using enum TextTable::Align;
  TextTable table(
      {{"", "name", left}, {"response time", "p50", right, 0, true}, {"", "max"}, {"", "late"}});
  table.add({{"a"}, {"123.4us"}, {"567.8ms"}, {"9"}});
  EXPECT_EQ(table.render({.colour = false, .columns = 32}),
            "          response time\n"
            "  name      p50      max  late\n"
            "  a     123.4us  567.8ms     9\n");
  TextTable narrow({{"", "name", left}, {"since start", "late", right, 0, true}, {"", "missed"}});
  narrow.add({{"a"}, {"1"}, {"2"}});
  EXPECT_EQ(narrow.render({.colour = false, .columns = 32}),
            "         since start\n"
            "  name  late  missed\n"
            "  a        1       2\n");
}

TEST(Table, TitleOfAColumnLeftOutStandsAboveNoOther) {
  using enum TextTable::Align;
  TextTable table({{"", "name", left},
                   {"time", "p50", right, 0, true},
                   {"", "max"},
                   {"exec.", "time max"},
                   {"", "missed"}});
  table.add({{"a"}, not_measured(), {"2 ms"}, not_measured(), {"0"}});
  table.drop_columns_of(kNotMeasured);
  EXPECT_EQ(table.render({.colour = false, .columns = 40}),
            "        time\n"
            "  name   max  missed\n"
            "  a     2 ms       0\n");
}

TEST(Table, ColoursOnlyWhenAsked) {
  TextTable table(std::vector<TextTable::Column>{{"x", ""}});
  table.add({{"NO", Look::bad}});
  EXPECT_EQ(table.render({.colour = false, .columns = 20}).find('\x1b'), std::string::npos);
  EXPECT_NE(table.render({.colour = true, .columns = 20}).find("\x1b[1;31mNO\x1b[0m"),
            std::string::npos);
}

}  // namespace
}  // namespace cie::viewer_export
