// Recorders that failed or did not end: how much they did not write nobody knows, unless totals tell (T2, T4, law L7).
#include "support/verdicts.hpp"

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kDaemonDied = "the session daemon ended during the recording";

constexpr const char* kApplication = R"(
  process app pid=100
  callback fusion subscription topic=/points
  10 release fusion
  12 start fusion
  20 end fusion
  30 release fusion
  32 start fusion
  40 end fusion)";

TextTrace whole() { return trace_of(kApplication); }

// Its recorder wrote no more, or the process crashed: the trace does not tell which.
TextTrace without_end() {
  const std::string text = kApplication;
  return trace_of("process app pid=100 crash\n" + text.substr(text.find("  callback")));
}

Recording failed(const std::vector<std::string>& problems) {
  RecordingManifest manifest;
  manifest.command = {"app"};
  manifest.exit = RecordedExit{.code = 0, .signal = std::nullopt};
  manifest.processes = {{.pid = 100, .name = "app", .start_ns = std::nullopt}};
  manifest.problems = problems;
  return {.name = "run1", .manifest = manifest};
}

Recording unfinished() { return {.name = "run1", .is_unfinished = true}; }

Verified judged(const TextTrace& trace, const Recording& recording,
                const AnalysisOptions& options = {}) {
  Analyzer analyzer(options);
  analyzer.add({recording});
  for (const auto& event : trace.events)
    analyzer.consume(event);
  Verified verified(trace);
  verified.result = analyzer.finish();
  return verified;
}

const AnalysisOptions kLenient{.require_lossless = true, .allow_crash = true};

TEST(RecorderFailures, LeaveUndecidedWhateverIsAllowed) {
  for (const auto& recording : {failed({kDaemonDied}), unfinished()}) {
    const auto told = judged(without_end(), recording, kLenient);
    EXPECT_EQ(told.result.verdicts.verdict, Verdict::inconclusive);
    for (const auto* rule : {"T2", "T4", "M2", "E1"})
      EXPECT_EQ(told[rule], Verdict::inconclusive) << rule;
    for (const auto* rule : {"T1", "T6"})
      EXPECT_EQ(told[rule], Verdict::pass) << rule << ": what is here is sound";
    EXPECT_FALSE(told.result.report.trace.complete);
    EXPECT_FALSE(told.result.report.trace.lost_events) << "nobody knows how many";
  }
}

TEST(RecorderFailures, AreNamedWhereALossIs) {
  EXPECT_THAT(judged(without_end(), failed({kDaemonDied})).evidence("T2", "trace"),
              AllOf(HasSubstr(kDaemonDied), HasSubstr("run1")));
  EXPECT_THAT(judged(without_end(), unfinished()).evidence("T2", "trace"),
              HasSubstr("the recording is not finished: it goes on, its recorder was killed"));
}

TEST(RecorderFailures, AreNoCrashOfTheApplication) {
  const auto told = judged(without_end(), failed({kDaemonDied}), kLenient);
  EXPECT_EQ(told.of("T4", "process 100"), Verdict::inconclusive);
  EXPECT_THAT(told.evidence("T4", "process 100"),
              AllOf(HasSubstr("though the command exited with status 0"), HasSubstr(kDaemonDied),
                    Not(HasSubstr("by a crash"))));
  EXPECT_EQ(told.on("T4", "process 100").evidence.front().note.code,
            "end-not-recorded-though-exited")
      << "no option lifts it";
}

TEST(RecorderFailures, ExcuseNoCrashThatTheManifestProves) {
  auto recording = failed({kDaemonDied});
  recording.manifest->exit = RecordedExit{.code = std::nullopt, .signal = 11};
  const auto told = judged(without_end(), recording, kLenient);
  EXPECT_EQ(told.of("T4", "process 100"), Verdict::pass) << "it is what --allow-crash is for";
  EXPECT_EQ(told["T2"], Verdict::inconclusive) << "and what else is lost is unknown as before";
}

TEST(RecorderFailures, CostNothingWhereTotalsProveThatAllIsHere) {
  const auto told = judged(whole(), failed({"cannot ask how many events were discarded"}));
  EXPECT_EQ(told.result.verdicts.verdict, Verdict::pass);
  EXPECT_THAT(told.evidence("T2", "trace"), HasSubstr("cannot ask how many")) << "but are named";
  EXPECT_EQ(told.result.report.trace.lost_events, 0U);
}

TEST(RecorderFailures, MayHideAProcessThatNobodyNames) {
  auto recording = failed({kDaemonDied});
  recording.manifest->names_all_processes = false;
  EXPECT_EQ(judged(whole(), recording)["T2"], Verdict::inconclusive);
  EXPECT_EQ(judged(whole(), unfinished())["T2"], Verdict::inconclusive);
}

// What was lost between two lifetimes may be all of another one, unless the manifest names every process.
TEST(RecorderFailures, NoLossHidesALifetimeWhereTheManifestNamesAll) {
  const auto trace = trace_of(R"(
    process app pid=100 until=100
    callback a id=/n@Timer timer period=10
    process later pid=200 from=1000
    callback b id=/n@Timer timer period=10
    1 initial a
    2 applied a policy=fifo priority=50
    10 start a
    12 end a
    500 discard user until=600 count=4
    1101 initial b
    1102 applied b policy=fifo priority=50
    1110 start b
    1112 end b)");
  auto recording = failed({});
  recording.manifest->processes.push_back({.pid = 200, .name = "later", .start_ns = std::nullopt});
  EXPECT_EQ(judged(trace, recording)["M5"], Verdict::pass);
  recording.manifest->names_all_processes = false;
  EXPECT_EQ(judged(trace, recording)["M5"], Verdict::inconclusive);
}

// L6: a kernel trace that is not whole costs nothing that the application's events decide.
TEST(RecorderFailures, OfTheKernelsRecordCostNoEventOfApplications) {
  auto recording = failed({});
  recording.manifest->kernel.problems = {"cannot read the kernel's buffers"};
  const auto told = judged(without_end(), recording, {.allow_crash = true});
  const auto sound = judged(without_end(), failed({}), {.allow_crash = true});
  for (const auto& rule : sound.result.verdicts.rules)
    EXPECT_EQ(told[rule.id], rule.verdict) << rule.id;
  EXPECT_EQ(told.result.report.recordings.at(0).problems, recording.manifest->kernel.problems);
}

TEST(RecorderFailures, AreToldOnceEach) {
  const auto told = judged(without_end(), failed({kDaemonDied, "the disk was full", kDaemonDied}));
  const auto& report = told.result.report;
  EXPECT_EQ(report.recordings.at(0).problems,
            (std::vector<std::string>{kDaemonDied, "the disk was full"}));
  EXPECT_EQ(std::ranges::count(report.defects, DefectKind::recorder_problem, &TraceDefect::kind),
            2);
  EXPECT_EQ(told.on("T2", "trace").evidence.size(), 2U);
}

}  // namespace
}  // namespace cie::test
