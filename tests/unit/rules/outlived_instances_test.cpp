// Instances that never ended while their process went on.
#include <cie/analysis/rule_pages.hpp>

#include "support/verdicts.hpp"
#include "timer_runs.hpp"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>
#include <variant>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using ::testing::AllOf;
using ::testing::HasSubstr;

// One that hangs, and an audit of another thread's that tells that its process goes on.
TextTrace hanging(const std::string& more = "\n90 audit other",
                  const std::string& process = "process app crash") {
  auto trace =
      trace_of(process + "\ncallback other" + kTwoRuns + "\n42 start fusion release=40" + more);
  for (auto& event : trace.events) {
    if (auto* stream = std::get_if<StreamBegin>(&event.body)) stream->writer = PacketWriter::lttng;
  }
  return trace;
}

TEST(Deadline, FailsForAnInstanceThatItsProcessOutlivesBeyondIt) {
  const auto judged = [](const TextTrace& trace, const char* deadline = "response_deadline: 20") {
    return Verified(trace, spec(deadline)).of("R3", "callback fusion");
  };
  const Verified verified(hanging(), spec("response_deadline: 20"));
  EXPECT_EQ(verified.of("R3", "callback fusion"), Verdict::fail);
  EXPECT_THAT(
      verified.evidence("R3", "callback fusion"),
      AllOf(HasSubstr("42 callback_start seq 2 starts, released at 40 at the latest, and "
                      "has no end"),
            HasSubstr("90  seq 2 is still open here, 50 ns later, as an event of its process "
                      "shows; the deadline is 20 ns")));
  EXPECT_EQ(judged(hanging(), "response_deadline: 49"), Verdict::fail);
  EXPECT_EQ(judged(hanging(), "response_deadline: 50"), Verdict::pass) << "cut by the crash";
  EXPECT_EQ(judged(hanging("\n90 audit other\n95 finish fusion")), Verdict::pass)
      << "it was over when its thread ended";
}

// A system that runs, looked at behind each event: the first time that the deadline is missed.
struct Watched {
  explicit Watched(const TextTrace& trace) {
    const auto text = spec("response_deadline: 20");
    const auto scheduling = SchedulingSpec::parse(text, "app.yaml");
    Analyzer analyzer({.spec = &scheduling, .allow_crash = true, .is_live = true});
    for (const auto& event : trace.events) {
      analyzer.consume(event);
      see(event.head.time, analyzer.look());
    }
    see(trace.events.back().head.time, analyzer.finish());
  }
  void see(Timestamp now, const AnalysisResult& result) {
    for (const auto& callback : result.report.callbacks) {
      if (callback.logical_id == "fusion") open = callback.longest_open;
      if (callback.logical_id == "fusion") late_open = callback.late_open.value_or(0);
    }
    const auto is_missed = [](const RuleVerdict& rule) {
      return rule.id == kDeadlineRule &&
             std::ranges::any_of(rule.subjects, [](const SubjectVerdict& of) {
               return of.verdict == Verdict::fail;
             });
    };
    const bool is_missed_now = std::ranges::any_of(result.verdicts.rules, is_missed);
    if (is_missed_now && !missed_since) missed_since = now.ns;
    if (!is_missed_now && missed_since) is_withdrawn = true;
  }
  std::optional<std::int64_t> missed_since;
  bool is_withdrawn = false;
  Rare<OpenRun> open;
  std::uint64_t late_open = 0;
};

TEST(Deadline, FailsInASystemThatRunsAsSoonAsItsProcessTellsOfItselfBeyondIt) {
  const Watched watched(hanging("\n60 audit other\n61 audit other\n90 audit other"));
  EXPECT_EQ(watched.missed_since, 61) << "released at 40";
  EXPECT_FALSE(watched.is_withdrawn);
  ASSERT_TRUE(watched.open);
  EXPECT_EQ(watched.open->until_end, Duration{90 - 42});
  EXPECT_EQ(watched.open->response_least, Duration{90 - 40});
  EXPECT_EQ(watched.late_open, 1U);
}

TEST(Deadline, IsMissedInASystemThatRunsByWhatEndedTooLate) {
  const Watched watched(hanging("\n61 audit other\n70 end fusion"));
  EXPECT_EQ(watched.missed_since, 61);
  EXPECT_FALSE(watched.is_withdrawn);
  EXPECT_FALSE(watched.open);
  EXPECT_EQ(watched.late_open, 0U);
}

TEST(Deadline, IsMissedInASystemThatRunsUntilTheTotalsTellOfIt) {
  const Watched watched(
      hanging("\n61 audit other\n95 fini fusion\n96 finish fusion", "process app"));
  EXPECT_EQ(watched.missed_since, 61);
  EXPECT_FALSE(watched.is_withdrawn);
  EXPECT_EQ(watched.late_open, 1U);
}

TEST(Deadline, IsNotMissedInASystemThatRunsWhereTheEndMayComeYet) {
  EXPECT_FALSE(Watched(hanging("\n60 audit other")).missed_since) << "in time so far";
  EXPECT_FALSE(Watched(hanging("\n65 discard user until=70 count=1\n90 audit other")).missed_since)
      << "it may be among what was lost";
  auto elsewhere = hanging();
  auto other = *std::get_if<StreamBegin>(&elsewhere.events.front().body);
  other.trace = 1;
  other.channel = 20;
  RunBegin announcement;
  announcement.moment = RunMoment::announce;
  const auto hung = std::ranges::find_if(elsewhere.events, [](const Event& event) {
    return std::holds_alternative<CallbackStart>(event.body) && event.head.time == Timestamp{42};
  });
  auto head = hung->head;
  head.stream = StreamIndex{20};
  announcement.pid = static_cast<std::uint32_t>(*head.pid);
  elsewhere.events.insert(std::next(hung),
                          {{.head = head, .body = other}, {.head = head, .body = announcement}});
  EXPECT_FALSE(Watched(elsewhere).missed_since) << "another session's events come earlier";
}

TEST(Deadline, IsInconclusiveWhereTheEndOfAnOutlivedInstanceMayBeMissing) {
  const auto judged = [](const TextTrace& trace) {
    return Verified(trace, spec("response_deadline: 20"));
  };
  const auto expect_undecided = [&](const TextTrace& trace, const char* why) {
    const auto verified = judged(trace);
    EXPECT_EQ(verified.of("R3", "callback fusion"), Verdict::inconclusive) << why;
    EXPECT_THAT(verified.evidence("R3", "callback fusion"), HasSubstr(why));
  };
  expect_undecided(hanging("\n90 audit other\n60 discard user until=70 count=1"), "discarded");
  expect_undecided(hanging("\n90 audit other\n60 init fusion"), "registered again");
  auto copied = hanging();
  for (auto& event : copied.events) {
    if (auto* stream = std::get_if<StreamBegin>(&event.body)) stream->writer = PacketWriter::copier;
  }
  expect_undecided(copied, "not as LTTng wrote it");
  expect_undecided(beside_stream(hanging(), std::nullopt, 55),
                   "a stream ends here, before the deadline of seq 2");
  // Its end may be of another CPU, where older packets were overwritten, as in a snapshot.
  expect_undecided(beside_stream(hanging(), 45, std::nullopt), "begins 3 ns later");
}

TEST(Deadline, FailsForAnOutlivedInstanceWhereAllStreamsBeganBeforeIt) {
  EXPECT_EQ(Verified(beside_stream(hanging(), 42, std::nullopt), spec("response_deadline: 20"))
                .of("R3", "callback fusion"),
            Verdict::fail);
}

}  // namespace
}  // namespace cie::test
