// The line of the verify screen that says what to do next.
#include "sample_report.hpp"
#include "verify_screens.hpp"

#include <cerrno>
#include <cstdint>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

using analysis::Verdict;
using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

// An executor that is refused parameters runs nothing.
TEST(VerifyScreen, TellsOfRefusedParametersBeforeWhatNeverRanForThem) {
  analysis::SubjectVerdict never_ran{
      .subject = "callback a/b", .verdict = Verdict::fail, .checked = 1, .evidence = {}};
  never_ran.about = {.kind = analysis::SubjectKind::callback, .index = 0, .process = {}};
  auto refused = never_ran;
  refused.subject = "thread 4008";
  refused.about.kind = analysis::SubjectKind::thread;
  const auto text = [&](const analysis::SubjectVerdict& missing, std::uint64_t instances) {
    analysis::VerdictReport verdicts;
    verdicts.verdict = Verdict::fail;
    verdicts.rules = {{.id = "M1",
                       .name = "specified-callback-seen",
                       .verdict = Verdict::fail,
                       .subjects = {missing}},
                      {.id = "S1",
                       .name = "parameters-as-specified",
                       .verdict = Verdict::fail,
                       .subjects = {refused}}};
    analysis::Report report;
    report.callbacks.emplace_back().instances = instances;
    return screen_of(verdicts, report, {.columns = 400});
  };
  EXPECT_THAT(text(never_ran, 0),
              AllOf(StartsWith("FAIL  1 of 1 thread did not run as specified\n"),
                    HasSubstr("\n  -> look whether what configures the threads was refused")));
  EXPECT_THAT(text(never_ran, 1), HasSubstr("  -> let the recording last until the callback has "
                                            "run, or remove its entry\n"));
  auto misspelt = never_ran;
  misspelt.about.index.reset();
  EXPECT_THAT(text(misspelt, 0), HasSubstr("  -> write the id that"));
}

// A spec makes rules applicable that compare with one: S1 and R4, not M5.
TEST(VerifyScreen, SaysHowManyOfTheRulesThatDoNotApplyNeedASpec) {
  const auto text = [](const std::vector<const char*>& rules, const VerifyContext& context) {
    analysis::VerdictReport verdicts{.verdict = Verdict::pass, .rules = {}};
    for (const auto* id : rules)
      verdicts.rules.push_back({.id = id, .name = id, .subjects = {}});
    return screen_of(verdicts, test::sample_report(), {.columns = 200}, context);
  };
  const auto without = usual_verify_context();
  auto with = without;
  with.spec_name = "app.yaml";
  EXPECT_THAT(text({"S1", "M5", "R4"}, without), HasSubstr("  3 do not apply (2 need --spec);"));
  EXPECT_THAT(text({"S1", "M5"}, without), HasSubstr("  2 do not apply (1 needs --spec);"));
  EXPECT_THAT(text({"S1"}, without), HasSubstr("  1 does not apply (1 needs --spec);"));
  EXPECT_THAT(text({"M5"}, without), HasSubstr("  1 does not apply;"));
  EXPECT_THAT(text({"S1", "M5"}, with), HasSubstr("  2 do not apply;"));
}

TEST(VerifyScreen, OfARefusedRequestAdvisesByItsErrno) {
  const auto screen = [](std::vector<int> errors) {
    analysis::RuleVerdict rule{
        .id = "S1", .name = "parameters-as-specified", .verdict = Verdict::fail, .subjects = {}};
    for (const int error : errors) {
      rule.subjects.push_back(
          {.subject = "thread 4008", .verdict = Verdict::fail, .checked = 1, .evidence = {}});
      rule.subjects.back().evidence.emplace_back().note =
          analysis::note("request-failed", {{"error", "an error"}, {"errno", error}});
    }
    analysis::VerdictReport verdicts;
    verdicts.verdict = Verdict::fail;
    verdicts.rules = {rule};
    return screen_of(verdicts, analysis::Report{}, {.columns = 400});
  };
  EXPECT_THAT(screen({EBUSY, EBUSY}), HasSubstr("-> reserve less in all (runtime / period)"));
  EXPECT_THAT(screen({EPERM}), HasSubstr("-> give the application CAP_SYS_NICE or a higher limit"));
  EXPECT_THAT(screen({EINVAL}), HasSubstr("-> look at the values"));
  for (const auto& errors : {std::vector{EBUSY, EPERM}, std::vector{EBUSY, 0}, std::vector{ESRCH}})
    EXPECT_THAT(screen(errors), HasSubstr("-> look whether what configures the threads was"));
}

TEST(VerifyScreen, OfWhatIsUndecidedAdvisesWhatHelps) {
  auto verdicts = test::sample_verdicts();
  verdicts.verdict = Verdict::inconclusive;
  std::erase_if(verdicts.rules, [](const auto& rule) { return rule.id == "M2"; });
  const TextStyle wide{.columns = 200};
  auto& evidence = verdicts.rules[1].subjects[0].evidence[0];
  evidence.note = analysis::free_text("no run_begin of this process");
  EXPECT_THAT(screen_of(verdicts, test::sample_report(), wide),
              HasSubstr("  -> where these rules may stay undecided: --inconclusive=warn"));
  // T4, of an application that was still running.
  evidence.note = analysis::note("no-run-end");
  EXPECT_THAT(
      screen_of(verdicts, test::sample_report(), wide),
      HasSubstr("  -> of processes that did not end in the recording --allow-crash judges "
                "what was seen; --inconclusive=warn exits with 0 whatever stays undecided\n"));
  // T2, of events for which the tracer had no room.
  auto report = test::sample_report();
  report.defects = {{.kind = analysis::DefectKind::discarded_events,
                     .severity = analysis::Severity::loss,
                     .count = 7,
                     .advice = {}}};
  verdicts.rules.push_back(
      {.id = "T2", .name = "no-loss", .verdict = Verdict::inconclusive, .subjects = {}});
  EXPECT_THAT(screen_of(verdicts, report, wide),
              HasSubstr("  -> record again with larger or more sub-buffers (cie record "
                        "--subbuf-size, --num-subbuf), or fewer events\n"));
  EXPECT_THAT(
      screen_of(verdicts, {}, wide),
      HasSubstr("  -> it holds nothing to judge: record again, with what T5 asks for, while the "
                "application runs\n"));
}

}  // namespace
}  // namespace cie::viewer_export
