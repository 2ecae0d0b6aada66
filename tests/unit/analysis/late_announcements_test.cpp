// What ran before its process was announced, as when a recorder attaches to it.
#include "support/move_to_host.hpp"
#include "support/trace_text.hpp"
#include "support/verdicts.hpp"

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;

// The same recording, whose process `pid` announces from that time on what it is.
void announce_at(std::int64_t time, std::int64_t pid, TextTrace& trace) {
  for (auto& event : trace.events) {
    const bool is_prologue = event.head.time.ns < 0 && event.head.pid == pid;
    if (is_prologue && category_of(event.body) == EventCategory::state) {
      event.head.time = Timestamp{time++};
    }
  }
  std::ranges::stable_sort(trace.events, {}, [](const Event& event) { return event.head.time; });
}

// From the timer, released at 10 and 110, to `last`, which ends at 24 and 124. What is between them
// publishes first and then goes on.
constexpr std::string_view kEnds = R"(
  11 start plan release=10
  12 publish points on=plan
  14 end plan
  16 start mid release=13 from=points:0
  18 publish tracks on=mid
  20 start last release=19 from=tracks:0
  24 end last
  30 end mid
  111 start plan release=110
  112 publish points on=plan
  114 end plan
  116 start mid release=113 from=points:1
  118 publish tracks on=mid
  119 end mid
  120 start last release=119 from=tracks:1
  124 end last)";

TextTrace in_one_process() {
  return trace_of(R"(
    process app pid=100 attached
    publisher points topic=/points
    publisher tracks topic=/tracks
    callback plan timer period=100
    callback mid subscription topic=/points
    callback last subscription topic=/tracks)" +
                  std::string(kEnds));
}

TextTrace in_two_processes() {
  return trace_of(R"(
    process sensor pid=100 attached
    publisher points topic=/points
    callback plan timer period=100
    process planner pid=200 attached
    publisher tracks topic=/tracks
    callback mid subscription topic=/points
    callback last subscription topic=/tracks)" +
                  std::string(kEnds));
}

// `ahead`: the clock of the timer's host.
void expect_both_chain_instances(const TextTrace& trace, std::int64_t ahead = 0) {
  const auto report = analyze(trace).report;
  ASSERT_EQ(report.chains.size(), 1U);
  const auto& chain = report.chains.front();
  EXPECT_EQ(chain.hops.size(), 3U);
  EXPECT_EQ(chain.instances, 2U);
  ASSERT_TRUE(chain.path_latency);
  EXPECT_EQ(chain.path_latency->sum, (24 - 10) + (124 - 110) - 2 * ahead);
  ASSERT_TRUE(chain.reaction_time);
  EXPECT_EQ(chain.reaction_time->max, 124 - 11 - ahead);
  ASSERT_EQ(report.edges.size(), 2U);
  for (const auto& edge : report.edges) {
    EXPECT_TRUE(edge.from);
    EXPECT_EQ(edge.messages, 2U);
  }
}

TEST(Chain, OfCallbacksThatAreAnnouncedAfterItEnded) {
  auto trace = in_one_process();
  announce_at(60, 100, trace);
  expect_both_chain_instances(trace);
}

TEST(Chain, OfAProcessThatIsAnnouncedBeforeTheWriterOfItsMessages) {
  for (const auto& [sensor, planner] : {std::pair(40, 80), std::pair(80, 40), std::pair(200, 40)}) {
    auto trace = in_two_processes();
    announce_at(sensor, 100, trace);
    announce_at(planner, 200, trace);
    expect_both_chain_instances(trace);
  }
}

// Of two hosts the events are read in the order of their wall clocks: what `points` publishes at 12 is
// read when `last` has ended at 24, and `mid`, which took it, has not.
TEST(Chain, OfAMessageWhosePublicationIsReadAfterItEnded) {
  auto trace = in_two_processes();
  constexpr std::int64_t kAhead = 14;
  const OtherHost host{.name = "robot2", .monotonic = 5'000'000, .realtime = kAhead};
  move_to_host(trace, 100, host);
  std::ranges::stable_sort(trace.events, {}, [&host](const Event& event) {
    const bool is_there = event.head.stream == StreamIndex{2};
    return is_there ? event.head.time.ns - host.monotonic + kAhead : event.head.time.ns;
  });
  expect_both_chain_instances(trace, kAhead);
}

// So long instances wait for who wrote what they took, and for their own names.
TEST(Chain, IsUndecidedWhereItsCallbacksOrPublishersWereAnnouncedTooLate) {
  constexpr std::string_view kSpec = R"(
callback_groups: []
chains:
  - name: scan
    callbacks: [plan, last]
    path_latency: 20
)";
  constexpr std::int64_t kLate = 5'000'000'000;
  const auto announced = [&](std::int64_t sensor, std::int64_t planner) {
    auto trace = trace_of(R"(
    process sensor pid=100 attached
    publisher points topic=/points
    callback plan timer period=100
    process planner pid=200 attached
    callback last subscription topic=/points
  11 start plan release=10
  12 publish points on=plan
  14 end plan
  20 start last release=19 from=points:0
  44 end last
  6000000011 start plan release=6000000010
  6000000012 publish points on=plan
  6000000014 end plan
  6000000016 start last release=6000000015 from=points:1
  6000000018 end last)");
    announce_at(sensor, 100, trace);
    announce_at(planner, 200, trace);
    return Verified(trace, kSpec);
  };
  EXPECT_EQ(announced(100, 200)["Q2"], Verdict::fail);
  EXPECT_EQ(announced(kLate, 200)["Q2"], Verdict::inconclusive);
  EXPECT_EQ(announced(200, kLate)["Q2"], Verdict::inconclusive);
  EXPECT_EQ(announced(kLate, kLate + 100)["Q2"], Verdict::inconclusive);
}

struct Told : Observer {
  void on_publication(const Publication& publication) override {
    lines.push_back(std::to_string(publication.time.ns) + ' ' + std::string(publication.topic) +
                    (publication.writer_gid != 0 ? "" : "?"));
  }
  std::vector<std::string> lines;
};

std::vector<std::string> publications_of(const TextTrace& trace) {
  Told told;
  analyze(trace, {}, &told);
  return told.lines;
}

TEST(Publications, AreToldOnceTheirPublishersAreAnnounced) {
  const std::vector<std::string> in_order{"12 /points", "18 /tracks", "112 /points", "118 /tracks"};
  auto trace = in_one_process();
  EXPECT_EQ(publications_of(trace), in_order);
  announce_at(60, 100, trace);
  EXPECT_EQ(publications_of(trace), in_order);
  trace = in_two_processes();
  announce_at(115, 100, trace);
  announce_at(40, 200, trace);
  EXPECT_EQ(publications_of(trace), in_order)
      << "those that are known by then wait with the others";
}

TEST(Publications, OfAPublisherThatIsNeverAnnouncedAreToldWithout) {
  auto trace = in_one_process();
  trace.erase<PublisherInit>(
      [](const PublisherInit& event, const EventHead&) { return event.topic == "/points"; });
  announce_at(60, 100, trace);
  const std::vector<std::string> told{"118 /tracks", "12 ?", "18 /tracks", "112 ?"};
  EXPECT_EQ(publications_of(trace), told);
}

// Five seconds after its first publication nobody waits for its announcement any more.
TEST(Publications, WaitForAnAnnouncementAsLongAsOneMayCome) {
  auto trace = trace_of(R"(
    process app pid=100 attached
    publisher points topic=/points
    publisher tracks topic=/tracks
    callback plan timer period=100
    11 start plan release=10
    12 publish points on=plan
    14 end plan
    5000000011 start plan release=5000000010
    5000000012 publish points on=plan
    5000000014 end plan
    5000000111 start plan release=5000000110
    5000000112 publish tracks on=plan
    5000000114 end plan)");
  trace.erase<PublisherInit>(
      [](const PublisherInit& event, const EventHead&) { return event.topic == "/points"; });
  const std::vector<std::string> told{"12 ?", "5000000012 ?", "5000000112 /tracks"};
  EXPECT_EQ(publications_of(trace), told);
}

// Neither topic nor chain is known: that is told.
TEST(LateAnnouncements, OfPublishersThatNeverComeAreADefect) {
  const auto unregistered = [](const TextTrace& trace) {
    std::uint64_t count = 0;
    for (const auto& defect : analyze(trace).report.defects)
      count += defect.kind == DefectKind::unregistered_publishers ? defect.count : 0;
    return count;
  };
  auto trace = in_one_process();
  EXPECT_EQ(unregistered(trace), 0U);
  EXPECT_EQ(trace.erase<PublisherInit>(), 2U);
  EXPECT_EQ(unregistered(trace), 2U);
}

}  // namespace
}  // namespace cie::test
