#include "report_screens.hpp"
#include "sample_report.hpp"
#include "verify_screens.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

using analysis::Verdict;
using testing::HasSubstr;

TEST(VerifyScreen, LeavesRoomBehindALongName) {
  auto verdicts = test::sample_verdicts();
  for (auto& rule : verdicts.rules)
    if (rule.id == "M2") rule.name = "parameters-before-first-callback";
  EXPECT_THAT(screen_of(verdicts, shared_report()),
              HasSubstr("  M2 parameters-before-first-callback  1 of 2 threads ran"));
}

TEST(VerifyScreen, LeavesALineOf24ForThePromptAndTakesNoMoreColumnsThanThereAre) {
  auto verdicts = test::sample_verdicts();
  auto rule = verdicts.rules[2];
  for (int i = 0; i < 20; ++i) {
    auto subject = rule.subjects[1];
    subject.subject = "thread " + std::to_string(i);
    subject.evidence[0].note = analysis::free_text(std::string(300, 'x') + std::to_string(i));
    rule.subjects.push_back(subject);
  }
  for (int rules = 0; rules < 30; ++rules) {
    for (const std::size_t columns : {40U, 80U, 120U}) {
      std::istringstream text(
          screen_of(verdicts, test::sample_report(), {.columns = columns, .unicode = true}));
      std::size_t lines = 0;
      for (std::string line; std::getline(text, line); ++lines) {
        if (line.find("cie ") == std::string::npos) {
          EXPECT_LE(display_width(line), columns) << line;
        }
      }
      EXPECT_LE(lines, 23U) << rules << " rules, " << columns << " columns";
    }
    rule.id = "S" + std::to_string(rules);
    rule.verdict = rules % 2 == 0 ? Verdict::fail : Verdict::inconclusive;
    for (auto& subject : rule.subjects)
      subject.verdict = rule.verdict;
    verdicts.rules.push_back(rule);
  }
}

// Eight rules with three subjects each have no room for a third of them, and room for one of each.
TEST(VerifyScreen, OfManyRulesHasTheWorstOfEach) {
  auto verdicts = test::sample_verdicts();
  auto rule = verdicts.rules[2];
  const auto subject = rule.subjects[1];
  verdicts.rules.clear();
  for (int id = 0; id < 8; ++id) {
    rule.id = "S" + std::to_string(id);
    rule.verdict = Verdict::fail;
    rule.subjects.clear();
    for (int i = 0; i < 3; ++i) {
      rule.subjects.push_back(subject);
      rule.subjects.back().verdict = Verdict::fail;
      rule.subjects.back().about = {};
      rule.subjects.back().subject = "thread " + std::to_string(i);
      rule.subjects.back().evidence[0].note =
          analysis::free_text("note " + std::to_string(10 * id + i));
    }
    verdicts.rules.push_back(rule);
  }
  const auto text = screen_of(verdicts, test::sample_report(), {.columns = 80, .unicode = true});
  EXPECT_LE(std::ranges::count(text, '\n'), 23) << text;
  const auto shorter = screen_of(verdicts, test::sample_report(), {.columns = 80, .lines = 20});
  EXPECT_LE(std::ranges::count(shorter, '\n'), 20) << shorter;
  for (int id = 0; id < 8; ++id) {
    EXPECT_THAT(text, HasSubstr("  S" + std::to_string(id) + ' '));
    EXPECT_THAT(text, HasSubstr("  note " + std::to_string(10 * id) + ";")) << text;
  }
}

// Long names leave two fifths of a line: a reason is broken between words there, and loses none.
TEST(VerifyScreen, BreaksReasonsBesideLongNamesBetweenWords) {
  auto verdicts = test::sample_verdicts();
  auto& rule = verdicts.rules[2];
  rule.id = "S0";
  auto& subject = rule.subjects[1];
  subject.about = {};
  subject.subject = "thread " + std::string(90, 'x');
  subject.evidence.resize(1);
  subject.evidence[0].note =
      analysis::free_text("was: SCHED_FIFO 50 on CPUs 0,1; is: SCHED_OTHER nice 0");
  rule.subjects = {subject};
  const auto text = screen_of(verdicts, test::sample_report(), {.columns = 100, .unicode = true});
  EXPECT_THAT(text, HasSubstr("was: SCHED_FIFO 50 on CPUs 0,1; is:\n" + std::string(60, ' ') +
                              "SCHED_OTHER nice 0"))
      << text;
}

// Which of several threads ran as many callbacks matters less than which callbacks the worst one ran.
TEST(VerifyScreen, NamesNoMoreSubjectsOfALineThanDetailsLeaveRoomFor) {
  auto report = test::sample_report();
  auto verdicts = test::sample_verdicts();
  auto& rule = verdicts.rules[2];
  ASSERT_EQ(rule.id, "M2");
  rule.verdict = Verdict::fail;
  rule.subjects.clear();
  report.threads.clear();
  for (std::uint32_t i = 3; i < 9; ++i) {
    auto another = report.callbacks[1];
    another.index = analysis::CallbackIndex{i};
    another.logical_id += "#" + std::to_string(i);
    report.callbacks.push_back(another);
  }
  const auto add = [&](std::uint32_t tid, std::size_t callbacks) {
    const auto index = static_cast<std::uint32_t>(report.threads.size());
    report.threads.push_back({.index = analysis::ThreadIndex{index},
                              .tid = tid,
                              .name = "executor_thread",
                              .role = {},
                              .callbacks = {},
                              .sched = {},
                              .busy_ns = {}});
    for (std::size_t i = 0; i < callbacks; ++i)
      report.threads.back().ran.push_back(report.callbacks[i].index);
    rule.subjects.push_back({.about = {.kind = analysis::SubjectKind::thread, .index = index},
                             .subject = "thread " + std::to_string(tid),
                             .verdict = Verdict::fail,
                             .evidence = {}});
  };
  add(1001, 9);
  for (const std::uint32_t tid : {1002U, 1003U, 1004U})
    add(tid, 2);
  const auto text = screen_of(verdicts, report);
  const auto first = display_width("executor_thread (1002), ... 2 more");
  EXPECT_THAT(text, HasSubstr("     executor_thread (1001)" + std::string(first - 22 + 2, ' ') +
                              "9 callbacks: "))
      << text;
  EXPECT_THAT(text, HasSubstr("     executor_thread (1002), ... 2 more  2 callbacks each")) << text;
}

}  // namespace
}  // namespace cie::viewer_export
