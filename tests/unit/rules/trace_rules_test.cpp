#include "support/verdicts.hpp"

#include <algorithm>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kOneCallback = R"(
  callback fusion subscription topic=/points
  10 release fusion
  12 start fusion
  20 end fusion
  30 release fusion
  32 start fusion
  40 end fusion)";

std::string with(const std::string& more) { return std::string(kOneCallback) + '\n' + more; }

TEST(TraceReadable, IsInconclusiveWhenAPacketWasSkipped) {
  EXPECT_EQ(Verified(kOneCallback)["T1"], Verdict::pass);
  const Verified damaged(with("25 damage user"));
  EXPECT_EQ(damaged.of("T1", "trace"), Verdict::inconclusive);
  EXPECT_THAT(damaged.evidence("T1", "trace"), HasSubstr("cut short"));
}

TEST(TraceReadable, PrintsNoTimeThatIsNotKnown) {
  EXPECT_THAT(Verified(with("25 damage user until=30")).evidence("T1", "trace"),
              HasSubstr("user-space events, an unknown number, lost within 5 ns"));
  EXPECT_THAT(Verified(with("25 damage user until=9223372036854775807")).evidence("T1", "trace"),
              HasSubstr("user-space events, an unknown number, lost, until when is not known"));
  EXPECT_EQ(
      Verified(with("0 damage user until=30")).evidence("T1", "trace"),
      "? damaged_packet cut short; user-space events, an unknown number, lost before 30 ns\n");
  EXPECT_EQ(Verified(with("0 damage user until=9223372036854775807")).evidence("T1", "trace"),
            "? damaged_packet cut short; user-space events, an unknown number, lost, when is not "
            "known\n");
}

TEST(NoLoss, PassesAndNamesALossThatCostNobodyHisProof) {
  const Verified verified(with("22 discard user until=28 count=7"));
  EXPECT_EQ(verified.of("T2", "trace"), Verdict::pass);
  EXPECT_THAT(verified.evidence("T2", "trace"),
              HasSubstr("22 discarded_events 7 user-space events lost within 6 ns"));
  EXPECT_EQ(verified["M2"], Verdict::pass) << "numbers prove that the callback lost nothing";
}

// Each buffer is made larger by an option of its own.
TEST(NoLoss, IsMendedByTheBuffersThatWereFull) {
  const auto advice = [](const std::string& losses) {
    const auto defects = analyze(trace_of(with(losses))).report.defects;
    const auto found = std::ranges::find(defects, DefectKind::discarded_events, &TraceDefect::kind);
    return found == defects.end() ? std::string() : found->advice;
  };
  const std::string user = "22 discard user until=28 count=7";
  const std::string kernel = "22 discard kernel until=28 count=7";
  EXPECT_THAT(advice(user), AllOf(HasSubstr("--subbuf-size"), Not(HasSubstr("--kernel-buffer"))));
  EXPECT_THAT(advice(kernel), AllOf(HasSubstr("--kernel-buffer"), Not(HasSubstr("--subbuf-size"))));
  EXPECT_THAT(advice(user + "\n" + kernel),
              AllOf(HasSubstr("--subbuf-size"), HasSubstr("--kernel-buffer")));
}

TEST(NoLoss, IsInconclusiveWhenACallbackLostInstances) {
  auto trace = trace_of(with("31 discard user until=41 count=2"));
  trace.erase<CallbackStart>([](const CallbackStart& e, const EventHead&) { return e.seq == 1; });
  trace.erase<CallbackEnd>([](const CallbackEnd& e, const EventHead&) { return e.seq == 1; });
  const Verified verified(trace);
  EXPECT_EQ(verified["T2"], Verdict::inconclusive);
  EXPECT_EQ(verified["M2"], Verdict::inconclusive);
}

TEST(NoLoss, FailsOnAnyLossWhenAskedTo) {
  AnalysisOptions strict;
  strict.require_lossless = true;
  EXPECT_EQ(Verified(trace_of(kOneCallback), {}, strict)["T2"], Verdict::pass);
  EXPECT_EQ(Verified(trace_of(with("22 discard user until=28 count=1")), {}, strict)["T2"],
            Verdict::fail);
}

TEST(RequiredEvents, NamesWhatIsAbsentAndHowToEnableIt) {
  EXPECT_EQ(Verified(kOneCallback)["T5"], Verdict::pass);
  auto trace = trace_of(kOneCallback);
  trace.erase<ThreadInit>();
  const Verified verified(trace);
  EXPECT_EQ(verified["T5"], Verdict::inconclusive);
  EXPECT_THAT(verified.evidence("T5", "trace"), HasSubstr("enable cie:thread_init"));
}

TEST(RequiredEvents, AdvisesToEnableNothingThatTheTotalsSayNeverHappened) {
  const Verified verified("process idle pid=100");
  EXPECT_EQ(verified["T5"], Verdict::inconclusive);
  EXPECT_THAT(verified.evidence("T5", "trace"),
              AllOf(HasSubstr("no application registered a callback"), Not(HasSubstr("enable"))));
}

TEST(RequiredEvents, AdvisesToEnableNothingThatMayBeLost) {
  auto trace = trace_of(with("25 damage user"));
  trace.erase<ThreadInit>();
  const Verified verified(trace);
  EXPECT_EQ(verified["T5"], Verdict::inconclusive);
  EXPECT_THAT(verified.evidence("T5", "trace"),
              AllOf(HasSubstr("no thread_init in it; it may be among the events that are lost"),
                    Not(HasSubstr("enable"))));
}

TEST(RequiredEvents, AsksForApplicationsWhereOnlyTheKernelIsRecorded) {
  auto trace = trace_of("kernel\n" + with("50 switch 0 fusion idle prio=19"));
  std::erase_if(trace.events, [](const Event& event) {
    const auto category = category_of(event.body);
    return category != EventCategory::structure && category != EventCategory::system;
  });
  const Verified verified(trace);
  EXPECT_EQ(verified["T5"], Verdict::inconclusive);
  EXPECT_THAT(verified.evidence("T5", "trace"), HasSubstr("no events of applications in it"));
}

TEST(RequiredEvents, IsInconclusiveWhereNoRunLiesWithinTheWindow) {
  auto trace = trace_of(kOneCallback);
  for (auto& event : trace.events) {
    if (std::holds_alternative<PacketBegin>(event.body)) event.head.time = Timestamp{1'000};
    if (std::holds_alternative<PacketEnd>(event.body)) event.head.time = Timestamp{2'000};
  }
  const Verified verified(trace);
  EXPECT_EQ(verified["T5"], Verdict::inconclusive);
  EXPECT_THAT(verified.evidence("T5", "trace"), HasSubstr("no instance of a callback lies within"));
}

TEST(RequiredEvents, NamesMissingContexts) {
  auto trace = trace_of(kOneCallback);
  for (auto& event : trace.events)
    event.head.tid.reset();
  const Verified verified(trace);
  EXPECT_EQ(verified["T5"], Verdict::inconclusive);
  EXPECT_THAT(verified.evidence("T5", "trace"), HasSubstr("--type=vtid"));
  EXPECT_EQ(verified["M2"], Verdict::inconclusive);
  EXPECT_EQ(verified["M3"], Verdict::inconclusive);
}

TEST(RequiredEvents, WithoutAVpidNothingIsOfAnyProcessAndNoRulePasses) {
  auto trace = trace_of(kOneCallback);
  for (auto& event : trace.events) {
    if (!std::holds_alternative<RunBegin>(event.body)) event.head.pid.reset();
  }
  const Verified verified(trace);
  EXPECT_THAT(verified.evidence("T5", "trace"), HasSubstr("--type=vpid"));
  EXPECT_THAT(verified.evidence("T5", "trace"),
              Not(HasSubstr("no instance of a callback lies within")));
  EXPECT_THAT(verified.evidence("T4", "process 100"),
              HasSubstr("its run_end may be among the events without a vpid"));
  for (const auto* rule : {"M2", "M3", "M4", "E1", "E2", "E3", "R1"}) {
    EXPECT_EQ(verified[rule], Verdict::inconclusive) << rule;
    EXPECT_THAT(verified.evidence(rule, "trace"), HasSubstr("without the context vpid")) << rule;
  }
  EXPECT_EQ(verified["R5"], Verdict::not_applicable) << "no spec asks for a rate";
}

TEST(TimeSane, FailsWhenTimeRunsBackwards) {
  EXPECT_EQ(Verified(kOneCallback)["T6"], Verdict::pass);
  const Verified verified(with("25 regress previous=33"));
  EXPECT_EQ(verified["T6"], Verdict::fail);
  EXPECT_THAT(verified.evidence("T6", "trace"), HasSubstr("33 time_regression"));
  EXPECT_THAT(verified.evidence("T6", "trace"), HasSubstr("25 time_regression"));
  EXPECT_THAT(verified.evidence("T6", "trace"), HasSubstr("the stream had come to 33 ns"));
  EXPECT_THAT(verified.evidence("T6", "trace"),
              HasSubstr("it went back by 8 ns, to 25 ns; 1 time in all"));
}

TEST(TimeSane, IsInconclusiveWhenClocksAreOfDifferentBoots) {
  auto trace = trace_of(with("kernel"));
  for (auto& event : trace.events) {
    auto* stream = std::get_if<StreamBegin>(&event.body);
    if (stream != nullptr && stream->domain == Domain::kernel) stream->clock_uuid = "other boot";
  }
  EXPECT_EQ(Verified(trace)["T6"], Verdict::inconclusive);
}

TEST(TimeSane, IsInconclusiveWhenAReleaseLiesBehindItsStart) {
  const auto verified = [](const std::string& release) {
    return Verified("callback fusion\n12 start fusion release=" + release + "\n15 end fusion");
  };
  EXPECT_EQ(verified("12")["T6"], Verdict::pass);
  for (const auto* release : {"13", "15", "17"}) {
    const auto late = verified(release);
    EXPECT_EQ(late["T6"], Verdict::inconclusive) << release;
    EXPECT_THAT(late.evidence("T6", "trace"), HasSubstr("12 callback_start fusion seq 0 tells"));
    const auto& defects = late.result.report.defects;
    EXPECT_EQ(std::ranges::count(defects, DefectKind::impossible_releases, &TraceDefect::kind), 1);
  }
  EXPECT_THAT(verified("17").evidence("T6", "trace"), HasSubstr("a release 5 ns after its start"));
}

// Every number and total agrees: what was lost costs no proof, but what M4 is decided by.
TEST(NoLoss, IsInconclusiveWhereALossLeavesARuleUndecided) {
  constexpr auto kMoved = R"(
    callback fusion pooled
    thread t1 callback of=fusion tid=101
    thread t2 callback of=fusion tid=102
    10 start fusion on=t1
    12 end fusion on=t1
    14 finish t1
    20 begin t2
    30 start fusion on=t2
    32 end fusion on=t2)";
  const auto judged = [&](const std::string& loss) { return Verified(kMoved + loss); };
  const auto beside = judged("\n40 discard user until=42 count=1");
  EXPECT_EQ(beside["M4"], Verdict::fail);
  EXPECT_EQ(beside["T2"], Verdict::pass);
  const auto between = judged("\n16 discard user until=18 count=1");
  EXPECT_EQ(between["M4"], Verdict::inconclusive);
  EXPECT_EQ(between["T2"], Verdict::inconclusive);
  EXPECT_THAT(between.evidence("T2", "trace"), HasSubstr("1 user-space event lost"));
}

}  // namespace
}  // namespace cie::test
