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

TEST(ViewerExports, ChromeNamesWaitsByWhatTheyBeginWith) {
  const auto viewer = make_viewer_export("chrome", {});
  std::uint64_t seq = 0;
  for (const auto source :
       {analysis::ReleaseSource::exact, analysis::ReleaseSource::source_timestamp}) {
    const auto begin = static_cast<std::int64_t>(100 * seq);
    auto instance = test::instance(test::kDrive, 13, seq++, begin, begin + 10, begin + 20);
    instance.release_source = source;
    viewer->on_instance(instance);
  }
  std::ostringstream out;
  viewer->write(out, {});
  std::set<std::string> names;
  const auto document = nlohmann::json::parse(out.str());
  for (const auto& event : document.at("traceEvents")) {
    if (event.value("cat", "") == "wait") names.insert(event.at("name").get<std::string>());
  }
  const std::string callback(test::kDrive);
  EXPECT_EQ(names, (std::set<std::string>{callback, callback + " (source timestamp to start)"}));
}

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

// A process dies inside a callback, and the next one has its pid and tid.
std::string exported_restart(std::string_view format) {
  const auto viewer = make_viewer_export(format, {});
  viewer->on_instance(test::instance(test::kTimer, 11, 0, -1, 100, -1));
  auto next = test::instance(test::kTimer, 11, 0, -1, 500, 600);
  next.process = analysis::ProcessIndex{1};
  auto outside = test::publication(400, 11, 0, 1);
  outside.process = analysis::ProcessIndex{1};
  viewer->on_publication(outside);
  viewer->on_instance(next);
  analysis::AnalysisResult result;
  result.report.trace.end = analysis::Timestamp{1'000};
  for (const std::uint32_t i : {0U, 1U}) {
    result.report.processes.push_back({.index = analysis::ProcessIndex{i},
                                       .host = "robot",
                                       .pid = test::kPid,
                                       .name = i == 0 ? "launch" : "driver",
                                       .executor = std::nullopt});
  }
  std::ostringstream out;
  viewer->write(out, result);
  return out.str();
}

// As where a program executes another one in its place.
TEST(ViewerExports, EachProgramOfOnePidHasItsName) {
  const auto chrome = exported_restart("chrome");
  EXPECT_NE(chrome.find(R"("launch, then driver")"), std::string::npos) << chrome;
  const auto viewer = make_viewer_export("otlp", {});
  analysis::AnalysisResult result;
  for (const std::uint32_t i : {0U, 1U}) {
    auto instance = test::instance(test::kTimer, 11, 0, -1, 100 + 500 * i, 200 + 500 * i);
    instance.process = analysis::ProcessIndex{i};
    viewer->on_instance(instance);
    result.report.processes.push_back({.index = instance.process,
                                       .host = "robot",
                                       .pid = test::kPid,
                                       .name = i == 0 ? "launch" : "driver",
                                       .executor = std::nullopt});
  }
  std::ostringstream otlp;
  viewer->write(otlp, result);
  for (const std::string name : {"launch", "driver"}) {
    EXPECT_NE(otlp.str().find(R"({"key":"service.name","value":{"stringValue":")" + name),
              std::string::npos)
        << otlp.str();
  }
}

TEST(ViewerExports, ChromeEndsWhatADeadProcessLeftOpenWhereTheNextBegins) {
  const auto document = nlohmann::json::parse(exported_restart("chrome"));
  std::map<std::string, double> at;
  for (const auto& event : document.at("traceEvents"))
    at[event.at("ph")] = event.value("ts", 0.0);
  // Microseconds since the first start.
  EXPECT_EQ(at.at("B"), 0.0);
  EXPECT_EQ(at.at("E"), 0.3) << "the publication of the next process";
  EXPECT_EQ(at.at("X"), 0.4);
}

TEST(ViewerExports, SpeedscopeEndsWhatADeadProcessLeftOpenWhereTheNextBegins) {
  const auto document = nlohmann::json::parse(exported_restart("speedscope"));
  std::string told;
  for (const auto& event : document.at("profiles").at(0).at("events"))
    told += event.at("type").get<std::string>() + std::to_string(event.at("at").get<int>()) + " ";
  EXPECT_EQ(told, "O0 C400 O400 C500 ");
}

TEST(ViewerExports, OtlpPutsNothingOfAProcessIntoTheSpanOfOneBeforeIt) {
  const auto line = nlohmann::json::parse(exported_restart("otlp"));
  for (const auto& span : line.at("resourceSpans").at(0).at("scopeSpans").at(0).at("spans"))
    EXPECT_FALSE(span.contains("parentSpanId")) << span;
}

TEST(ViewerExports, McapCountsNoReceiversOfAPublisherThatWasNeverAnnounced) {
  for (const bool is_announced : {true, false}) {
    const auto viewer = make_viewer_export("mcap", {});
    auto publication = test::publication(110, 11, 0, 1);
    if (!is_announced) publication.writer_gid = 0;
    viewer->on_publication(publication);
    viewer->on_instance(test::taking(test::instance(test::kTrack, 12, 0, -1, 200, 300), 1));
    std::ostringstream out;
    viewer->write(out, {});
    EXPECT_EQ(out.str().find(R"("receivers":1)") != std::string::npos, is_announced);
    EXPECT_EQ(out.str().find(R"("receivers":0)"), std::string::npos);
  }
}

TEST(ViewerExports, TellNoNumberOfAThreadThatEventsDoNotTell) {
  const auto exported = [](const char* format) {
    const auto viewer = make_viewer_export(format, {});
    viewer->on_instance(test::instance(test::kTimer, -1, 0, -1, 200, 300));  // no context vtid
    std::ostringstream out;
    viewer->write(out, {});
    return out.str();
  };
  EXPECT_EQ(exported("otlp").find("thread.id"), std::string::npos);
  EXPECT_EQ(exported("mcap").find(R"("tid":-1)"), std::string::npos);
  for (const char* format : {"chrome", "speedscope"})
    EXPECT_NE(exported(format).find("threads not recorded"), std::string::npos) << format;
}

// The format has no place for it, so nothing can name it.
TEST(ViewerExports, OtlpNamesNoParentThatNeverEnded) {
  const auto viewer = make_viewer_export("otlp", {});
  const auto unended = test::instance(test::kTimer, 11, 0, -1, 100, -1);
  viewer->on_publication(test::publication(110, 11, 0, 1));
  viewer->on_publication(test::publication(120, 11, 0, 2));
  viewer->on_instance(test::taking(test::instance(test::kTrack, 12, 0, -1, 200, 300), 1));
  viewer->on_instance(unended);
  std::ostringstream out;
  EXPECT_EQ(viewer->write(out, {}).publications, 2U);
  std::set<std::string> ids;
  std::set<std::string> traces;
  std::set<std::string> parents;
  const auto line = nlohmann::json::parse(out.str());
  for (const auto& span : line.at("resourceSpans").at(0).at("scopeSpans").at(0).at("spans")) {
    ids.insert(span.at("spanId"));
    traces.insert(span.at("traceId"));
    if (span.contains("parentSpanId")) parents.insert(span.at("parentSpanId"));
  }
  EXPECT_EQ(ids.size(), 3U);
  EXPECT_EQ(traces.size(), 1U) << "that of the run that never ended";
  ASSERT_EQ(parents.size(), 1U) << "who took the message has the publication";
  EXPECT_TRUE(ids.contains(*parents.begin()));
}

// A message of 5 from the desk to the robot, whose clock shows 1 000 less.
std::string exported_message(std::string_view format) {
  const auto viewer = make_viewer_export(format, {});
  auto sent = test::instance(test::kTimer, 11, 0, -1, 2'000, 2'020);
  auto taken = test::taking(test::instance(test::kTrack, 12, 0, -1, 1'015, 1'018), 1);
  taken.host = analysis::HostIndex{1};
  viewer->on_publication(test::publication(2'010, 11, 0, 1));
  viewer->on_instance(taken);
  viewer->on_instance(sent);
  analysis::AnalysisResult result;
  result.report.hosts = {{.name = "desk", .clock_offset_ns = 50'000, .shift = {0}},
                         {.name = "robot", .clock_offset_ns = 51'000, .shift = {1'000}}};
  std::ostringstream out;
  const auto counts = viewer->write(out, result);
  EXPECT_EQ(counts.flows, format == "speedscope" ? 0U : 1U);
  EXPECT_EQ(counts.backward_flows, 0U);
  return out.str();
}

TEST(ViewerExports, ChromeDrawsMessagesBetweenHostsAsLongAsTheyTook) {
  const auto document = nlohmann::json::parse(exported_message("chrome"));
  std::map<std::string, double> at;
  for (const auto& event : document.at("traceEvents"))
    at[event.at("ph")] = event.value("ts", 0.0);
  EXPECT_EQ(at.at("s"), 0.010);
  EXPECT_EQ(at.at("f"), 0.015);
}

TEST(ViewerExports, SpeedscopeHasTheProfilesOfAllHostsOnOneClock) {
  const auto document = nlohmann::json::parse(exported_message("speedscope"));
  std::map<std::string, std::int64_t> opened;
  for (const auto& profile : document.at("profiles")) {
    EXPECT_EQ(profile.at("endValue"), 20);
    opened[profile.at("name")] = profile.at("events").at(0).at("at");
  }
  EXPECT_EQ(opened.at("pid 4001 tid 11"), 0);
  EXPECT_EQ(opened.at("pid 4001 tid 12"), 15);
}

TEST(ViewerExports, OtlpHasWallClockTimesOfEachHost) {
  std::istringstream lines(exported_message("otlp"));
  std::set<std::string> starts;
  for (std::string line; std::getline(lines, line);) {
    EXPECT_NE(line.find(R"({"key":"cie.clock","value":{"stringValue":"realtime"}})"),
              std::string::npos);
    const auto spans = nlohmann::json::parse(line).at("resourceSpans").at(0).at("scopeSpans");
    for (const auto& span : spans.at(0).at("spans"))
      starts.insert(span.at("startTimeUnixNano"));
  }
  EXPECT_EQ(starts, (std::set<std::string>{"52000", "52010", "52015"}));
}

}  // namespace
}  // namespace cie::viewer_export
