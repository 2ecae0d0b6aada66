#include "command_line.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace cie::cli {
namespace {

const std::vector<std::string> kOptions{"--format", "--output", "--spec", "--help", "-o"};

TEST(Nearest, FindsWhatWasMeant) {
  EXPECT_EQ(nearest("--fromat", kOptions), "--format") << "neighbours swapped";
  EXPECT_EQ(nearest("--formt", kOptions), "--format") << "a letter left out";
  EXPECT_EQ(nearest("--specs", kOptions), "--spec") << "a letter too many";
  EXPECT_EQ(nearest("--outfut", kOptions), "--output") << "a wrong letter";
}

TEST(Nearest, SaysNothingRatherThanNonsense) {
  EXPECT_EQ(nearest("--verbose", kOptions), "");
  EXPECT_EQ(nearest("-x", kOptions), "");
  EXPECT_EQ(nearest("", kOptions), "");
  EXPECT_EQ(nearest(std::string(1'000'000, 'x'), kOptions), "");
}

TEST(CheckChoice, TellsPlannedFromUnknown) {
  const auto message = [](const std::string& value) {
    try {
      check_choice("--format", value, {"text", "json"}, {"html"});
    } catch (const UsageError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(message("json"), "");
  EXPECT_EQ(message("html"),
            "--format html is not available in this version; available: text, json");
  EXPECT_EQ(message("jsno"),
            "--format does not know \"jsno\"; did you mean \"json\"? available: text, json");
  EXPECT_EQ(message("yaml-1"), "--format does not know \"yaml-1\"; available: text, json");
}

}  // namespace
}  // namespace cie::cli
