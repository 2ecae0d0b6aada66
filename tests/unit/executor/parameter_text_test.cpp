// Values of parameters as files and command lines write them.
#include <cie/executor/parameters.hpp>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

ParameterValue parse(std::string_view text, ParameterKind kind = ParameterKind::not_set) {
  return parse_parameter("p", parameter_text(text), kind);
}

TEST(ParameterText, IsOfTheFirstKindThatFits) {
  EXPECT_EQ(parse("true"), ParameterValue{true});
  EXPECT_EQ(parse("-10"), ParameterValue{std::int64_t{-10}});
  EXPECT_EQ(parse("1e3"), ParameterValue{1000.0});
  EXPECT_EQ(parse("front"), ParameterValue{std::string{"front"}});
  EXPECT_EQ(parse("[1, 2]"), (ParameterValue{std::vector<std::int64_t>{1, 2}}));
  EXPECT_EQ(parse("[1, 2.5]"), (ParameterValue{std::vector<double>{1, 2.5}}));
  EXPECT_EQ(parse("[true,false]"), (ParameterValue{std::vector<bool>{true, false}}));
  EXPECT_EQ(parse("[a, 1]"), (ParameterValue{std::vector<std::string>{"a", "1"}}));
  EXPECT_EQ(parse("[]"), ParameterValue{std::vector<std::string>{}});
}

TEST(ParameterText, IsOfTheKindAskedForOrRefused) {
  EXPECT_EQ(parse("10", ParameterKind::string), ParameterValue{std::string{"10"}});
  EXPECT_EQ(parse("10", ParameterKind::double_), ParameterValue{10.0});
  EXPECT_EQ(parse("[0, 255]", ParameterKind::byte_array),
            (ParameterValue{std::vector<std::uint8_t>{0, 255}}));
  const auto refused = [](std::string_view text, ParameterKind kind, const char* reason) {
    EXPECT_THAT([&] { parse(text, kind); },
                ThrowsMessage<std::invalid_argument>(HasSubstr(reason)));
  };
  refused("1.5", ParameterKind::integer, "parameter \"p\" is \"1.5\"; write a whole number");
  refused("9223372036854775808", ParameterKind::integer, "of 64 bits");
  refused("yes", ParameterKind::bool_, "true or false");
  refused("[256]", ParameterKind::byte_array, "0 to 255");
  refused("1", ParameterKind::integer_array, "a list");
  refused("[1]", ParameterKind::integer, "a single value");
}

TEST(ParameterText, ComesBackAsItWas) {
  for (const char* const text : {"true", "-10", "2.5", "3.0", "1e+300", "front", "[1, 2]",
                                 "[1.5, 2.0]", "[a, b c]", "[true, false]"}) {
    EXPECT_EQ(to_text(parse(text)), text);
  }
  EXPECT_EQ(to_text(ParameterValue{}), "");
}

}  // namespace
}  // namespace cie
