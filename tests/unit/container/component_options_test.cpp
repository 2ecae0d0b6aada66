#include <cie/executor/component.hpp>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;
using testing::ThrowsMessage;

class Options : public testing::Test {
 protected:
  ParameterText one(std::string text) { return {.texts = {std::move(text)}, .is_list = false}; }
  ParameterText list(std::vector<std::string> texts) {
    return {.texts = std::move(texts), .is_list = true};
  }
  Context context_{{.domain = 211, .loopback = true, .tag = "component-options"}};
};

TEST_F(Options, GiveParametersTheTypeAskedFor) {
  const ComponentOptions options{context_,
                                 "lidar",
                                 "/sensing",
                                 {{"on", one("true")},
                                  {"rate", one("-10")},
                                  {"scale", one("2.5")},
                                  {"frame", one("10")},
                                  {"ids", list({"1", "2"})},
                                  {"names", list({"a"})}}};
  EXPECT_EQ(options.name(), "lidar");
  EXPECT_EQ(options.name_space(), "/sensing");
  EXPECT_TRUE(options.parameter<bool>("on", false));
  EXPECT_EQ(options.parameter<std::int64_t>("rate", 1), -10);
  EXPECT_EQ(options.parameter<double>("scale", 1), 2.5);
  EXPECT_EQ(options.parameter<std::string>("frame", ""), "10");
  EXPECT_THAT(options.parameter<std::vector<std::int64_t>>("ids", {}), ElementsAre(1, 2));
  EXPECT_THAT(options.parameter<std::vector<std::string>>("names", {}), ElementsAre("a"));
  EXPECT_EQ(options.parameter<std::int64_t>("depth", 7), 7);
}

TEST_F(Options, GiveTheNodeItsParametersAndKnowWhichNobodyAskedFor) {
  const ComponentOptions options{context_, "a", "/", {{"rate", one("1")}, {"raet", one("1")}}};
  options.parameter<std::int64_t>("rate", 2);
  options.parameter<double>("scale", 0.5);
  EXPECT_THAT(options.read_parameters(), ElementsAre(Pair("rate", ParameterValue{std::int64_t{1}}),
                                                     Pair("scale", ParameterValue{0.5})));
  Node node{options};
  node.declare_parameter<std::int64_t>("rate", 3);
  EXPECT_EQ(node.get_parameter<std::int64_t>("rate"), 1);
  EXPECT_THAT(node.unused_parameter_overrides(), ElementsAre("raet"));
}

TEST_F(Options, RefuseTextOfAnotherType) {
  const ComponentOptions options{
      context_, "a", "/", {{"rate", one("1.5")}, {"on", one("yes")}, {"ids", list({"x"})}}};
  EXPECT_THAT([&] { options.parameter<std::int64_t>("rate", 1); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("parameter \"rate\" is \"1.5\"")));
  EXPECT_THAT([&] { options.parameter<bool>("on", false); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("write true or false")));
  EXPECT_THAT([&] { options.parameter<std::vector<std::int64_t>>("ids", {}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("\"x\"")));
  EXPECT_THAT([&] { options.parameter<std::string>("ids", ""); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("a single value")));
  EXPECT_THAT([&] { options.parameter<std::vector<double>>("rate", {}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("write a list")));
}

}  // namespace
}  // namespace cie
