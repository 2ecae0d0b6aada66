// The edges of the callback graph: who took whose messages.
#include <cie/analysis/analyzer.hpp>
#include <cie/analysis/report_rows.hpp>

#include "support/trace_text.hpp"

#include <string>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;

std::string edges_of(std::string_view trace) {
  std::string text;
  const auto report = analyze(trace_of(trace)).report;
  const ReportRows rows(report);
  for (const auto& edge : report.edges) {
    const auto id = [&rows](CallbackIndex index) { return rows.find(index)->logical_id; };
    text += (edge.from ? id(*edge.from) : "-") + " -> " + id(edge.to) + " " + edge.topic + " x" +
            std::to_string(edge.messages);
    if (edge.communication) {
      text += ' ' + std::to_string(edge.communication->min) + ".." +
              std::to_string(edge.communication->max);
    }
    text += '\n';
  }
  return text;
}

TEST(CallbackGraph, HasAnEdgeForEachPairOfFanInAndFanOut) {
  // cam and lidar both publish /points; fusion and log both take it.
  EXPECT_EQ(edges_of(R"(
    publisher c topic=/points
    publisher l topic=/points
    callback cam timer period=100
    callback lidar timer period=100
    callback fusion subscription topic=/points
    callback log subscription topic=/points
    10 start cam release=10
    11 publish c on=cam
    12 end cam
    14 start fusion release=13 from=c:0
    15 end fusion
    16 start log release=12 from=c:0
    17 end log
    20 start lidar release=20
    21 publish l on=lidar
    22 end lidar
    25 start fusion release=24 from=l:0
    26 end fusion
    30 start cam release=30
    31 publish c on=cam
    32 end cam
    40 start fusion release=38 from=c:1
    41 end fusion)"),
            "cam -> fusion /points x2 2..7\n"
            "lidar -> fusion /points x1 3..3\n"
            "cam -> log /points x1 1..1\n");
}

TEST(CallbackGraph, CrossesProcessesAndKnowsPublishersOutsideCallbacks) {
  EXPECT_EQ(edges_of(R"(
    process robot pid=100
    publisher out topic=/a
    thread main worker
    callback plan timer period=100
    process desk pid=200
    callback show subscription topic=/a
    10 start plan release=10
    11 publish out on=plan
    12 end plan
    14 start show release=13 from=out:0
    15 end show
    20 publish out on=main
    24 start show release=23 from=out:1
    25 end show)"),
            "- -> show /a x1\nplan -> show /a x1 2..2\n");
}

// As of another application that was not recorded: no publisher of the recording has that writer.
TEST(CallbackGraph, CountsMessagesOfWritersThatWereNotRecorded) {
  auto trace = trace_of(R"(
    publisher out topic=/a
    thread main worker
    callback show subscription topic=/a
    11 publish out on=main
    14 start show release=13 from=out:0
    15 end show)");
  const auto seen = analyze(trace).report.edges;
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_EQ(seen[0].unrecorded, std::nullopt) << "published outside callbacks";
  trace.erase<PublisherInit>();
  trace.erase<Publish>();
  const auto edges = analyze(trace).report.edges;
  ASSERT_EQ(edges.size(), 1U);
  EXPECT_EQ(edges[0].from, std::nullopt);
  EXPECT_EQ(edges[0].unrecorded, 1U);
}

TEST(CallbackGraph, HasNoEdgeForWhatIsUnknown) {
  auto trace = trace_of(R"(
    publisher out topic=/a
    callback plan timer period=100
    callback show subscription topic=/a
    10 start plan release=10
    11 publish out on=plan
    12 end plan
    14 start show release=13 from=out:0
    15 end show
    20 start plan release=20
    21 publish out on=plan
    22 end plan
    24 start show release=none from=out:1
    25 end show)");
  trace.erase<Publish>([](const Publish& e, const EventHead&) { return e.seq == 1; });
  const auto edges = analyze(trace).report.edges;
  ASSERT_EQ(edges.size(), 1U) << "the second publish was lost: nobody knows whose it was";
  EXPECT_EQ(edges[0].messages, 1U);
}

}  // namespace
}  // namespace cie::test
