#include "verdict_log.hpp"

#include <cstdint>
#include <optional>
#include <string>

#include <gtest/gtest.h>

namespace cie::live {
namespace {

using analysis::SubjectKind;
using analysis::Verdict;

analysis::VerdictReport violated(const std::string& subject, std::optional<std::uint32_t> index) {
  analysis::SubjectVerdict verdict{.about = {.kind = SubjectKind::callback, .index = index},
                                   .subject = subject,
                                   .verdict = Verdict::fail,
                                   .checked = 1,
                                   .evidence = {}};
  return {.rules = {{.id = "R2", .name = "no-missed-release", .subjects = {verdict}}}};
}

TEST(VerdictLog, KnowsASubjectWhoseNameChangesAsAnotherProcessAppears) {
  VerdictLog log;
  EXPECT_EQ(log.note(violated("callback plan", 3), {10}).changes.size(), 1U);
  const auto later = log.note(violated("callback plan (pid 7)", 3), {20});
  EXPECT_TRUE(later.changes.empty());
  EXPECT_EQ(later.current.at(0).since_ns, 10);
  EXPECT_EQ(later.current.at(0).subject, "callback plan (pid 7)");
}

TEST(VerdictLog, TellsSubjectsOfOneNameApart) {
  VerdictLog log;
  log.note(violated("callback plan", 3), {10});
  EXPECT_EQ(log.note(violated("callback plan", 4), {20}).changes.size(), 1U);
}

TEST(VerdictLog, KnowsASubjectWithoutARowByItsName) {
  VerdictLog log;
  log.note(violated("callback plan", {}), {10});
  EXPECT_TRUE(log.note(violated("callback plan", {}), {20}).changes.empty());
  EXPECT_EQ(log.note(violated("callback show", {}), {30}).changes.size(), 1U);
}

// What is absent has no event, as T5 tells.
TEST(VerdictLog, SaysWhatHasNoEvent) {
  VerdictLog log;
  auto report = violated("trace", std::nullopt);
  analysis::Evidence missing;
  missing.note = analysis::free_text("no callback_init in it");
  report.rules[0].subjects[0].evidence = {missing};
  EXPECT_EQ(log.note(report, {10}).current.at(0).note, "no callback_init in it");
  report.rules[0].subjects[0].evidence[0].event = "run_begin";
  EXPECT_EQ(VerdictLog().note(report, {10}).current.at(0).note,
            "run_begin: no callback_init in it");
}

TEST(VerdictLog, ListsTheGravestRuleFirst) {
  auto verdicts = violated("callback plan", 3);
  verdicts.rules.push_back(verdicts.rules.front());
  verdicts.rules.back().id = "R3";
  verdicts.rules.push_back(verdicts.rules.front());
  verdicts.rules.back().id = "M2";
  std::string order;
  for (const auto& verdict : VerdictLog().note(verdicts, {10}).current)
    order += verdict.rule + ' ';
  EXPECT_EQ(order, "M2 R3 R2 ");
}

TEST(VerdictLog, CountsTheViolationsThatItDoesNotList) {
  auto verdicts = violated("callback plan", 3);
  auto& subjects = verdicts.rules.front().subjects;
  subjects.resize(VerdictLog::kMaxListed + 7, subjects.front());
  for (std::uint32_t i = 0; i < subjects.size(); ++i)
    subjects[i].about.index = i;
  subjects.back().verdict = Verdict::inconclusive;
  verdicts.rules.push_back(verdicts.rules.front());
  verdicts.rules.back().id = "M2";
  verdicts.rules.push_back({.id = "Q1", .name = "unlost", .subjects = {}});
  const auto noted = VerdictLog().note(verdicts, {10});
  EXPECT_EQ(noted.current.size(), VerdictLog::kMaxListed);
  EXPECT_EQ(noted.left_out, VerdictLog::kMaxListed + 2 * 7);
  ASSERT_EQ(noted.violations.size(), 2U);
  EXPECT_EQ(noted.violations[0].rule, "M2");
  EXPECT_EQ(noted.violations[0].subjects, VerdictLog::kMaxListed + 7 - 1);
  EXPECT_EQ(noted.violations[1].rule, "R2");
  EXPECT_EQ(noted.violations[1].subjects, VerdictLog::kMaxListed + 7 - 1);
}

TEST(VerdictLog, SaysWhyByTheEventThatKnows) {
  auto verdicts = violated("callback plan", 3);
  verdicts.rules.front().id = "R3";
  auto& evidence = verdicts.rules.front().subjects.front().evidence;
  evidence.resize(2);
  evidence[0].event = "callback_start";
  evidence[0].note = analysis::free_text("seq 5 starts");
  evidence[1].note =
      analysis::note("deadline-missed", {{"response", analysis::Duration{32214275}},
                                         {"error", analysis::Note{}},
                                         {"spec", "app.yaml:7"},
                                         {"deadline", analysis::Duration{10000000}}});
  const auto noted = VerdictLog().note(verdicts, {10});
  EXPECT_EQ(noted.current.at(0).note, "callback_start: seq 5 starts");
  EXPECT_EQ(noted.current.at(0).says,
            "callback plan: response time 32.21 ms, the deadline of app.yaml:7 is 10.00 ms")
      << "in the units of the table";
}

TEST(VerdictLog, SaysWhatIsToldOfAViolation) {
  const auto verdicts = violated("thread 5", 3);
  const auto tell = [](const auto& rule, const auto& /*subject*/) {
    return rule.id == "R2" ? std::string("2 callbacks: plan, drive") : std::string();
  };
  EXPECT_EQ(VerdictLog().note(verdicts, {10}, tell).changes.at(0).says,
            "thread 5: 2 callbacks: plan, drive");
}

}  // namespace
}  // namespace cie::live
