#include <cie/tracepoints/utf8.hpp>
#include <cie/viewer_export/graph_writer.hpp>

#include "sample_report.hpp"

#include <algorithm>
#include <cstddef>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string dot_of(const analysis::Report& report) {
  std::ostringstream out;
  write_graph_dot(out, report);
  return out.str();
}

analysis::Report with_edges() {
  auto report = test::sample_report();
  const auto timer = report.callbacks[0].index;
  const auto lidar = report.callbacks[1].index;
  auto far = test::callback("/far@Timer(1)", CallbackKind::timer);
  far.index = analysis::CallbackIndex{9};
  far.process = analysis::ProcessIndex{7};
  report.callbacks.push_back(far);
  report.edges = {
      {.from = timer,
       .to = lidar,
       .topic = "/t",
       .messages = 6,
       .communication = test::summary(1'000, 3'000, 6)},
      {.from = std::nullopt, .to = lidar, .topic = "/map", .messages = 1, .communication = {}},
      {.from = far.index, .to = timer, .topic = "/x", .messages = 2, .communication = {}}};
  return report;
}

TEST(GraphDot, TellsMessagesOfUnknownWritersFromThosePublishedOutsideCallbacks) {
  auto report = with_edges();
  report.edges[1].messages = 3;
  report.edges[1].unrecorded = 3;
  EXPECT_THAT(dot_of(report), HasSubstr("label=\"/map\\npublishers not recorded\"];"));
  report.edges[1].unrecorded = 2;
  EXPECT_THAT(dot_of(report), HasSubstr("label=\"/map\\n1 published outside callbacks,\\n2 by "
                                        "publishers not recorded\"];"));
}

TEST(GraphDot, HasProcessesCallbacksAndEdgesWithLatencies) {
  const auto text = dot_of(with_edges());
  EXPECT_THAT(text, HasSubstr("subgraph \"cluster_0\" {\n    label=\"demo, pid 4001\";\n"));
  EXPECT_THAT(text, HasSubstr("\"0 /a/plan@Timer(20000000)\" "
                              "[label=\"plan timer 20 ms\\nresponse p99 289.4 us, max 289.4 us\" "
                              "tooltip=\"/a/plan@Timer(20000000)\"];"));
  EXPECT_THAT(text, HasSubstr("\"0 /a/plan@Timer(20000000)\" -> \"1 "
                              "/perception/lidar@Subscription(/sensing/lidar/top/points_raw)\" "
                              "[label=\"/t\\n6 messages\\nlatency p50 2.000 us, max 3.000 us\"];"));
  EXPECT_THAT(
      text,
      HasSubstr("\"topic /map\" [shape=ellipse label=\"/map\\npublished outside callbacks\"];"));
  EXPECT_THAT(text, HasSubstr("\"9 /far@Timer(1)\" -> \"0 /a/plan@Timer(20000000)\" "
                              "[label=\"/x\\n2 messages\" style=dashed];"));
}

TEST(GraphDot, TellsTheLongestRunThoughItsReleaseIsNotKnown) {
  auto report = with_edges();
  report.callbacks[0].response_time_lower = test::summary(1'000'000, 2'500'000, 1);
  report.callbacks[0].response_time_at_least = test::summary(85'266, 2'500'000, 8);
  EXPECT_THAT(dot_of(report), HasSubstr("max >2.500 ms\" tooltip=\"/a/plan@Timer(20000000)\"];"));
  EXPECT_THAT(
      dot_of(report),
      HasSubstr("points_raw\\nresponse p99 >2.500 ms, max >2.500 ms\" tooltip=\"/perception"));
}

TEST(GraphDot, LetsNoNameSayMoreThanANameMay) {
  auto report = with_edges();
  report.callbacks[0].logical_id = "a\"]; b [label=\"x\\";
  report.edges[0].topic = "\n}\"\x1b";
  const auto text = dot_of(report);
  EXPECT_THAT(text, HasSubstr("[label=\"a\\\"]; b [label=\\\"x\\\\\\nresponse"));
  EXPECT_THAT(text, HasSubstr("[label=\"\\\\x0a}\\\"\\\\x1b\\n6 messages"));
  EXPECT_THAT(text, Not(HasSubstr("\x1b")));
}

// Graphviz refuses strings of 16384 bytes and more.
TEST(GraphDot, ShortensLongNames) {
  auto report = with_edges();
  const std::string umlauts = [] {
    std::string text;
    for (int i = 0; i < 10'000; ++i)
      text += "\xC3\xA4";
    return text;
  }();
  report.callbacks[0].logical_id = "/first" + umlauts + std::string(20'000, '"') + "/last";
  report.processes[0].name = umlauts;
  report.edges[0].topic = "/t" + umlauts;
  report.edges[1].topic = "/one" + umlauts + "/end";  // alike where they are shown
  auto other = report.edges[1];
  other.topic = "/one" + umlauts + umlauts + "/end";
  report.edges.push_back(other);
  const auto text = dot_of(report);
  EXPECT_TRUE(valid_utf8(text) == text);
  for (std::size_t begin = 0; begin < text.size();) {
    const auto end = std::min(text.find('\n', begin), text.size());
    EXPECT_LT(end - begin, 8'000U) << "at most three names of 512 bytes, escaped";
    begin = end + 1;
  }
  EXPECT_THAT(text, HasSubstr("\"0 /first\xC3\xA4"));
  EXPECT_THAT(text, HasSubstr("\xC3\xA4\xE2\x80\xA6\\\""));
  EXPECT_THAT(text, HasSubstr("\\\"/last\" [label="));
  EXPECT_THAT(text, HasSubstr("\"topic 0 /one\xC3\xA4"));
  EXPECT_THAT(text, HasSubstr("\"topic 1 /one\xC3\xA4"));
}

TEST(GraphDot, LeavesOutAndCountsWhatNoMessageLinks) {
  auto report = with_edges();
  auto lonely = test::callback("/a/alone@Timer(5)", CallbackKind::timer);
  lonely.index = analysis::CallbackIndex{10};
  report.callbacks.push_back(lonely);
  EXPECT_THAT(
      dot_of(report),
      ::testing::AllOf(
          Not(HasSubstr("alone")),
          HasSubstr("label=\"2 of 5 callbacks not shown: no message links them to others\"")));
}

TEST(GraphDot, OfNothingIsAnEmptyGraph) {
  EXPECT_THAT(dot_of({}), ::testing::AllOf(::testing::StartsWith("digraph callbacks {\n"),
                                           ::testing::EndsWith("}\n")));
}

}  // namespace
}  // namespace cie::viewer_export
