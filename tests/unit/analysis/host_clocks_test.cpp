// Latencies between hosts whose clocks differ: what is shown, and how far it may be wrong.
#include <cie/analysis/analyzer.hpp>
#include <cie/analysis/report_rows.hpp>

#include "support/move_to_host.hpp"
#include "support/trace_text.hpp"
#include "support/verdicts.hpp"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;

// Times are true ones. Messages take 3 and 8 from plan to show, 6 and 5 from show to ack.
constexpr const char* kThereAndBack = R"(
  process robot pid=100
  publisher out topic=/a
  callback plan timer period=100
  callback ack subscription topic=/b
  process desk pid=200
  publisher back topic=/b
  callback show subscription topic=/a
  10 start plan release=10
  11 publish out on=plan
  12 end plan
  15 start show release=14 from=out:0
  16 publish back on=show
  17 end show
  23 start ack release=22 from=back:0
  24 end ack
  110 start plan release=110
  111 publish out on=plan
  112 end plan
  120 start show release=119 from=out:1
  121 publish back on=show
  122 end show
  127 start ack release=126 from=back:1
  128 end ack)";

// The desk was booted earlier, and its wall clock is 300 ahead.
const OtherHost kDesk{.name = "desk", .monotonic = 5'000'000, .realtime = 300};

TextTrace on_two_hosts(std::string_view text) {
  auto trace = trace_of(text);
  move_to_host(trace, 200, kDesk);
  return trace;
}

TEST(HostClocks, AWindowIsByOneClock) {
  AnalysisOptions options;
  options.window = TimeWindow{.from = {0}, .to = {1'000'000'000}};
  EXPECT_EQ(Verified(trace_of(kThereAndBack), {}, options)["E2"], Verdict::pass);
  EXPECT_THROW(Verified(on_two_hosts(kThereAndBack), {}, options), SeveralClocks);
  options.window.reset();
  EXPECT_EQ(Verified(on_two_hosts(kThereAndBack), {}, options)["E2"], Verdict::pass);
}

const GraphEdge& edge_to(const Report& report, std::string_view callback) {
  const ReportRows rows(report);
  for (const auto& edge : report.edges) {
    if (rows.find(edge.to)->logical_id == callback) return edge;
  }
  throw std::invalid_argument("no such edge");
}

std::optional<std::int64_t> ns(const std::optional<Duration>& duration) {
  return duration ? std::optional(duration->ns) : std::nullopt;
}

TEST(HostClocks, BoundTheirDifferenceByTheFastestMessagesEachWay) {
  const auto report = analyze(on_two_hosts(kThereAndBack)).report;
  ASSERT_EQ(report.clocks.size(), 1U);
  const auto& pair = report.clocks.front();
  EXPECT_EQ(pair.first, "desk");
  EXPECT_EQ(pair.second, "robot");
  EXPECT_EQ(pair.messages_there, 2U);
  EXPECT_EQ(pair.messages_back, 2U);
  EXPECT_EQ(pair.fastest_there_ns, 5 - 300);
  EXPECT_EQ(pair.fastest_back_ns, 3 + 300);
  // In truth the robot's clock is 300 behind: within 4 of 299.
  EXPECT_EQ(pair.ahead_ns, -299);
  EXPECT_EQ(pair.error_ns, (5 + 3) / 2);
}

TEST(HostClocks, ShowLatenciesWithWhatTheyMayBeWrongBy) {
  const auto report = analyze(on_two_hosts(kThereAndBack)).report;
  const auto& there = edge_to(report, "show");
  EXPECT_EQ(there.communication->min, 3 + 300);
  EXPECT_EQ(there.communication->max, 8 + 300);
  ASSERT_TRUE(there.clock_error);
  EXPECT_EQ(ns(there.clock_error->least), -(3 + 300));  // the fastest took no less than nothing
  EXPECT_EQ(ns(there.clock_error->most), 5 - 300);
  // The truth, -300, lies within.
  const auto& back = edge_to(report, "ack");
  EXPECT_EQ(back.communication->min, 5 - 300);
  ASSERT_TRUE(back.clock_error);
  EXPECT_EQ(ns(back.clock_error->least), -(5 - 300));
  EXPECT_EQ(ns(back.clock_error->most), 3 + 300);
}

TEST(HostClocks, CancelOutOnTheWayThereAndBack) {
  const auto report = analyze(on_two_hosts(kThereAndBack)).report;
  ASSERT_EQ(report.chains.size(), 1U);
  const auto& chain = report.chains.front();
  EXPECT_EQ(chain.name, "plan -> show -> ack");
  EXPECT_EQ(chain.path_latency->count, 2U);
  EXPECT_EQ(chain.path_latency->min, 24 - 10);
  EXPECT_EQ(chain.path_latency->max, 128 - 110);
  EXPECT_FALSE(chain.clock_error);
  EXPECT_EQ(chain.data_age->max, 128 - 10);  // of what plan read at 10
}

// What passes between a publication and its source timestamp belongs to the way, as on one host.
TEST(HostClocks, CancelOutWheneverItsMessagesWereWritten) {
  for (const std::int64_t later : {-2, 1}) {
    auto trace = on_two_hosts(kThereAndBack);
    const auto shift = [later](auto& event) {
      if (event.source_timestamp_realtime_ns != 0) event.source_timestamp_realtime_ns += later;
    };
    for (auto& event : trace.events) {
      if (auto* publish = std::get_if<Publish>(&event.body)) shift(*publish);
      if (auto* start = std::get_if<CallbackStart>(&event.body)) shift(*start);
    }
    const auto report = analyze(trace).report;
    const auto& chain = report.chains.front();
    EXPECT_EQ(chain.path_latency->min, 24 - 10) << later;
    EXPECT_EQ(chain.path_latency->max, 128 - 110) << later;
    EXPECT_EQ(chain.data_age->max, 128 - 10) << later;
    EXPECT_EQ(edge_to(report, "show").communication->min, 3 + 300 - later) << "D - S";
  }
}

TEST(HostClocks, MatterToAChainThatOnlyOnceWentToAnotherHost) {
  // `plan` is followed by `show` on the desk, then by one on its own host; `beat` answers the
  // desk's.
  const Verified verified(on_two_hosts(R"(
  process robot pid=100
  publisher out topic=/a
  callback plan timer period=100
  callback ack subscription topic=/b
  process local pid=101 from=150
  callback here subscription topic=/a id=show
  process desk pid=200
  publisher back topic=/b
  callback there subscription topic=/a id=show
  callback beat timer period=100
  10 start plan release=10
  11 publish out on=plan
  12 end plan
  15 start there release=14 from=out:0
  17 end there
  20 start beat release=20
  21 publish back on=beat
  22 end beat
  27 start ack release=26 from=back:0
  28 end ack
  210 start plan release=210
  211 publish out on=plan
  212 end plan
  215 start here release=214 from=out:1
  217 end here)"),
                          "chains:\n  - {name: c, callbacks: [plan, show]}");
  ASSERT_EQ(verified.result.report.chains.size(), 1U);
  const auto& chain = verified.result.report.chains.front();
  EXPECT_EQ(chain.instances, 2U);
  EXPECT_EQ(chain.path_latency->min, 217 - 210);
  EXPECT_EQ(chain.path_latency->max, 17 - 10 + 300);
  // The desk's may be wrong by -303 to -295, the other one's by nothing.
  ASSERT_TRUE(chain.clock_error);
  EXPECT_EQ(ns(chain.clock_error->least), -303);
  EXPECT_EQ(ns(chain.clock_error->most), 0);
  ASSERT_TRUE(chain.hop_table.front().clock_error);
  EXPECT_EQ(ns(chain.hop_table.front().clock_error->most), 0);
}

TEST(HostClocks, AreNotBoundByMessagesOfOneDirection) {
  auto trace = on_two_hosts(kThereAndBack);
  trace.erase<PublisherInit>([](const PublisherInit& e, const EventHead&) {
    return e.topic == "/b";  // written by somebody who is not known
  });
  const auto report = analyze(trace).report;
  ASSERT_EQ(report.clocks.size(), 1U);
  EXPECT_EQ(report.clocks.front().messages_there, 0U);
  EXPECT_EQ(report.clocks.front().messages_back, 2U);
  EXPECT_FALSE(report.clocks.front().fastest_there_ns);
  EXPECT_FALSE(report.clocks.front().ahead_ns);
  EXPECT_FALSE(report.clocks.front().error_ns);
  EXPECT_EQ(ns(edge_to(report, "show").clock_error->most), std::nullopt);
}

TEST(HostClocks, ThatAreStepByStepCorrectedContradictEachOther) {
  // Between the rounds the desk's wall clock is set back by 1000.
  auto trace = on_two_hosts(kThereAndBack);
  for (auto& event : trace.events) {
    if (event.head.stream == StreamIndex{2} && event.head.time.ns > kDesk.monotonic + 100) {
      if (auto* publish = std::get_if<Publish>(&event.body))
        publish->source_timestamp_realtime_ns -= 1000;
    }
    auto* start = std::get_if<CallbackStart>(&event.body);
    if (start != nullptr && start->source_timestamp_realtime_ns == 1'000'000'000 + 300 + 121)
      start->source_timestamp_realtime_ns -= 1000;
  }
  const auto sync = std::ranges::find_if(trace.events, [](const Event& event) {
    return event.head.stream == StreamIndex{2} && std::holds_alternative<Publish>(event.body);
  });
  auto later = *sync;
  later.head.time.ns = kDesk.monotonic + 100;
  later.body = ClockSync{.monotonic_ns = kDesk.monotonic + 100,
                         .realtime_ns = 1'000'000'000 + 100 + 300 - 1000};
  const auto place = std::ranges::find_if(trace.events, [](const Event& event) {
    return event.head.stream == StreamIndex{0} && event.head.time.ns >= 110;
  });
  trace.events.insert(place, later);
  const auto report = analyze(trace).report;
  ASSERT_EQ(report.clocks.size(), 1U);
  const auto& pair = report.clocks.front();
  // There: 8 + 300 - 1000 in the second round; back: 6 - 300 in the first one.
  EXPECT_EQ(pair.fastest_back_ns, 8 + 300 - 1000);
  EXPECT_EQ(pair.fastest_there_ns, 6 - 300);
  EXPECT_LT(*pair.error_ns, 0);
  EXPECT_TRUE(edge_to(report, "show").clock_error->is_contradiction());
  const auto is_told = std::ranges::any_of(report.defects, [](const TraceDefect& defect) {
    return defect.kind == DefectKind::clocks_drifted;
  });
  EXPECT_TRUE(is_told);
}

// The desk's wall clock is set ahead by 400 us between two rounds. Both take 10 us from plan to show; the second
// one seems to take 410 us, and the slow way back would let the clocks differ by as much.
TEST(HostClocks, BoundNothingWhereOneWasSet) {
  constexpr std::int64_t kStep = 400'000;
  auto trace = on_two_hosts(R"(
  process robot pid=100
  publisher out topic=/a
  callback plan timer period=100000000
  callback ack subscription topic=/b
  process desk pid=200
  publisher back topic=/b
  callback show subscription topic=/a
  1000000 start plan release=1000000
  1001000 publish out on=plan
  1002000 end plan
  1005000 start show release=1004000 from=out:0
  1006000 publish back on=show
  1010000 end show
  6007000 start ack release=6006000 from=back:0
  6008000 end ack
  101000000 start plan release=101000000
  101001000 publish out on=plan
  101002000 end plan
  101005000 start show release=101004000 from=out:1
  101006000 publish back on=show
  101010000 end show
  106007000 start ack release=106006000 from=back:1
  106008000 end ack)");
  constexpr std::int64_t kStamp = 1'000'000'000 + 300 + 101'006'000;
  Event sync;
  for (auto& event : trace.events) {
    auto* publish = std::get_if<Publish>(&event.body);
    if (publish != nullptr && publish->source_timestamp_realtime_ns == kStamp) {
      publish->source_timestamp_realtime_ns += kStep;
      sync = event;
    }
    auto* start = std::get_if<CallbackStart>(&event.body);
    if (start != nullptr && start->source_timestamp_realtime_ns == kStamp)
      start->source_timestamp_realtime_ns += kStep;
    auto* read = std::get_if<ClockSync>(&event.body);
    if (read != nullptr && event.head.pid == 200 && event.head.time.ns > kDesk.monotonic + 100)
      read->realtime_ns += kStep;
  }
  sync.head.time.ns = kDesk.monotonic + 50'000'000;
  sync.body = ClockSync{.monotonic_ns = sync.head.time.ns,
                        .realtime_ns = 1'000'000'000 + 50'000'000 + 300 + kStep};
  const auto place = std::ranges::find_if(trace.events, [](const Event& event) {
    return event.head.pid == 100 && event.head.time.ns >= 101'000'000;
  });
  trace.events.insert(place, sync);
  const auto judged = [&trace](const std::string& callbacks) {
    const auto spec =
        "chains:\n  - {name: c, callbacks: [" + callbacks + "], path_latency: 110000}\n";
    return Verified(trace, spec)["Q2"];
  };
  EXPECT_EQ(judged("plan, show"), Verdict::inconclusive);
  EXPECT_EQ(judged("plan, show, ack"), Verdict::inconclusive) << "set on the way, perhaps";
  const auto report = analyze(trace).report;
  EXPECT_EQ(std::ranges::count(report.defects, DefectKind::clocks_drifted, &TraceDefect::kind), 1);
  ASSERT_EQ(report.clocks.size(), 1U);
  EXPECT_TRUE(report.clocks[0].fastest_there_ns && report.clocks[0].fastest_back_ns);
  EXPECT_EQ(report.clocks[0].ahead_ns, std::nullopt) << "before and after by something else";
  EXPECT_EQ(report.clocks[0].error_ns, std::nullopt);
}

TEST(HostClocks, OfTwoBootsAreNoReasonToDoubtEitherHost) {
  const auto result = analyze(on_two_hosts(kThereAndBack));
  const auto time_sane = std::ranges::find(result.verdicts.rules, "T6", &RuleVerdict::id);
  EXPECT_EQ(time_sane->verdict, Verdict::pass);
}

TEST(HostClocks, TheRecordingLastsAsLongAsByOneClock) {
  const auto alone = analyze(trace_of(kThereAndBack)).report.trace;
  const auto trace = analyze(on_two_hosts(kThereAndBack)).report.trace;
  // By the clock of the first host in order of their names, the desk's: 300 of its wall clock's
  // error make what both saw so much shorter.
  EXPECT_EQ((*trace.end - *trace.begin).ns, (*alone.end - *alone.begin).ns - 300);
  EXPECT_EQ(trace.begin->ns, alone.begin->ns + kDesk.monotonic);
}

TEST(HostClocks, EveryHostHasItsLengthAndTheWayToTheRecordingsClock) {
  const auto alone = analyze(trace_of(kThereAndBack)).report.trace;
  const auto report = analyze(on_two_hosts(kThereAndBack)).report;
  ASSERT_EQ(report.processes.size(), 2U);
  for (const auto& process : report.processes) {
    const auto& host = host_of(report, process);
    EXPECT_EQ(host.name, process.host);
    EXPECT_EQ(host.shift, Duration{host.name == "desk" ? 0 : kDesk.monotonic - 300});
    EXPECT_EQ(host.recorded, *alone.end - *alone.begin) << host.name;
  }
}

TEST(HostClocks, MachinesOfOneNameAreToldApartByTheirBoots) {
  auto trace = on_two_hosts(kThereAndBack);
  for (auto& event : trace.events) {
    auto* begin = std::get_if<StreamBegin>(&event.body);
    if (begin != nullptr && begin->host == "desk") begin->host = "robot";
    // Process ids do not tell them apart.
    if (event.head.stream == StreamIndex{2} && event.head.pid) event.head.pid = 100;
    auto* run = std::get_if<RunBegin>(&event.body);
    if (run != nullptr && run->host == "desk") run->pid = 100;
  }
  const auto result = analyze(trace);
  EXPECT_EQ(result.report.trace.hosts,
            (std::vector<std::string>{"robot (boot boot)", "robot (boot desk)"}));
  EXPECT_EQ(result.report.processes.size(), 2U);
  EXPECT_EQ(edge_to(result.report, "show").communication->min, 3 + 300);
  for (const auto& rule : result.verdicts.rules) {
    EXPECT_NE(rule.verdict, Verdict::inconclusive) << rule.id;
    if (rule.id != "M2") continue;
    EXPECT_EQ(rule.subjects.size(), 3U);
    for (const auto& subject : rule.subjects)
      EXPECT_NE(subject.subject.find(" (pid 100 on robot (boot "), std::string::npos);
  }
}

TEST(HostClocks, SayNothingOfOneHost) {
  const auto report = analyze(trace_of(kThereAndBack)).report;
  EXPECT_TRUE(report.clocks.empty());
  EXPECT_FALSE(edge_to(report, "show").clock_error);
  EXPECT_EQ(edge_to(report, "show").communication->min, 3);
}

}  // namespace
}  // namespace cie::test
