// What holds for every format. That its readers understand it is checked by tests/browser/viewers.
#include <cie/viewer_export/viewer_exports.hpp>

#include "sample_instances.hpp"

#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <string_view>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace cie::viewer_export {
namespace {

class EveryViewer : public testing::TestWithParam<std::string_view> {
 protected:
  static std::string exported(const ViewerOptions& options, ViewerCounts* counts = nullptr) {
    const auto viewer = make_viewer_export(GetParam(), options);
    test::feed_application(*viewer);
    std::ostringstream out;
    const auto counted = viewer->write(out, test::application_result());
    if (counts != nullptr) *counts = counted;
    return out.str();
  }
  static bool is_json() { return GetParam() == "chrome" || GetParam() == "speedscope"; }
};

TEST_P(EveryViewer, IsTheSameFromMemoryAndFromDisk) {
  EXPECT_EQ(exported({.records_in_memory = 1}), exported({.records_in_memory = 1'000}));
}

TEST_P(EveryViewer, CountsWhatItWrites) {
  ViewerCounts counts;
  exported({}, &counts);
  const bool has_messages = GetParam() != "speedscope";
  // Eleven instances: one ends before its start, one overlaps, one never ends.
  EXPECT_EQ(counts.instances, GetParam() == "speedscope" || GetParam() == "otlp" ? 9U : 10U);
  EXPECT_EQ(counts.unfinished, GetParam() == "otlp" ? 1U : 0U);
  EXPECT_EQ(counts.skipped, GetParam() == "speedscope" ? 2U : 1U);
  EXPECT_EQ(counts.publications, has_messages ? 3U : 0U);
  EXPECT_EQ(counts.flows, has_messages ? 3U : 0U);
  EXPECT_EQ(counts.backward_flows, has_messages ? 1U : 0U);
}

TEST_P(EveryViewer, OfNothingIsStillAFile) {
  const auto viewer = make_viewer_export(GetParam(), {});
  std::ostringstream out;
  const auto counts = viewer->write(out, {});
  EXPECT_EQ(counts.instances, 0U);
  if (is_json()) {
    EXPECT_TRUE(nlohmann::json::accept(out.str())) << out.str();
  }
  EXPECT_EQ(out.str().empty(), GetParam() == "otlp") << "no line";
}

TEST_P(EveryViewer, SurvivesHostileValues) {
  const auto viewer = make_viewer_export(GetParam(), {});
  constexpr auto kMin = std::numeric_limits<std::int64_t>::min();
  constexpr auto kMax = std::numeric_limits<std::int64_t>::max();
  for (const auto id : {kMin, std::int64_t{-1}, std::int64_t{0}, kMax}) {
    auto i = test::instance("bad \xFF \"\\ name", id, 0, kMax, kMax - 1, kMax);
    i.pid = id;
    i.host = analysis::HostIndex{0xffffffffU};
    i.release = analysis::Timestamp{kMin};
    viewer->on_instance(i);
    i.start.ns = kMin;
    viewer->on_instance(i);
    viewer->on_publication({.time = {id}, .pid = id, .tid = id, .cpu = {}, .topic = "\xFF\n"});
  }
  analysis::AnalysisResult result;
  result.report.trace.clock_offset_ns = kMax;
  std::ostringstream out;
  const auto counts = viewer->write(out, result);
  EXPECT_EQ(counts.instances, 4U);
  EXPECT_EQ(out.str().find('\xFF'),
            GetParam() == "mcap" ? out.str().find('\xFF') : std::string::npos);
  if (is_json()) {
    EXPECT_TRUE(nlohmann::json::accept(out.str())) << out.str();
  }
  if (GetParam() == "otlp") {
    std::istringstream lines(out.str());
    for (std::string line; std::getline(lines, line);)
      EXPECT_TRUE(nlohmann::json::accept(line)) << line;
  }
}

INSTANTIATE_TEST_SUITE_P(Viewers, EveryViewer, testing::ValuesIn(viewer_formats()),
                         [](const auto& of) { return std::string(of.param); });

TEST(ViewerExports, KnowsNoOtherFormats) { EXPECT_EQ(make_viewer_export("tracy", {}), nullptr); }

TEST(ViewerExports, ChromeKeepsHostsWithTheSamePidsApart) {
  const auto viewer = make_viewer_export("chrome", {});
  analysis::AnalysisResult result;
  for (const std::uint32_t host : {0U, 1U}) {
    auto i = test::instance(test::kTimer, 11, 0, 10, 20, 30);
    i.host = analysis::HostIndex{host};
    viewer->on_instance(i);
    result.report.processes.push_back({.host = host == 0 ? "left" : "right",
                                       .pid = test::kPid,
                                       .name = "demo",
                                       .executor = {},
                                       .complete = true,
                                       .host_index = analysis::HostIndex{host}});
  }
  std::ostringstream out;
  viewer->write(out, result);
  std::map<std::int64_t, std::string> processes;
  std::set<std::int64_t> drawn;
  const auto document = nlohmann::json::parse(out.str());
  for (const auto& event : document.at("traceEvents")) {
    if (event.at("name") == "process_name")
      processes[event.at("pid")] = event.at("args").at("name");
    if (event.at("ph") == "X") drawn.insert(event.at("pid").get<std::int64_t>());
  }
  ASSERT_EQ(processes.size(), 2U);
  EXPECT_EQ(drawn.size(), 2U);
  EXPECT_EQ(processes.begin()->second, "demo (pid 4001 on left)");
  EXPECT_EQ(processes.rbegin()->second, "demo (pid 4001 on right)");
}

}  // namespace
}  // namespace cie::viewer_export
