#include "exit_code.hpp"

#include <gtest/gtest.h>

namespace cie::cli {
namespace {

using analysis::Verdict;

analysis::VerdictReport overall(Verdict verdict, Verdict t1 = Verdict::pass) {
  return {.verdict = verdict,
          .rules = {{.id = "T1", .name = "trace-readable", .verdict = t1, .subjects = {}}}};
}

TEST(ExitCode, SaysTheVerdict) {
  EXPECT_EQ(exit_code(overall(Verdict::pass), OnInconclusive::report), 0);
  EXPECT_EQ(exit_code(overall(Verdict::not_applicable), OnInconclusive::report), 0);
  EXPECT_EQ(exit_code(overall(Verdict::fail), OnInconclusive::report), 1);
  EXPECT_EQ(exit_code(overall(Verdict::inconclusive), OnInconclusive::report), 3);
}

TEST(ExitCode, TakesInconclusiveAsAsked) {
  EXPECT_EQ(exit_code(overall(Verdict::inconclusive), OnInconclusive::warn), 0);
  EXPECT_EQ(exit_code(overall(Verdict::inconclusive), OnInconclusive::fail), 1);
  EXPECT_EQ(exit_code(overall(Verdict::fail), OnInconclusive::warn), 1) << "a violation stays one";
}

TEST(ExitCode, WaivesNeverThatAPartOfTheTraceWasNotRead) {
  const auto report = overall(Verdict::inconclusive, Verdict::inconclusive);
  EXPECT_EQ(exit_code(report, OnInconclusive::warn), 3);
  EXPECT_EQ(exit_code(report, OnInconclusive::report), 3);
  EXPECT_EQ(exit_code(report, OnInconclusive::fail), 1);
  EXPECT_EQ(exit_code(overall(Verdict::fail, Verdict::inconclusive), OnInconclusive::warn), 1);
}

TEST(ExitCode, AnUnreadableTraceWinsOverAll) {
  EXPECT_EQ(exit_code(overall(Verdict::fail, Verdict::fail), OnInconclusive::warn), 4);
}

}  // namespace
}  // namespace cie::cli
