#include "report_screens.hpp"
#include "sample_report.hpp"
#include "verify_screens.hpp"

#include <algorithm>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

using analysis::Verdict;
using testing::AllOf;
using testing::HasSubstr;

TEST(VerifyScreen, ToldInOneLine) {
  EXPECT_EQ(line_of(test::sample_verdicts(), shared_report()),
            "FAIL  run 1: 1 of 2 callbacks share threads; violated M2; undecided T4\n");
}

TEST(VerifyScreen, ToldInOneLineNamesTheWindowAndCountsWhatIsSuppressed) {
  auto verdicts = test::suppressed_verdicts(false);
  verdicts.window = analysis::TimeWindow{.from = {7}, .to = {9}};
  EXPECT_THAT(line_of(verdicts, shared_report()),
              testing::EndsWith("; 1 verdict suppressed; only the window 7..9 ns\n"));
}

TEST(VerifyScreen, ToldInOneLineSaysOnceWhatIsUndecided) {
  const auto undecided = [](const char* id) {
    return analysis::RuleVerdict{
        .id = id, .name = id, .verdict = Verdict::inconclusive, .subjects = {}};
  };
  EXPECT_EQ(line_of({.verdict = Verdict::inconclusive, .rules = {undecided("T4"), undecided("Q1")}},
                    shared_report()),
            "INCONCLUSIVE  run 1: 2 rules undecided: T4 Q1\n");
}

TEST(VerifyScreen, CountsWhatIsSuppressedAndNamesWhatIsNoLonger) {
  EXPECT_THAT(screen_of(test::suppressed_verdicts(false), shared_report()),
              HasSubstr("1 verdict suppressed"));
  EXPECT_THAT(screen_of(test::suppressed_verdicts(true), shared_report()),
              HasSubstr("suppression ok.yaml:2 (M2 thread *) expired after 2026-12-31"));
}

// A rule of which every verdict is a suppressed violation.
analysis::RuleVerdict suppressed(const char* id, const std::string& reason, const char* expires,
                                 std::size_t subjects = 1) {
  auto subject = judged(analysis::SubjectKind::callback, "callback /b@Timer(1)", Verdict::fail);
  subject.suppression = {
      .rule = id, .subject = "*", .reason = reason, .expires = expires, .place = "ok.yaml:2"};
  return {.id = id,
          .name = id,
          .verdict = Verdict::fail,
          .subjects = std::vector<analysis::SubjectVerdict>(subjects, subject)};
}

TEST(VerifyScreen, NamesTheRulesThatAreSuppressedWithReasonAndExpiry) {
  EXPECT_EQ(screen_of({.verdict = Verdict::pass,
                       .rules = {suppressed("M2", "the pool is meant", "2026-12-31", 4),
                                 suppressed("M3", "the pool is meant", "2026-12-31", 2),
                                 suppressed("R1", "bursts", "never"),
                                 {.id = "R2",
                                  .name = "r",
                                  .verdict = Verdict::not_applicable,
                                  .subjects = {}}}},
                      shared_report(), {.columns = 80}),
            "PASS  run 1: no rule is kept without what is suppressed: M2 M3 R1\n"
            "  M2 M3  suppressed until 2026-12-31: the pool is meant\n"
            "  R1     suppressed for ever: bursts\n"
            "  1 does not apply, 7 verdicts suppressed; 14 instances, nothing lost, 1 cut or\n"
            "  never ended\n"
            "  evidence: cie verify 'recordings/run 1' --only M2 --all\n"
            "  look: cie view 'recordings/run 1'\n");
  EXPECT_THAT(screen_of(test::suppressed_verdicts(false), shared_report()),
              HasSubstr("  M2  suppressed until 2026-12-31: known <since> May\n"));
}

TEST(VerifyScreen, NamesEverySuppressedRuleHoweverManyReasonsThereAre) {
  analysis::VerdictReport verdicts{.verdict = Verdict::pass, .rules = {}};
  for (const auto* const id : {"M2", "M3", "M4", "R1", "R2"})
    verdicts.rules.push_back(suppressed(id, id + std::string(500, 'x'), "never"));
  const auto screen = screen_of(verdicts, shared_report(), {.columns = 80});
  EXPECT_THAT(screen, AllOf(HasSubstr("\n  M2  suppressed for ever: M2xx"),
                            HasSubstr("\n  M3  suppressed for ever: M3xx"),
                            HasSubstr("\n  ... suppressed for 3 more reasons: M4 R1 R2\n")));
  EXPECT_LE(std::ranges::count(screen, '\n'), 23);
}

}  // namespace
}  // namespace cie::viewer_export
