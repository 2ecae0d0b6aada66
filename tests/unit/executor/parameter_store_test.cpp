// What may be declared and set, who is asked and who is told.
#include "parameters/parameter_store.hpp"

#include <atomic>
#include <chrono>
#include <cstdint>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::executor {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

ParameterText text(const std::string& of) { return parameter_text(of); }

class Parameters : public testing::Test {
 protected:
  std::string refused(const std::string& name, ParameterValue value) {
    const auto result = store.set({{name, std::move(value)}});
    EXPECT_FALSE(result.is_successful);
    return result.reason;
  }
  void expect_set(const std::string& name, ParameterValue value) {
    const auto result = store.set({{name, value}});
    EXPECT_TRUE(result.is_successful) << result.reason;
    EXPECT_EQ(store.get(name), value);
  }
  ParameterStore store{"/node", {{"given", text("7")}, {"raet", text("1")}}};
};

TEST_F(Parameters, HaveTheirDeclaredValueUnlessAnotherIsGiven) {
  EXPECT_EQ(store.declare("rate", 10, {}), ParameterValue{std::int64_t{10}});
  EXPECT_EQ(store.declare("given", 10, {}), ParameterValue{std::int64_t{7}});
  EXPECT_EQ(store.get("given"), ParameterValue{std::int64_t{7}});
  EXPECT_THAT(store.unused_overrides(), ElementsAre("raet"));
}

TEST_F(Parameters, KnowEveryType) {
  const std::vector<ParameterValue> values{true,
                                           5,
                                           2.5,
                                           "text",
                                           std::vector<std::uint8_t>{1},
                                           std::vector<bool>{true},
                                           std::vector<std::int64_t>{1},
                                           std::vector<double>{1},
                                           std::vector<std::string>{"a"}};
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::string name = "p" + std::to_string(i);
    store.declare(name, values[i], {});
    EXPECT_EQ(kind_of(store.get(name)), static_cast<ParameterKind>(i + 1));
  }
}

TEST_F(Parameters, HaveNoTextsThatNoMessageCouldHold) {
  const std::string cut{"front\0rear", 10};
  store.declare("frame", "front", {});
  EXPECT_THAT(refused("frame", cut), HasSubstr("\"frame\": a text has a zero inside"));
  store.declare("frames", std::vector<std::string>{"front"}, {});
  EXPECT_THAT(refused("frames", std::vector<std::string>{"front", cut}), HasSubstr("zero inside"));
  EXPECT_THROW(store.declare("other", cut, {}), ParameterError);
  EXPECT_THROW(store.declare(cut, 1, {}), ParameterError);
  EXPECT_THROW(store.declare("other", 1, {.description = cut}), ParameterError);
}

TEST_F(Parameters, AreDeclaredOnceAndBeforeUse) {
  store.declare("rate", 10, {});
  EXPECT_THAT(
      [&] { store.declare("rate", 10, {}); },
      ThrowsMessage<ParameterError>(HasSubstr("\"rate\" of node \"/node\" is declared already")));
  EXPECT_THAT([&] { store.get("raet"); }, ThrowsMessage<ParameterError>(HasSubstr("not declared")));
  EXPECT_THAT(refused("raet", 1), HasSubstr("\"raet\": not declared"));
  EXPECT_THROW(store.declare("", 1, {}), ParameterError);
  EXPECT_THROW(store.declare("typeless", {}, {}), ParameterError);
  store.undeclare("rate");
  EXPECT_FALSE(store.has("rate"));
  store.declare("rate", "again", {});
}

TEST_F(Parameters, KeepTheirTypeUnlessTheyAreDynamicallyTyped) {
  store.declare("rate", 10, {});
  EXPECT_THAT(refused("rate", 10.0), HasSubstr("its type is integer, not double"));
  EXPECT_THAT(refused("rate", {}), HasSubstr("not nothing"));
  store.declare("any", {}, {.is_dynamically_typed = true});
  expect_set("any", 1);
  expect_set("any", "one");
  expect_set("any", {});
}

TEST_F(Parameters, KeepTheirValueIfReadOnly) {
  store.declare("given", 1, {.is_read_only = true});
  EXPECT_THAT(refused("given", 8), HasSubstr("read-only"));
  EXPECT_EQ(store.get("given"), ParameterValue{std::int64_t{7}});
  EXPECT_THROW(store.undeclare("given"), ParameterError);
}

TEST_F(Parameters, KeepIntegersInTheirRangeAndOnItsSteps) {
  store.declare("n", 0, {.integer_range = IntegerRange{.from = -10, .to = 9, .step = 5}});
  for (const std::int64_t value : {-10, -5, 5, 9})  // the end belongs to it, on a step or not
    expect_set("n", value);
  for (const std::int64_t value : {-11, -9, 6, 10})
    EXPECT_THAT(refused("n", value), HasSubstr("not in the range -10 to 9 in steps of 5"));
  constexpr auto kLeast = std::numeric_limits<std::int64_t>::min();
  constexpr auto kMost = std::numeric_limits<std::int64_t>::max();
  store.declare("wide", 2, {.integer_range = IntegerRange{kLeast, kMost, 2}});
  EXPECT_EQ(store.set({{"wide", 4}}).is_successful, true);   // an even distance from the least
  EXPECT_EQ(store.set({{"wide", 3}}).is_successful, false);  // and an odd one
}

TEST_F(Parameters, KeepNumbersInTheirRangeAndOnItsSteps) {
  store.declare("x", 0.3,
                {.floating_point_range = FloatingPointRange{.from = 0, .to = 0.95, .step = 0.1}});
  for (const double value : {0.0, 0.1, 0.7, 0.95})
    expect_set("x", value);
  for (const double value : {-0.1, 0.15, 1.0, std::numeric_limits<double>::quiet_NaN()})
    refused("x", value);
  EXPECT_THAT(
      [&] { store.declare("given", 1, {.integer_range = IntegerRange{.from = 0, .to = 5}}); },
      ThrowsMessage<ParameterError>(HasSubstr("7 is not in the range 0 to 5")));
}

TEST_F(Parameters, AreSetIfEverybodyAskedAgrees) {
  store.declare("a", 1, {});
  store.declare("b", 1, {});
  std::vector<std::string> asked;
  const auto first = store.add_on_set([&](const std::vector<Parameter>& parameters) {
    for (const auto& parameter : parameters)
      asked.push_back(parameter.name);
    // What is asked about is not set yet.
    EXPECT_EQ(store.get("a"), ParameterValue{std::int64_t{1}});
    return SetParametersResult{};
  });
  auto second = store.add_on_set([](const std::vector<Parameter>& parameters) {
    const bool is_good = parameters.back().value != ParameterValue{std::int64_t{13}};
    return SetParametersResult{.is_successful = is_good, .reason = is_good ? "" : "unlucky"};
  });
  EXPECT_EQ(store.set({{"a", 2}, {"b", 13}}).reason, "unlucky");
  EXPECT_EQ(store.get("a"), ParameterValue{std::int64_t{1}});  // all or none
  EXPECT_THAT(asked, ElementsAre("a", "b"));
  second.reset();
  EXPECT_TRUE(store.set({{"a", 2}, {"b", 13}}).is_successful);
  EXPECT_EQ(store.get("a"), ParameterValue{std::int64_t{2}});
}

TEST_F(Parameters, TellAfterTheyWereSet) {
  store.declare("a", 1, {});
  store.declare("double_a", 2, {});
  std::vector<ParameterValue> told;
  const auto handle = store.add_post_set([&](const std::vector<Parameter>& parameters) {
    if (parameters.front().name != "a") return;
    told.push_back(store.get("a"));
    store.set({{"double_a", 2 * std::get<std::int64_t>(store.get("a"))}});  // it may set others
  });
  refused("a", "text");
  EXPECT_THAT(told, IsEmpty());
  expect_set("a", 21);
  EXPECT_THAT(told, ElementsAre(ParameterValue{std::int64_t{21}}));
  EXPECT_EQ(store.get("double_a"), ParameterValue{std::int64_t{42}});
}

TEST_F(Parameters, AreNotSetByWhoIsAsked) {
  store.declare("a", 1, {});
  store.declare("b", 1, {});
  const auto handle = store.add_on_set([&](const std::vector<Parameter>&) {
    store.set({{"b", 2}});
    return SetParametersResult{};
  });
  EXPECT_THROW(store.set({{"a", 2}}), std::logic_error);
  EXPECT_EQ(store.get("a"), ParameterValue{std::int64_t{1}});
  EXPECT_EQ(store.get("b"), ParameterValue{std::int64_t{1}});
}

TEST_F(Parameters, AskNobodyWhoseHandleHasGone) {
  store.declare("a", 1, {});
  std::atomic<bool> is_asked{false};
  std::atomic<bool> has_answered{false};
  auto handle = store.add_on_set([&](const std::vector<Parameter>&) {
    is_asked = true;
    std::this_thread::sleep_for(std::chrono::milliseconds{5});
    has_answered = true;
    return SetParametersResult{};
  });
  std::thread setter{[&] { store.set({{"a", 2}}); }};
  while (!is_asked)
    std::this_thread::yield();
  handle.reset();
  EXPECT_TRUE(has_answered);  // it was waited for
  setter.join();
  is_asked = false;
  expect_set("a", 3);
  EXPECT_FALSE(is_asked);
}

TEST_F(Parameters, MayDropTheirHandleWhenAsked) {
  store.declare("a", 1, {});
  int asked = 0;
  std::shared_ptr<void> handle;
  handle = store.add_on_set([&](const std::vector<Parameter>&) {
    ++asked;
    handle.reset();
    return SetParametersResult{};
  });
  expect_set("a", 2);
  expect_set("a", 3);
  EXPECT_EQ(asked, 1);
}

TEST_F(Parameters, TellEveryChangeOnceAndNoneThatWasRefused) {
  std::vector<std::string> changes;
  ParameterStore told{
      "/node", {}, [&](ParameterStore::Change change, const std::vector<Parameter>& all) {
        changes.push_back("dsu"[static_cast<int>(change)] + all.front().name);
      }};
  told.declare("a", 1, {});
  EXPECT_TRUE(told.set({{"a", 2}}).is_successful);
  EXPECT_FALSE(told.set({{"a", "x"}}).is_successful);
  told.undeclare("a");
  EXPECT_THAT(changes, ElementsAre("da", "sa", "ua"));
}

TEST_F(Parameters, AreListedByPrefixAndDepth) {
  for (const char* const name : {"a", "lidar.rate", "lidar.front.x", "lidars", "lidar"})
    store.declare(name, 1, {});
  EXPECT_THAT(store.list(), ElementsAre("a", "lidar", "lidar.front.x", "lidar.rate", "lidars"));
  EXPECT_THAT(store.list({}, 1), ElementsAre("a", "lidar", "lidars"));
  EXPECT_THAT(store.list({"lidar"}), ElementsAre("lidar", "lidar.front.x", "lidar.rate"));
  EXPECT_THAT(store.list({"lidar"}, 1), ElementsAre("lidar", "lidar.rate"));
  EXPECT_THAT(store.list({"nothing"}), IsEmpty());
}

}  // namespace
}  // namespace cie::executor
