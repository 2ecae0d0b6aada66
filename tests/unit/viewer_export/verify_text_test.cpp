#include <cie/viewer_export/verify_writers.hpp>
#include <cie/viewer_export/version.hpp>

#include "sample_report.hpp"

#include <cstdint>
#include <limits>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

std::string verify_text_of(const analysis::VerdictReport& verdicts, const analysis::Report& report,
                           const VerifyContext& context = {}, const TextStyle& style = {}) {
  std::ostringstream out;
  write_verify_text(out, verdicts, report, context, style);
  return out.str();
}

TEST(VerifyText, SaysVerdictFindingsEvidenceAndSummary) {
  const VerifyContext context{.spec_name = "app.yaml", .spec_sha256 = "abc123"};
  // The commands show the events from 1 ms before to 1 ms after the evidence.
  EXPECT_EQ(verify_text_of(test::sample_verdicts(), test::sample_report(), context),
            "Verdict: FAIL\n"
            "  violated        M2\n"
            "  undecided       T4\n"
            "  passed          T1\n"
            "  not applicable  M5\n"
            "\n"
            "FAIL  M2 one-callback-per-thread: thread 4008 (9 checked)\n"
            "    at 983005016596 ns (5.017 ms into the trace)  callback_start  cpu 0  pid 4001  "
            R"(tid 4008  started
      /a/plan@Timer(20000000), instance 0  [ust/channel0_1 packet 2]
    at 983005187272 ns (5.187 ms into the trace)  callback_start  pid 4001  tid 4008  started
      /b@Timer(1), instance 0
    cie events 'recordings/run 1' --window 983004016596..983006187272
    The rule: Each thread ran one callback only. Threads are told apart by incarnation, so a reused
    tid is another thread.
    Why it matters: Callbacks that share a thread wait for each other whatever their priorities: the
    urgent one is as late as the slowest before it.
    Remedy: use the isolated executor (--executor isolated), and give each callback a callback group
    of its own.

INCONCLUSIVE  T4 run-complete: process 4001
    at 983130000000 ns (130.0 ms into the trace)  missing  no run_end: the process was interrupted
    cie events 'recordings/run 1' --window 983129000000..983131000000
    The rule: The process was seen from its run_begin to its run_end, and what it counted
    (callbacks, threads, groups, publishers, instances started and ended, messages, read-backs) is
    what the trace shows.
    Inconclusive when run_begin or run_end is missing (the process was still running when the
    recording ended, as in snapshots, chunks and where it was attached to; or it crashed, or
    executed another program; a process of ROS 2 alone has none), or a total differs from what was
    seen. --allow-crash accepts a process without a run_end, unless its recorder failed; the other
    rules judge what was seen.

14 instances of 3 callbacks in 1 process checked; 1 cut by an edge of the trace or never ended
spec app.yaml sha256 abc123
cie )" + std::string{tool_version()} +
                "; cie verify --explain ID tells what a rule means\n");
}

// A rule that passes because what was seen may be excused says so.
analysis::VerdictReport verdicts_by_read_back(bool is_raised) {
  analysis::VerdictReport verdicts;
  verdicts.verdict = analysis::Verdict::pass;
  const analysis::Evidence seen{
      .event = "by read-back",
      .time = analysis::Timestamp{983'005'016'596},
      .cpu = std::nullopt,
      .pid = 4001,
      .tid = 4008,
      .note = is_raised ? analysis::note("perhaps-inherited-from-here", {{"priority", "FIFO 60"}})
                        : analysis::note("switch-record-has-holes")};
  verdicts.rules = {{.id = "S3",
                     .name = "parameters-unchanged",
                     .verdict = analysis::Verdict::pass,
                     .subjects = {{.subject = "thread 4008",
                                   .verdict = analysis::Verdict::pass,
                                   .checked = 3,
                                   .evidence = {seen}}}}};
  return verdicts;
}

TEST(VerifyText, SaysOnWhatAPassRests) {
  const auto report = test::sample_report();
  const auto plain = verify_text_of(verdicts_by_read_back(false), report);
  EXPECT_THAT(plain, AllOf(HasSubstr("  passed          S3\n  of these        S3 by read-back\n"),
                           Not(HasSubstr("thread 4008"))));
  EXPECT_THAT(verify_text_of(verdicts_by_read_back(true), report),
              AllOf(HasSubstr("PASS  S3 parameters-unchanged: thread 4008 (3 checked)\n"),
                    HasSubstr("by read-back  pid 4001  tid 4008  FIFO 60 from")));
}

TEST(VerifyText, SaysThatThereWasNoSpec) {
  EXPECT_THAT(verify_text_of(test::sample_verdicts(), test::sample_report()),
              HasSubstr("no --spec was given"));
}

TEST(VerifyText, NamesCallbacksThatAnExceptionEnded) {
  auto report = test::sample_report();
  EXPECT_THAT(verify_text_of(test::sample_verdicts(), report), Not(HasSubstr("exception")));
  report.callbacks[0].exceptions = 1;
  report.callbacks[2].logical_id = "/b@Timer(1)";
  report.callbacks[2].exceptions = 41;
  EXPECT_THAT(verify_text_of(test::sample_verdicts(), report),
              HasSubstr("42 instances ended by an exception: 1 of " +
                        report.callbacks[0].logical_id + ", 41 of /b@Timer(1)\n"));
}

TEST(VerifyText, NamesWhatTaintsTheTrace) {
  auto report = test::sample_report();
  report.defects = {{.kind = analysis::DefectKind::discarded_events,
                     .severity = analysis::Severity::loss,
                     .count = 12,
                     .advice = "use larger buffers"}};
  EXPECT_THAT(
      verify_text_of(test::sample_verdicts(), report),
      HasSubstr("defects of the trace (what they hide stays undecided): discarded-events x 12: "
                "use larger buffers\n"));
}

TEST(VerifyText, ShowsASuppressedVerdictApartAndNamesUselessEntries) {
  const auto text = verify_text_of(test::suppressed_verdicts(false), test::sample_report());
  EXPECT_THAT(text, StartsWith("Verdict: INCONCLUSIVE\n"
                               "  undecided       T4\n"
                               "  suppressed      M2\n"
                               "  passed          T1\n"));
  EXPECT_THAT(text,
              HasSubstr("SUPPRESSED FAIL  M2 one-callback-per-thread: thread 4008 (9 checked)\n"
                        "    suppressed until 2026-12-31 (ok.yaml:2): known <since> May\n"
                        "    at 983005016596 ns"));
  EXPECT_LT(text.find("INCONCLUSIVE  T4"), text.find("SUPPRESSED FAIL"))
      << "what counts comes first";
  EXPECT_THAT(text, HasSubstr("suppression ok.yaml:6 (M5 thread *) is unused: nothing it names is "
                              "violated or undecided\n"));
}

TEST(VerifyText, SaysThatASuppressionHasExpired) {
  const auto text = verify_text_of(test::suppressed_verdicts(true), test::sample_report());
  EXPECT_THAT(text, StartsWith("Verdict: FAIL\n  violated        M2\n"));
  EXPECT_THAT(text, HasSubstr("FAIL  M2 one-callback-per-thread: thread 4008 (9 checked)\n"
                              "    suppression expired after 2026-12-31 (ok.yaml:2): known"));
  EXPECT_THAT(text, HasSubstr("suppression ok.yaml:2 (M2 thread *) expired after 2026-12-31: its "
                              "verdict counts again\n"));
}

TEST(VerifyText, SaysOfAnExpiredSuppressionWhatCountsAgain) {
  const auto told = [](std::uint64_t matched, std::uint64_t counting) {
    auto verdicts = test::suppressed_verdicts(true);
    auto& use = verdicts.suppressions->uses[0];
    use.matched = matched;
    use.counting = counting;
    return verify_text_of(verdicts, test::sample_report());
  };
  EXPECT_THAT(told(2, 2), HasSubstr("expired after 2026-12-31: its verdicts count again\n"));
  EXPECT_THAT(told(3, 1), HasSubstr("2026-12-31: 1 of its 3 verdicts counts again\n"));
  EXPECT_THAT(told(2, 0), HasSubstr("2026-12-31 and is not needed: other entries"));
  EXPECT_THAT(told(0, 0), HasSubstr("2026-12-31 and is unused: nothing it names"));
}

TEST(VerifyText, ExplainsARuleOnceHoweverManySubjectsViolateIt) {
  auto verdicts = test::sample_verdicts();
  verdicts.rules[2].subjects.push_back(verdicts.rules[2].subjects[1]);
  const auto text = verify_text_of(verdicts, test::sample_report());
  const std::string remedy = "Remedy: use the isolated executor";
  EXPECT_NE(text.find(remedy), std::string::npos);
  EXPECT_EQ(text.find(remedy), text.rfind(remedy));
}

// rclcpp has no --executor: the screen's remedy and this one are the same sentence.
TEST(VerifyText, TellsAnApplicationOfRclcppWhatToDoWithRclcpp) {
  auto report = test::sample_report();
  report.processes[0].executor.reset();
  const auto text = verify_text_of(test::sample_verdicts(), report);
  EXPECT_THAT(text, Not(HasSubstr("--executor")));
  EXPECT_THAT(text, HasSubstr("    Remedy: give each callback a callback group of its own and run "
                              "each group on an executor and\n    thread of its own.\n"));
  std::ostringstream screen;
  write_verify_screen(screen, test::sample_verdicts(), report, {}, {});
  EXPECT_THAT(screen.str(), HasSubstr("-> give each callback a callback group of its own and run "
                                      "each group on an executor and thread of\n     its own\n"));
}

TEST(VerifyText, OfSeveralExecutorsTellsTheOneWhoseThreadItWas) {
  auto report = test::sample_report();
  report.processes[0].executor = "isolated+multi_threaded";
  const auto screen = [&report](ThreadRole role) {
    report.threads[1].role = role;
    std::ostringstream out;
    write_verify_screen(out, test::sample_verdicts(), report, {}, {});
    return out.str();
  };
  EXPECT_THAT(screen(ThreadRole::pool), HasSubstr("-> run with --executor isolated\n"));
  EXPECT_THAT(screen(ThreadRole::callback),
              HasSubstr("-> give each callback a callback group of its own\n"));
}

TEST(VerifyText, OfAPassIsShort) {
  analysis::VerdictReport verdicts{.verdict = analysis::Verdict::pass,
                                   .rules = {{.id = "M2",
                                              .name = "one-callback-per-thread",
                                              .verdict = analysis::Verdict::pass,
                                              .subjects = {}}}};
  EXPECT_THAT(verify_text_of(verdicts, test::sample_report()),
              StartsWith("Verdict: PASS\n  passed          M2\n\n14 instances"));
}

TEST(VerifyText, LetsNoNameControlTheTerminalOrTheShell) {
  auto verdicts = test::sample_verdicts();
  verdicts.rules[2].subjects[1].subject = "callback \x1b[2J\n";
  verdicts.rules[2].subjects[1].evidence[0].note = analysis::free_text("\x1b]52;c;evil\x07");
  auto report = test::sample_report();
  report.trace.paths = {"it's; rm -rf $HOME"};
  const auto text = verify_text_of(verdicts, report);
  EXPECT_THAT(text, Not(HasSubstr("\x1b")));
  EXPECT_THAT(text, HasSubstr("callback \\x1b[2J\\x0a"));
  EXPECT_THAT(text, HasSubstr(R"(cie events 'it'\''s; rm -rf $HOME' --window)"));
}

TEST(VerifyText, SaysThatATimeIsNotKnown) {
  auto verdicts = test::sample_verdicts();
  auto& evidence = verdicts.rules[2].subjects[1].evidence;
  evidence[0].time.reset();
  EXPECT_THAT(verify_text_of(verdicts, test::sample_report()),
              AllOf(HasSubstr("    at an unknown time  callback_start  cpu 0  pid 4001"),
                    // From 1 ms before to 1 ms after the other one.
                    HasSubstr("'recordings/run 1' --window 983004187272..983006187272\n")));
  evidence.resize(1);
  EXPECT_THAT(verify_text_of(verdicts, test::sample_report()),
              HasSubstr("    cie events 'recordings/run 1'\n"));
}

// A window is of one clock: `cie events` refuses it of several.
TEST(VerifyText, SuggestsNoWindowForMachinesWithTheirOwnClocks) {
  using namespace analysis;
  auto report = test::sample_report();
  report.hosts = {{.name = "edge", .clock_offset_ns = 5}, {.name = "robot", .clock_offset_ns = 5}};
  EXPECT_THAT(verify_text_of(test::sample_verdicts(), report),
              HasSubstr("cie events 'recordings/run 1' --window"));
  report.hosts[1].shift = Duration{7};
  EXPECT_THAT(verify_text_of(test::sample_verdicts(), report),
              AllOf(HasSubstr("cie events 'recordings/run 1'\n"), Not(HasSubstr("--window"))));
}

TEST(VerifyText, SurvivesTimesAtTheEndsOfTheRange) {
  auto verdicts = test::sample_verdicts();
  verdicts.rules[2].subjects[1].evidence[0].time =
      analysis::Timestamp{std::numeric_limits<std::int64_t>::max()};
  verdicts.rules[2].subjects[1].evidence[1].time =
      analysis::Timestamp{std::numeric_limits<std::int64_t>::min()};
  EXPECT_THAT(
      verify_text_of(verdicts, test::sample_report()),
      AllOf(HasSubstr("at 9223372036854775807 ns"), HasSubstr("cie events 'recordings/run 1'\n")));
}

}  // namespace
}  // namespace cie::viewer_export
