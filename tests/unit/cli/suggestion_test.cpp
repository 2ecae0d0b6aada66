#include "command_line.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace cie::cli {
namespace {

TEST(CheckChoice, NamesWhatThereIs) {
  const auto message = [](const std::string& value) {
    try {
      check_choice("--format", value, {"text", "json"});
    } catch (const UsageError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(message("json"), "");
  EXPECT_EQ(message("jsno"),
            "--format does not know \"jsno\"; did you mean \"json\"? available: text, json");
  EXPECT_EQ(message("yaml-1"), "--format does not know \"yaml-1\"; available: text, json");
}

}  // namespace
}  // namespace cie::cli
