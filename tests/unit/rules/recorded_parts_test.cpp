// What manifests say was recorded, held against what was seen: T1, T2 and law L7.
#include "support/verdicts.hpp"

#include <algorithm>
#include <cstdint>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using ::testing::HasSubstr;

constexpr std::int64_t kFirst = 100;
constexpr std::int64_t kSecond = 200;

// The second process breaks M2 in the thread of its timer.
constexpr const char* kTwoProcesses = R"(
  process first pid=100
  callback fusion subscription topic=/points
  process second pid=200
  callback tick timer
  callback tock timer pooled
  10 release fusion
  12 start fusion
  20 end fusion
  30 start tick
  32 end tick
  34 start tock on=tick
  36 end tock on=tick)";

RecordingManifest manifest_of(const std::vector<std::int64_t>& pids) {
  RecordingManifest manifest;
  for (const auto pid : pids)
    manifest.processes.push_back({.pid = pid, .name = "app", .start_ns = std::nullopt});
  return manifest;
}

Recording recording_of(const RecordingManifest& manifest) {
  return {.name = "run1", .manifest = manifest};
}

struct Judged : Verified {
  using Verified::Verified;
  Judged(const TextTrace& trace, const RecordingManifest& manifest)
      : Judged(trace, std::vector{recording_of(manifest)}) {}
};

// As if ROS 2's events told all of it: they have neither numbers nor totals.
void derive(TextTrace& trace) {
  for (auto& event : trace.events)
    event.head.is_derived = true;
  trace.erase<RunBegin>();
  trace.erase<RunEnd>();
  trace.erase<CallbackFini>();
}

TextTrace without(std::int64_t pid) {
  auto trace = trace_of(kTwoProcesses);
  std::erase_if(trace.events, [pid](const Event& event) { return event.head.pid == pid; });
  return trace;
}

bool has_defect(const Report& report, std::string_view kind) {
  return std::ranges::any_of(
      report.defects, [kind](const TraceDefect& defect) { return label(defect.kind) == kind; });
}

TEST(RecordedParts, AllOfThemCostNothing) {
  const Judged judged(trace_of(kTwoProcesses), manifest_of({kFirst, kSecond}));
  EXPECT_EQ(judged["T1"], Verdict::pass);
  EXPECT_EQ(judged["T2"], Verdict::pass);
  EXPECT_EQ(judged["M2"], Verdict::fail);
  EXPECT_EQ(judged.of("E1", "trace"), Verdict::not_applicable);
  EXPECT_TRUE(judged.result.report.trace.complete);
}

TEST(RecordedParts, AProcessOfWhichNothingIsThereIsNamed) {
  const Judged judged(without(kSecond), manifest_of({kFirst, kSecond}));
  EXPECT_EQ(judged["T2"], Verdict::inconclusive);
  EXPECT_THAT(judged.evidence("T2", "trace"), HasSubstr("process app (200) was recorded"));
  EXPECT_THAT(judged.evidence("T2", "trace"), HasSubstr("run1"));
  EXPECT_FALSE(judged.result.report.trace.complete);
  EXPECT_TRUE(has_defect(judged.result.report, "unseen-process"));
}

TEST(RecordedParts, AnotherLifetimeOfThePidIsAnotherProcess) {
  auto manifest = manifest_of({kFirst, kSecond});
  const auto trace = trace_of(kTwoProcesses);
  for (const auto& event : trace.events) {
    const auto* begin = std::get_if<RunBegin>(&event.body);
    if (begin == nullptr) continue;
    manifest.processes[event.head.pid == kFirst ? 0 : 1].start_ns = begin->process_start_ns;
  }
  EXPECT_EQ(Judged(trace, manifest)["T2"], Verdict::pass);
  ++*manifest.processes[1].start_ns;
  EXPECT_EQ(Judged(trace, manifest)["T2"], Verdict::inconclusive);
}

// L7, for each process that is taken away.
TEST(RecordedParts, NoRulePassesInPlaceOfWhatIsMissing) {
  const auto whole = manifest_of({kFirst, kSecond});
  const Judged full(trace_of(kTwoProcesses), whole);
  for (const auto pid : {kFirst, kSecond}) {
    const Judged reduced(without(pid), whole);
    EXPECT_NE(reduced.result.verdicts.verdict, Verdict::pass);
    for (const auto& rule : full.result.verdicts.rules) {
      const bool had_passed = rule.verdict <= Verdict::pass;
      const bool passes = reduced[rule.id] <= Verdict::pass;
      EXPECT_TRUE(had_passed || !passes) << rule.id << " without process " << pid;
    }
  }
}

TEST(RecordedParts, WhatIsLeftIsJudgedAsEver) {
  const Judged judged(without(kSecond), manifest_of({kFirst, kSecond}));
  EXPECT_EQ(judged.of("E1", "callback fusion"), Verdict::pass);
  EXPECT_EQ(judged.of("E1", "trace"), Verdict::inconclusive);
  const Judged other(without(kFirst), manifest_of({kFirst, kSecond}));
  EXPECT_EQ(other["M2"], Verdict::fail) << "the witness is there";
}

TEST(RecordedParts, WhatMayBeInTheMissingPartWasNotProvenAbsent) {
  const auto spec = SchedulingSpec::parse(R"(
callback_groups:
  - id: tick
  - id: fusion
)",
                                          "spec.yaml");
  const Judged judged(without(kSecond), {recording_of(manifest_of({kFirst, kSecond}))}, &spec);
  EXPECT_EQ(judged.of("M1", "callback tick"), Verdict::inconclusive);
  EXPECT_EQ(judged.of("M1", "callback fusion"), Verdict::pass);
  const Judged alone(without(kSecond), {recording_of(manifest_of({kFirst}))}, &spec);
  EXPECT_EQ(alone.of("M1", "callback tick"), Verdict::fail) << "it was never there";
}

// L7: what its numbers and totals would have told is missing with a process.
TEST(RecordedParts, NoRuleOfTheTraceItselfPassesInPlaceOfWhatIsMissing) {
  const Judged judged(without(kSecond), manifest_of({kFirst, kSecond}));
  for (const auto* rule : {"T3", "T4", "T6"})
    EXPECT_EQ(judged[rule], Verdict::inconclusive) << rule;
  EXPECT_THAT(judged.evidence("T3", "trace"), HasSubstr("not all that was recorded is here"));
}

TEST(RecordedParts, EventsOfTheKernelThatAreMissingAreNamed) {
  auto manifest = manifest_of({kFirst, kSecond});
  manifest.has_kernel_events = true;
  const Judged judged(trace_of(kTwoProcesses), manifest);
  EXPECT_EQ(judged["T2"], Verdict::inconclusive);
  EXPECT_THAT(judged.evidence("T2", "trace"), HasSubstr("events of the kernel were recorded"));
  EXPECT_EQ(judged["E1"], Verdict::pass) << "what user space shows is decided without them";
  const auto with_kernel = std::string(kTwoProcesses) + "\n kernel\n 11 switch 0 idle fusion";
  EXPECT_EQ(Judged(trace_of(with_kernel), manifest)["T2"], Verdict::pass);
  manifest.kernel.events = 0;
  EXPECT_EQ(Judged(trace_of(kTwoProcesses), manifest)["T2"], Verdict::pass)
      << "an idle machine has none";
}

// L7 holds of each rule, for who chooses one of them: the kernel alone may have shown why it fails.
TEST(RecordedParts, NoRulePassesInPlaceOfWhatTheKernelAloneShows) {
  auto manifest = manifest_of({kFirst});
  manifest.has_kernel_events = true;
  constexpr const char* kReadBack = R"(
    process first pid=100
    callback fusion
    -100 initial fusion
    -90 applied fusion policy=fifo priority=80
    10 start fusion
    12 end fusion
    30 audit fusion policy=fifo priority=80)";
  const auto kernel = std::string(kReadBack) + "\n 9 switch 2 idle fusion next_prio=20";
  const Judged whole(trace_of(kernel), manifest);
  const Judged reduced(trace_of(kReadBack), manifest);
  for (const auto* rule : {"S3", "S4"}) {
    EXPECT_EQ(whole[rule], Verdict::fail) << rule;
    EXPECT_EQ(reduced[rule], Verdict::inconclusive) << rule;
    EXPECT_EQ(reduced.of(rule, "thread 101"), Verdict::pass) << rule << " by what was read back";
    EXPECT_EQ(Judged(trace_of(kReadBack), manifest_of({kFirst}))[rule], Verdict::pass) << rule;
  }
  EXPECT_EQ(reduced["S5"], Verdict::inconclusive);
}

TEST(RecordedParts, FilesThatAreNotWhatTheyWereAreNamed) {
  auto recording = recording_of(manifest_of({kFirst, kSecond}));
  recording.doubts = {{.kind = FileDoubtKind::missing_file,
                       .note = "ust/events_1 is missing",
                       .costs_user_events = true}};
  const Judged judged(trace_of(kTwoProcesses), {recording});
  EXPECT_EQ(judged["T1"], Verdict::inconclusive);
  EXPECT_THAT(judged.evidence("T1", "trace"),
              HasSubstr("missing_file ust/events_1 is missing (run1)"));
  EXPECT_EQ(judged.of("E1", "trace"), Verdict::inconclusive);
  EXPECT_EQ(judged["M2"], Verdict::fail);
  EXPECT_FALSE(judged.result.report.trace.complete);
}

TEST(RecordedParts, AFileOfTheKernelCostsNoOtherRule) {
  auto recording = recording_of(manifest_of({kFirst, kSecond}));
  recording.doubts = {{.kind = FileDoubtKind::missing_file, .note = "kernel/sched_1 is missing"}};
  const Judged judged(trace_of(kTwoProcesses), {recording});
  EXPECT_EQ(judged["T1"], Verdict::inconclusive);
  EXPECT_EQ(judged["E1"], Verdict::pass);
}

TEST(RecordedParts, OfMoreFilesThanCanBeReadOnlySomeAreNamed) {
  auto recording = recording_of(manifest_of({kFirst, kSecond}));
  for (int i = 0; i < 40; ++i) {
    recording.doubts.push_back(
        {.kind = FileDoubtKind::missing_file, .note = std::to_string(i) + " is missing"});
  }
  const Judged judged(trace_of(kTwoProcesses), {recording});
  EXPECT_EQ(judged.on("T1", "trace").evidence.size(), 33U);
  EXPECT_THAT(judged.evidence("T1", "trace"), HasSubstr("and 8 more files"));
}

std::vector<Recording> chunks(const std::vector<std::uint64_t>& numbers) {
  std::vector<Recording> recordings;
  for (const auto number : numbers) {
    auto manifest = manifest_of({kFirst, kSecond});
    manifest.chunk = number;
    manifest.begin = {.monotonic_ns = static_cast<std::int64_t>(number) * 1000, .realtime_ns = 0};
    recordings.push_back(
        {.name = "run1/chunk-00000" + std::to_string(number), .manifest = manifest});
  }
  return recordings;
}

TEST(RecordedParts, NothingIsCompleteWhoseFirstChunkIsGone) {
  const auto trace = trace_of(kTwoProcesses);
  EXPECT_TRUE(Judged(trace, chunks({1, 2, 3})).result.report.trace.complete);
  const Judged late(trace, chunks({2, 3}));
  EXPECT_EQ(late["T2"], Verdict::pass) << "the oldest may have been removed, as --keep does";
  EXPECT_FALSE(late.result.report.trace.complete);
  EXPECT_TRUE(has_defect(late.result.report, "begins-late"));
  ASSERT_EQ(late.result.report.recordings.size(), 1U);
  EXPECT_EQ(late.result.report.recordings[0].path, "run1");
  EXPECT_EQ(late.result.report.recordings[0].first_chunk, 2U);
  EXPECT_EQ(late.result.report.recordings[0].begin.monotonic_ns, 2000);
}

// A process that ended in a chunk before registered it there.
TEST(RecordedParts, WhatMayBeInEarlierChunksWasNotProvenAbsent) {
  const auto spec = SchedulingSpec::parse("callback_groups:\n  - id: gone\n", "spec.yaml");
  const auto trace = trace_of(kTwoProcesses);
  EXPECT_EQ(Judged(trace, chunks({1, 2}), &spec).of("M1", "callback gone"), Verdict::fail);
  const Judged late(trace, chunks({2}), &spec);
  EXPECT_EQ(late.of("M1", "callback gone"), Verdict::inconclusive);
  EXPECT_THAT(late.evidence("M1", "callback gone"), HasSubstr("chunks before were not read"));
}

TEST(RecordedParts, AChunkBetweenOthersWasRecorded) {
  const Judged judged(trace_of(kTwoProcesses), chunks({1, 2, 5}));
  EXPECT_EQ(judged["T2"], Verdict::inconclusive);
  EXPECT_THAT(judged.evidence("T2", "trace"), HasSubstr("chunks 3 to 4 were recorded"));
}

TEST(RecordedParts, ChunksThatTheWholeNamesAreMissed) {
  auto recordings = chunks({2, 3});
  auto whole = recording_of(manifest_of({kFirst, kSecond}));
  whole.manifest->removed_chunks = 0;
  whole.manifest->problems = {"the disk was full"};
  whole.manifest->exit = RecordedExit{.code = 3, .signal = std::nullopt};
  whole.missing_chunks = {"chunk-000001"};
  recordings.push_back(whole);
  const Judged judged(trace_of(kTwoProcesses), recordings);
  EXPECT_EQ(judged["T2"], Verdict::inconclusive);
  EXPECT_THAT(judged.evidence("T2", "trace"), HasSubstr("chunk-000001 was recorded"));
  ASSERT_EQ(judged.result.report.recordings.size(), 1U);
  const auto& report = judged.result.report.recordings[0];
  EXPECT_EQ(report.problems, std::vector<std::string>{"the disk was full"});
  EXPECT_EQ(report.exit->code, 3);
  EXPECT_EQ(report.first_chunk, 2U);
  EXPECT_TRUE(has_defect(judged.result.report, "recorder-problem"));
}

TEST(RecordedParts, AManifestOfNoUseIsADoubt) {
  const Recording damaged{
      .name = "run1",
      .manifest = std::nullopt,
      .doubts = {{.kind = FileDoubtKind::manifest, .note = "it is no JSON: byte 7"}}};
  const Judged judged(trace_of(kTwoProcesses), {damaged});
  EXPECT_EQ(judged["T1"], Verdict::inconclusive);
  EXPECT_EQ(judged["E1"], Verdict::pass);
  EXPECT_TRUE(has_defect(judged.result.report, "damaged-manifest"));
}

// What a tracer discarded last, no packet tells; its manifest does.
TEST(LossOfManifest, IsALossWhereNoneIsAllowed) {
  auto manifest = manifest_of({kFirst, kSecond});
  const auto t2 = [&](bool is_file_missing) {
    AnalysisOptions options;
    options.require_lossless = true;
    Analyzer analyzer(options);
    auto recording = recording_of(manifest);
    if (is_file_missing) {
      recording.doubts.push_back(
          {.kind = FileDoubtKind::missing_file, .note = "ust/channel_1 is missing"});
    }
    analyzer.add({recording});
    const auto trace = trace_of(kTwoProcesses);
    for (const auto& event : trace.events)
      analyzer.consume(event);
    const auto result = analyzer.finish();
    return std::ranges::find(result.verdicts.rules, "T2", &RuleVerdict::id)->verdict;
  };
  EXPECT_EQ(t2(false), Verdict::pass);
  EXPECT_EQ(t2(true), Verdict::inconclusive) << "it may have told of a loss (L7)";
  manifest.channels.push_back({.name = "cie", .discarded_events = 3, .lost_packets = 0});
  EXPECT_EQ(t2(false), Verdict::fail);
}

// A pass of what is here beside the doubt of what is not would be two verdicts of one subject.
TEST(RecordedParts, TheTraceHasOneVerdictOfARule) {
  auto recording = recording_of(manifest_of({kFirst, kSecond}));
  recording.doubts = {{.kind = FileDoubtKind::missing_file,
                       .note = "ust/events_1 is missing",
                       .costs_user_events = true}};
  const Judged judged(trace_of(kTwoProcesses), {recording});
  for (const auto& rule : judged.result.verdicts.rules) {
    EXPECT_LE(std::ranges::count(rule.subjects, "trace", &SubjectVerdict::subject), 1) << rule.id;
    if (rule.id == "T5" || rule.id == "T6") {
      EXPECT_EQ(rule.verdict, Verdict::inconclusive) << rule.id;
      EXPECT_GE(rule.subjects.front().checked, 1U) << rule.id;
    }
  }
}

// The second start may have come after an end that is in the missing part.
TEST(RecordedParts, AFailureOfWhatIsAbsentNeedsTotals) {
  auto trace = trace_of(
      "process first pid=100\ncallback fusion subscription topic=/points\n"
      "10 release fusion\n12 start fusion\n14 start fusion\n"
      "16 end fusion seq=0\n18 end fusion seq=1");
  const auto seen = manifest_of({kFirst});
  const auto missing = manifest_of({kFirst, kSecond});
  EXPECT_EQ(Judged(trace, missing).of("E2", "callback fusion"), Verdict::fail) << "totals tell";
  derive(trace);
  EXPECT_EQ(Judged(trace, seen).of("E2", "callback fusion"), Verdict::fail);
  EXPECT_EQ(Judged(trace, missing).of("E2", "callback fusion"), Verdict::inconclusive);
}

// What looks like one long run may be the start of one and the end of the next.
TEST(RecordedParts, ALongRunNeedsTotals) {
  auto trace = trace_of(R"(
    process first pid=100
    callback fusion subscription topic=/points deadline=5 cpu=0
    11 switch 0 idle fusion
    12 start fusion release=10
    20 end fusion
    21 switch 0 fusion idle)");
  const auto spec =
      SchedulingSpec::parse("callback_groups: [{id: fusion, wcet: 5}]\n", "spec.yaml");
  const auto missing = manifest_of({kFirst, kSecond});
  for (const auto* rule : {"R3", "R4"})
    EXPECT_EQ(Judged(trace, {recording_of(missing)}, &spec).of(rule, "callback fusion"),
              Verdict::fail)
        << rule;
  derive(trace);
  for (const auto* rule : {"R3", "R4"}) {
    EXPECT_EQ(
        Judged(trace, {recording_of(manifest_of({kFirst}))}, &spec).of(rule, "callback fusion"),
        Verdict::fail)
        << rule;
    EXPECT_EQ(Judged(trace, {recording_of(missing)}, &spec).of(rule, "callback fusion"),
              Verdict::inconclusive)
        << rule;
  }
}

}  // namespace
}  // namespace cie::test
