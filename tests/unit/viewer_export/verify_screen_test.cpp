#include "report_screens.hpp"
#include "sample_report.hpp"
#include "verify_screens.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

using analysis::Verdict;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

const std::string kRow =
    "     4008  2 callbacks: lidar ← /sensing/lidar/top/points_raw, plan timer 20 ms\n";

TEST(VerifyScreen, SaysThatRaisedPrioritiesWerePerhapsInherited) {
  analysis::VerdictReport verdicts;
  verdicts.verdict = Verdict::pass;
  analysis::SubjectVerdict subject{
      .subject = "thread 4008", .verdict = Verdict::pass, .checked = 3, .evidence = {}};
  verdicts.rules = {{.id = "S3",
                     .name = "parameters-unchanged",
                     .verdict = Verdict::pass,
                     .subjects = {subject}}};
  EXPECT_THAT(screen_of(verdicts, test::sample_report()), Not(HasSubstr("by read-back")));
  const analysis::Evidence seen{.event = "by read-back",
                                .time = std::nullopt,
                                .cpu = std::nullopt,
                                .pid = 4001,
                                .tid = 4008,
                                .note = analysis::note("perhaps-inherited-from-here",
                                                       {{"priority", "real-time priority 60"}})};
  subject.evidence = {seen};
  verdicts.rules[0].subjects = {subject, subject};
  EXPECT_THAT(
      screen_of(verdicts, test::sample_report()),
      HasSubstr("\n  S3 by read-back: 2 threads had raised priorities, perhaps inherited\n"));
}

// A PASS of everything else does not mean that they run as the spec says.
TEST(VerifyScreen, SaysWhichParametersNoRuleJudges) {
  analysis::VerdictReport verdicts;
  verdicts.verdict = Verdict::pass;
  analysis::SubjectVerdict subject{
      .subject = "callback a/b", .verdict = Verdict::pass, .checked = 1, .evidence = {}};
  subject.evidence = {{.event = "not applied",
                       .time = std::nullopt,
                       .cpu = std::nullopt,
                       .pid = std::nullopt,
                       .tid = std::nullopt,
                       .note = analysis::free_text("no thread is its own")}};
  verdicts.rules = {{.id = "M1",
                     .name = "specified-callback-seen",
                     .verdict = Verdict::pass,
                     .subjects = {subject}}};
  EXPECT_THAT(
      screen_of(verdicts, test::sample_report()),
      HasSubstr("\n  no rule judges the parameters of 1 callback, which has no own thread\n"));
  verdicts.rules[0].subjects = {subject, subject};
  EXPECT_THAT(screen_of(verdicts, test::sample_report()),
              HasSubstr("of 2 callbacks, which have no own thread\n"));
}

TEST(VerifyScreen, OfATerminalOf80Columns) {
  EXPECT_EQ(screen_of(test::sample_verdicts(), shared_report(), {.columns = 80, .unicode = true}),
            "✗ FAIL  run 1: 1 of 2 callbacks share threads\n"
            "  M2 one-callback-per-thread     1 of 2 threads ran several callbacks\n" +
                kRow +
                "  undecided\n"
                "     T4  1 process  no run_end: the process was interrupted\n"
                "  → give each callback a callback group of its own\n"
                "  1 rule passes, 1 undecided, 1 does not apply; 14 instances, nothing lost, 1\n"
                "  cut or never ended\n"
                "  evidence: cie verify 'recordings/run 1' --only M2 --all\n"
                "  rule: cie verify --explain M2    look: cie view 'recordings/run 1'\n");
}

TEST(VerifyScreen, OfATerminalOf120Columns) {
  EXPECT_EQ(
      screen_of(test::sample_verdicts(), shared_report(), {.columns = 120, .unicode = true}),
      "✗ FAIL  run 1: 1 of 2 callbacks share threads\n"
      "  M2 one-callback-per-thread     1 of 2 threads ran several callbacks\n" +
          kRow +
          "  undecided\n"
          "     T4  1 process  no run_end: the process was interrupted\n"
          "  → give each callback a callback group of its own\n"
          "  1 rule passes, 1 undecided, 1 does not apply; 14 instances, nothing lost, 1 cut or "
          "never ended\n"
          "  evidence: cie verify 'recordings/run 1' --only M2 --all    rule: cie verify --explain "
          "M2\n"
          "  look: cie view 'recordings/run 1'\n");
}

TEST(VerifyScreen, OfAPipeIsAscii) {
  const auto text = screen_of(test::sample_verdicts(), shared_report());
  EXPECT_THAT(text, StartsWith("FAIL  run 1: 1 of 2 callbacks share threads\n"));
  EXPECT_THAT(text,
              HasSubstr("2 callbacks: lidar <- /sensing/lidar/top/points_raw, plan timer 20 ms\n"));
  EXPECT_THAT(text, HasSubstr("\n  -> give each callback"));
  for (const char c : text)
    EXPECT_TRUE(c == '\n' || (c >= ' ' && c <= '~')) << text;
}

TEST(VerifyScreen, OfAPassIsWhatWasChecked) {
  auto report = test::sample_report();
  report.callbacks.resize(1);
  const auto passing = [](const char* id) {
    return analysis::RuleVerdict{.id = id, .name = id, .verdict = Verdict::pass, .subjects = {}};
  };
  EXPECT_EQ(screen_of({.verdict = Verdict::pass, .rules = {passing("M2"), passing("M3")}}, report),
            "PASS  run 1: 1 of 1 callback had a thread of its own\n"
            "  2 rules pass; 7 instances, nothing lost\n");
}

TEST(VerifyScreen, OfWhatIsUndecidedSaysWhatWasSeenAndEachReasonOnce) {
  auto report = test::sample_report();
  report.callbacks[1].isolation = analysis::Isolation::isolated;
  const auto undecided = [](const char* id, const char* subject, const analysis::Note& note) {
    return analysis::RuleVerdict{.id = id,
                                 .name = "rule",
                                 .verdict = Verdict::inconclusive,
                                 .subjects = {{.about = {.kind = analysis::SubjectKind::thread},
                                               .subject = subject,
                                               .verdict = Verdict::inconclusive,
                                               .evidence = {{.event = "x",
                                                             .time = analysis::Timestamp{1},
                                                             .cpu = {},
                                                             .pid = {},
                                                             .tid = {},
                                                             .note = note}}}}};
  };
  const analysis::VerdictReport verdicts{
      .verdict = Verdict::inconclusive,
      .rules = {{.id = "M2", .name = "m", .verdict = Verdict::pass, .subjects = {}},
                {.id = "M3", .name = "m", .verdict = Verdict::pass, .subjects = {}},
                undecided("M9", "thread 3", analysis::free_text("/b@Timer(1) is unknown")),
                undecided("S3", "thread 1", analysis::note("no-thread-fini", {{"tid", 1}})),
                undecided("S4", "thread 2", analysis::note("no-thread-fini", {{"tid", 2}}))}};
  EXPECT_EQ(screen_of(verdicts, report),
            "INCONCLUSIVE  run 1: 2 of 2 callbacks that ran had a thread of their own; 3 rules "
            "undecided\n"
            "  S3 S4  2 threads  e.g. thread 1 has no thread_fini\n"
            "  M9     1 thread   /b@Timer(1) is unknown\n"
            "  -> where these rules may stay undecided: --inconclusive=warn exits with 0\n"
            "  2 rules pass, 3 undecided; 14 instances, nothing lost, 1 cut or never ended\n"
            "  evidence: cie verify 'recordings/run 1' --only M2 --all    rule: cie verify "
            "--explain S3\n"
            "  look: cie view 'recordings/run 1'\n");
}

// What it did not write nobody knows: that is never said to be nothing.
TEST(VerifyScreen, SaysWhatTheRecorderSaysAndNotThatNothingIsLost) {
  auto report = test::sample_report();
  report.defects = {{.kind = analysis::DefectKind::recorder_problem,
                     .severity = analysis::Severity::error,
                     .count = 1,
                     .advice = "cie record says: the disk was full"}};
  analysis::VerdictReport verdicts{
      .verdict = Verdict::inconclusive,
      .rules = {{.id = "T2", .name = "no-loss", .verdict = Verdict::inconclusive, .subjects = {}}}};
  report.trace.lost_events.reset();
  EXPECT_THAT(
      screen_of(verdicts, report),
      AllOf(HasSubstr("14 instances, losses unknown"), HasSubstr("recorder-problem (cie record"),
            HasSubstr("-> record again"), Not(HasSubstr("nothing lost"))));
  report.trace.lost_events = 0;  // totals prove that all is here
  verdicts.verdict = verdicts.rules[0].verdict = Verdict::pass;
  EXPECT_THAT(screen_of(verdicts, report),
              AllOf(HasSubstr("1 problem of the recorder"), Not(HasSubstr("nothing lost"))));
}

TEST(VerifyScreen, SaysDurationsOfReasonsInUnitsThatFit) {
  auto verdicts = test::sample_verdicts();
  verdicts.verdict = Verdict::inconclusive;
  std::erase_if(verdicts.rules, [](const auto& rule) { return rule.id == "M2"; });
  verdicts.rules[1].subjects[0].evidence[0].note = analysis::note(
      "kernel-events-lost",
      {{"events", 3U},
       {"when", analysis::note("lost-within", {{"span", analysis::Duration{16257687}}})}});
  EXPECT_THAT(screen_of(verdicts, test::sample_report(), {.columns = 200}),
              HasSubstr("3 kernel events lost within 16.26 ms"));
}

TEST(VerifyScreen, BreaksACommandAsAShellReadsOn) {
  auto context = usual_verify_context();
  context.verify_arguments = "'a run' --spec " + std::string(30, 's') + " --only M2,M3";
  EXPECT_THAT(screen_of(test::sample_verdicts(), shared_report(), {.columns = 60}, context),
              HasSubstr("\n  evidence: cie verify 'a run' --spec \\\n      " +
                        std::string(30, 's') + " --only M2,M3 --all\n"));
}

TEST(VerifyScreen, HasIdsWhereTheyAreAskedFor) {
  EXPECT_THAT(
      screen_of(test::sample_verdicts(), shared_report(), {.columns = 200, .ids = true}),
      HasSubstr("2 callbacks: /perception/lidar@Subscription(/sensing/lidar/top/points_raw), "
                "/a/plan@Timer(20000000)\n"));
}

TEST(VerifyScreen, OfAWindowSaysThatThePageShowsTheWholeRecording) {
  auto verdicts = test::sample_verdicts();
  EXPECT_THAT(screen_of(verdicts, shared_report()), HasSubstr("look: cie view"));
  verdicts.window = analysis::TimeWindow{.from = {7}, .to = {9}};
  EXPECT_THAT(screen_of(verdicts, shared_report()), HasSubstr("look (whole recording): cie view"));
}

TEST(VerifyScreen, LetsNoNameControlTheTerminal) {
  auto verdicts = test::sample_verdicts();
  verdicts.rules[2].subjects[1].subject = "thread \x1b[2J\n";
  verdicts.rules[2].subjects[1].evidence[0].note = analysis::free_text("\x1b]52;c;evil\x07");
  auto report = test::sample_report();
  report.trace.paths = {"run\x1b[1m"};
  const auto text = screen_of(verdicts, report);
  EXPECT_THAT(text, Not(HasSubstr("\x1b")));
  EXPECT_THAT(text, Not(HasSubstr("\x07")));
  EXPECT_THAT(text, HasSubstr("\\x1b[2J\\x0a"));
}

}  // namespace
}  // namespace cie::viewer_export
