// Subjects of one name are told apart.
#include "reused_tid.hpp"
#include "support/verdicts.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using testing::ElementsAre;

std::vector<std::string> subjects_of(const Verified& verified, std::string_view rule) {
  std::vector<std::string> subjects;
  for (const auto& subject : verified.rule(rule).subjects)
    subjects.push_back(subject.name_told_apart());
  return subjects;
}

TEST(Verify, TellsThreadsOfOneTidApart) {
  EXPECT_THAT(subjects_of(Verified(of_reused_tid("")), "M2"),
              ElementsAre("thread 101", "thread 101 (lifetime 2)"));
  EXPECT_THAT(subjects_of(Verified(of_reused_tid("process app", R"(
    process other pid=7
    callback show timer
    11 start show release=9
    13 end show)")),
                          "M2"),
              ElementsAre(testing::EndsWith(" (pid 7)"), "thread 101 (pid 100)",
                          "thread 101 (lifetime 2) (pid 100)"));
}

// A node is destroyed and created again, and its callback is called as before.
TEST(Verify, TellsCallbacksOfOneLogicalIdApart) {
  auto trace = trace_of(R"(
    callback first timer id=/n@Timer(10)
    callback second timer id=/n@Timer(10)
    callback other timer id=/o@Timer(10)
    10 start first release=9
    12 end first
    13 fini first
    20 init second on=second
    21 start second release=20
    22 end second
    23 start other release=22
    24 end other)");
  trace.erase<CallbackInit>([](const CallbackInit& e, const EventHead& head) {
    return e.callback == CallbackId{1} && head.time.ns < 10;
  });
  const Verified verified(trace);
  EXPECT_THAT(subjects_of(verified, "M3"),
              ElementsAre("callback /n@Timer(10)", "callback /n@Timer(10) (lifetime 2)",
                          "callback /o@Timer(10)"));
  EXPECT_THAT(subjects_of(verified, "M5"), ElementsAre("callback /n@Timer(10) (lifetime 2)"))
      << "the later lifetime, against its predecessor";
  EXPECT_EQ(verified["M7"], Verdict::pass);
  std::vector<std::uint32_t> lifetimes;
  for (const auto& callback : verified.result.report.callbacks)
    lifetimes.push_back(callback.lifetime);
  EXPECT_THAT(lifetimes, ElementsAre(1U, 2U, 1U));
}

TEST(Verify, TellsPublishersOfOneTopicApart) {
  const Verified verified(R"(
    publisher first topic=/t
    publisher second topic=/t
    publisher third topic=/u
    callback fusion timer
    10 start fusion release=9
    11 publish first on=fusion
    12 publish second on=fusion
    13 publish third on=fusion
    14 publish first on=fusion seq=5
    15 publish second on=fusion seq=5
    16 publish third on=fusion seq=5
    20 end fusion)");
  auto topics = subjects_of(verified, "T3");
  std::erase_if(topics, [](const auto& subject) { return !subject.starts_with("topic"); });
  EXPECT_THAT(topics, ElementsAre("topic /t", "topic /t (publisher 2)", "topic /u"));
}

}  // namespace
}  // namespace cie::test
