#include "rules/rule.hpp"
#include "support/verdicts.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using analysis::Verdict;
using ::testing::ElementsAre;

constexpr const char* kTwoTimers = R"(
  callback fusion timer period=10
  callback plan timer period=10
  10 start fusion release=9
  12 end fusion
  13 start plan release=11
  15 end plan
  20 start fusion release=19
  22 end fusion
  23 start plan release=21
  25 end plan)";

TEST(Verify, ASoundTracePassesEveryRuleThatApplies) {
  const Verified verified(kTwoTimers);
  for (const auto& rule : verified.result.verdicts.rules) {
    for (const auto& subject : rule.subjects) {
      EXPECT_EQ(subject.verdict, Verdict::pass) << rule.id << ' ' << subject.subject << '\n'
                                                << verified.evidence(rule.id, subject.subject);
      EXPECT_GE(subject.checked, 1U) << rule.id;
    }
  }
  EXPECT_EQ(verified.result.verdicts.verdict, Verdict::pass);
}

TEST(Verify, KeepsTheContractsOrder) {
  std::string order;
  for (const auto& rule : analysis::rules())
    order += std::string(rule.id) + ' ';
  EXPECT_EQ(order,
            "T1 T2 T3 T4 T5 T6 M1 M2 M3 M4 M5 M6 M7 M8 M9 S1 S2 S3 S4 S5 E1 E2 E3 "
            "R1 R2 R3 R4 R5 Q1 Q2 ");
}

TEST(Verify, EveryRuleHasAPage) {
  for (const auto& rule : analysis::rules()) {
    EXPECT_GT(rule.page.size(), 100U) << rule.id;
    EXPECT_FALSE(rule.name.empty()) << rule.id;
  }
}

TEST(Verify, SortsNumbersInSubjectsByValue) {
  const Verified verified(R"(
    thread t9 pool tid=9
    thread t10 pool tid=10
    thread t101 pool tid=101
    callback a pooled
    callback b pooled
    callback c pooled
    1 start a on=t101
    2 end a on=t101
    3 start b on=t10
    4 end b on=t10
    5 start c on=t9
    6 end c on=t9)");
  std::vector<std::string> subjects;
  for (const auto& subject : verified.rule("M2").subjects)
    subjects.push_back(subject.subject);
  EXPECT_THAT(subjects, ElementsAre("thread 9", "thread 10", "thread 101"));
}

TEST(Verify, NamesThePidWhenThereAreSeveralProcesses) {
  const Verified verified(R"(
    process first pid=100
    callback a
    process second pid=200
    callback b
    1 start a
    2 end a
    3 start b
    4 end b)");
  EXPECT_EQ(verified.of("M3", "callback a (pid 100)"), Verdict::pass);
  EXPECT_EQ(verified.of("M3", "callback b (pid 200)"), Verdict::pass);
}

}  // namespace
}  // namespace cie::test
