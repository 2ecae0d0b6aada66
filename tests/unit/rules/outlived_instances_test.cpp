// Instances that never ended while their process went on.
#include "support/verdicts.hpp"
#include "timer_runs.hpp"

#include <algorithm>
#include <cstdint>
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
TextTrace hanging(const std::string& more = "\n90 audit other") {
  auto trace = trace_of("process app crash\ncallback other" + std::string(kTwoRuns) +
                        "\n42 start fusion release=40" + more);
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
  AnalysisOptions live;
  live.is_live = true;
  EXPECT_NE(Verified(hanging(), spec("response_deadline: 20"), live).of("R3", "callback fusion"),
            Verdict::fail)
      << "its end may come yet";
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
  auto cut = hanging();
  const auto begin = *std::ranges::find_if(cut.events, [](const Event& event) {
    return event.head.stream == StreamIndex{0} && std::holds_alternative<StreamBegin>(event.body);
  });
  const auto add = [&](std::int64_t time, const EventBody& body) {
    cut.events.push_back(
        {.head = {.time = {time}, .stream = StreamIndex{20}, .cpu = {}, .pid = {}, .tid = {}},
         .body = body});
  };
  add(begin.head.time.ns, begin.body);
  add(begin.head.time.ns, PacketBegin{});
  add(55, PacketEnd{});
  add(55, StreamEnd{});
  std::ranges::stable_sort(cut.events, {}, [](const Event& event) { return event.head.time; });
  expect_undecided(cut, "a stream ends here, before the deadline of seq 2");
}

}  // namespace
}  // namespace cie::test
