// Subjects of one name are told apart.
#include "reused_tid.hpp"
#include "support/verdicts.hpp"

#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

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
