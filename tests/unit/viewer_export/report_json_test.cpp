#include <cie/viewer_export/report_writers.hpp>
#include <cie/viewer_export/version.hpp>

#include "sample_report.hpp"

#include <cstdint>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace cie::viewer_export {
namespace {

using Json = nlohmann::ordered_json;
using Keys = std::vector<std::string>;

std::string json_text_of(const analysis::Report& report) {
  std::ostringstream out;
  write_report_json(out, report);
  return out.str();
}
Json json_of(const analysis::Report& report) { return Json::parse(json_text_of(report)); }

Keys keys(const Json& object) {
  Keys result;
  for (const auto& [key, value] : object.items()) {
    result.push_back(key);
  }
  return result;
}

TEST(ReportJson, TellsOfClocksOnlyWhereMessagesPassBetweenHosts) {
  const auto report = json_of(test::sample_of_two_hosts());
  EXPECT_EQ(report["clocks"], nlohmann::ordered_json::parse(R"([
    {"hosts": ["desk", "robot"], "messages": [6, 9], "fastest_ns": [3000000, 400000],
     "ahead_ns": 1300000, "error_ns": 1700000},
    {"hosts": ["desk", "shed"], "messages": [1, 0], "fastest_ns": [-5, null], "ahead_ns": null,
     "error_ns": null}])"));
  const auto& chain = report["chains"][0];
  const auto error = nlohmann::ordered_json::parse(R"({"min": -3000000, "max": 400000})");
  EXPECT_EQ(chain["clock_error_ns"], error);
  EXPECT_EQ(chain["hop_table"][0]["clock_error_ns"], error);
  EXPECT_FALSE(chain["hop_table"][1].contains("clock_error_ns"));
  EXPECT_FALSE(json_of(test::sample_report()).contains("clocks"));
}

TEST(ReportJson, CountsMessagesThatWereNotSentWhereThereAreSuch) {
  auto report = test::sample_report();
  EXPECT_FALSE(json_of(report)["processes"][0].contains("unsent"));
  report.processes.front().unsent = {{.node = "/a", .topic = "/scan", .messages = 3}};
  EXPECT_EQ(json_of(report)["processes"][0]["unsent"],
            Json::parse(R"([{"node": "/a", "topic": "/scan", "messages": 3}])"));
}

TEST(ReportJson, CountsMessagesOfPublishersThatWereNotRecordedWhereThereAreSuch) {
  auto report = test::sample_report();
  report.edges.resize(3);
  for (std::size_t i = 0; i < 3; ++i)
    report.edges[i].messages = 5 + i;
  EXPECT_FALSE(json_of(report).contains("taken"));
  report.edges[0].unrecorded = 2;
  report.edges[2].unrecorded = 7;
  EXPECT_EQ(json_of(report)["taken"], Json::parse(R"({"messages": 18, "unrecorded": 9})"));
}

TEST(ReportJson, CountsOpenInstancesThatAreLateWhereThereAreSuch) {
  auto report = test::sample_report();
  EXPECT_FALSE(json_of(report)["callbacks"][0].contains("late_open"));
  report.callbacks[0].late_open = 3;
  EXPECT_EQ(json_of(report)["callbacks"][0]["late_open"], 3);
}

TEST(ReportJson, NamesTheWindowThatWasAskedFor) {
  auto report = test::sample_report();
  EXPECT_FALSE(json_of(report).contains("window"));
  report.trace.recording_begin = analysis::Timestamp{0};
  report.trace.begin = analysis::Timestamp{7};
  report.trace.end = analysis::Timestamp{9};
  EXPECT_EQ(json_of(report)["window"], Json::parse(R"({"begin_ns": 7, "end_ns": 9})"));
}

// The shapes below are the contract's, word for word and in its order.
TEST(ReportJson, HasEveryKeyOfTheContractInItsOrder) {
  const auto report = json_of(test::sample_report());
  EXPECT_EQ(keys(report), (Keys{"schema", "tool", "trace", "defects", "processes", "callbacks",
                                "threads", "chains", "edges"}));
  EXPECT_EQ(keys(report["tool"]), (Keys{"name", "version"}));
  EXPECT_EQ(keys(report["trace"]), (Keys{"paths", "begin_ns", "end_ns", "events", "streams",
                                         "hosts", "lost_events", "complete", "clock_offset_ns"}));
  EXPECT_EQ(keys(report["defects"][0]), (Keys{"kind", "severity", "count", "advice"}));
  EXPECT_EQ(keys(report["processes"][0]),
            (Keys{"host", "pid", "name", "executor", "complete", "index"}));
  const Keys callback{"logical_id",
                      "pid",
                      "node",
                      "kind",
                      "source",
                      "symbol",
                      "period_ns",
                      "group",
                      "threads",
                      "isolated",
                      "instances",
                      "incomplete",
                      "exceptions",
                      "missed_releases",
                      "longest_queue",
                      "release_source",
                      "response_time_ns",
                      "response_time_lower_ns",
                      "response_time_upper_ns",
                      "start_latency_ns",
                      "duration_ns",
                      "inter_arrival_ns",
                      "execution_time_ns",
                      "preempted_ns",
                      "blocked_ns",
                      "wake_delay_ns",
                      "wakeup_latency_ns",
                      "isolation",
                      "index",
                      "process",
                      "deadline_ns",
                      "response_deadline_ns",
                      "late",
                      "preempted_by",
                      "cut",
                      "runs_not_seen",
                      "lost_samples",
                      "overwritten_samples"};
  for (const auto& c : report["callbacks"]) {
    EXPECT_EQ(keys(c), callback);
  }
  EXPECT_EQ(keys(report["callbacks"][0]["threads"][0]),
            (Keys{"tid", "name", "instances", "thread"}));
  EXPECT_EQ(keys(report["callbacks"][0]["duration_ns"]),
            (Keys{"count", "min", "max", "sum", "mean", "p50", "p90", "p99", "p99_9"}));
  EXPECT_EQ(keys(report["threads"][0]), (Keys{"pid", "tid", "name", "role", "callbacks", "sched",
                                              "busy_ns", "index", "process", "ran"}));
  EXPECT_EQ(keys(report["chains"][0]),
            (Keys{"name", "pid", "hops", "instances", "path_latency_ns", "reaction_time_ns",
                  "data_age_ns", "hop_table", "process", "callbacks", "index"}));
  EXPECT_EQ(
      keys(report["chains"][0]["hop_table"][0]),
      (Keys{"from", "to", "processing_ns", "communication_ns", "from_callback", "to_callback"}));
}

TEST(ReportJson, HasTheSixteenThatPreemptedLongest) {
  auto report = test::sample_report();
  auto& preemptors = report.callbacks[0].preempted_by;
  preemptors.clear();
  for (std::int64_t i = 0; i < 20; ++i)
    preemptors.push_back({.tid = i, .name = "hog", .time = {100 - i}});
  const auto told = json_of(report)["callbacks"][0]["preempted_by"];
  ASSERT_EQ(told.size(), 16U);
  EXPECT_EQ(told[0]["ns"], 100);
  EXPECT_EQ(told[15]["ns"], 85);
}

TEST(ReportJson, HasTheValues) {
  const auto report = json_of(test::sample_report());
  EXPECT_EQ(report["schema"], "cie.report/2");
  EXPECT_EQ(report["tool"]["name"], "cie");
  EXPECT_EQ(report["tool"]["version"], tool_version());
  EXPECT_EQ(report["trace"]["begin_ns"], 983'000'000'000);
  EXPECT_EQ(report["trace"]["complete"], true);
  EXPECT_EQ(report["defects"][0]["severity"], "info");
  const auto& timer = report["callbacks"][0];
  EXPECT_EQ(timer["response_time_ns"]["max"], 289'415);
  EXPECT_TRUE(timer["response_time_ns"]["mean"].is_number_float());
  EXPECT_EQ(timer["release_source"], "exact");
  EXPECT_EQ(timer["missed_releases"], 3);
  EXPECT_EQ(report["threads"][0]["sched"]["policy_name"], "SCHED_FIFO");
  EXPECT_EQ(report["threads"][0]["sched"]["cpus"], Json({0, 1, 3}));
}

TEST(ReportJson, SaysNullForWhatWasNotMeasured) {
  auto sample = test::sample_report();
  sample.trace.begin.reset();
  sample.trace.lost_events.reset();
  sample.processes[0].executor.reset();
  sample.chains[0].process.reset();
  sample.chains[0].hop_table[1].processing.reset();
  const auto report = json_of(sample);
  EXPECT_TRUE(report["trace"]["begin_ns"].is_null());
  EXPECT_TRUE(report["trace"]["lost_events"].is_null());
  EXPECT_TRUE(report["processes"][0]["executor"].is_null());
  EXPECT_TRUE(report["chains"][0]["pid"].is_null());
  EXPECT_TRUE(report["chains"][0]["hop_table"][1]["to"].is_null());
  EXPECT_TRUE(report["chains"][0]["hop_table"][1]["processing_ns"].is_null());
  for (const auto* key : {"undivided_ns", "from_start_ns", "path_latency_upper_ns", "response_ns"})
    EXPECT_FALSE(report["chains"][0].contains(key)) << key;
  sample.chains[0].undivided = test::summary(1, 2, 3);
  sample.chains[0].from_start = test::summary(1, 2, 4);
  sample.chains[0].path_latency_upper = test::summary(1, 2, 5);
  sample.chains[0].response = test::summary(1, 2, 6);
  sample.chains[0].hop_table[0].start_to_publish = test::summary(1, 2, 7);
  sample.chains[0].hop_table[0].publish_to_start = test::summary(1, 2, 8);
  const auto chain = json_of(sample)["chains"][0];
  EXPECT_EQ(chain["undivided_ns"]["count"], 3U);
  EXPECT_EQ(chain["from_start_ns"]["count"], 4U);
  EXPECT_EQ(chain["path_latency_upper_ns"]["count"], 5U);
  EXPECT_EQ(chain["response_ns"]["count"], 6U);
  EXPECT_EQ(chain["hop_table"][0]["start_to_publish_ns"]["count"], 7U);
  EXPECT_EQ(chain["hop_table"][0]["publish_to_start_ns"]["count"], 8U);
  const auto& service = report["callbacks"][2];
  for (const auto* key : {"period_ns", "group", "missed_releases", "release_source",
                          "response_time_ns", "execution_time_ns", "wakeup_latency_ns"}) {
    EXPECT_TRUE(service[key].is_null()) << key;
  }
  EXPECT_EQ(service["threads"], Json::array());
  EXPECT_TRUE(report["threads"][1]["sched"].is_null());
  EXPECT_TRUE(report["threads"][1]["role"].is_null());
}

TEST(ReportJson, KeepsIntegersOf64Bits) {
  auto sample = test::sample_report();
  sample.trace.events = std::numeric_limits<std::uint64_t>::max();
  sample.trace.begin->ns = std::numeric_limits<std::int64_t>::min();
  sample.callbacks[0].duration->sum = 9'007'199'254'740'993;  // 2^53 + 1
  const auto text = json_text_of(sample);
  EXPECT_NE(text.find("18446744073709551615"), std::string::npos);
  EXPECT_NE(text.find("-9223372036854775808"), std::string::npos);
  EXPECT_NE(text.find("\"sum\": 9007199254740993,"), std::string::npos);
}

TEST(ReportJson, SurvivesHostileNames) {
  auto sample = test::sample_report();
  sample.callbacks[0].logical_id = "quote \" backslash \\ escape \x1b[31m newline \n bad \xC3(";
  sample.callbacks[0].threads = {{.tid = 1, .name = "a", .instances = 1},
                                 {.tid = 2, .name = "b", .instances = 1}};
  sample.trace.hosts = {"one", "two"};  // two strings are an array, not a pair
  const auto text = json_text_of(sample);
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
  const auto report = Json::parse(text);
  EXPECT_EQ(report["callbacks"][0]["logical_id"],
            "quote \" backslash \\ escape \x1b[31m newline \n bad \xEF\xBF\xBD(");
  EXPECT_EQ(report["trace"]["hosts"], Json::array({"one", "two"}));
}

TEST(ReportJson, OfNothingIsStillComplete) {
  const auto report = json_of(analysis::Report{});
  EXPECT_EQ(report["callbacks"], Json::array());
  EXPECT_EQ(report["trace"]["paths"], Json::array());
  EXPECT_EQ(report["trace"]["lost_events"], 0);
}

}  // namespace
}  // namespace cie::viewer_export
