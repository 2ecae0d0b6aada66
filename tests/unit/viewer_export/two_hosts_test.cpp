// Every output of an application that ran on two hosts with the same names, pids, tids and ids:
// what happened on one is never told of the other.
#include "support/two_hosts.hpp"

#include <cie/analysis/report_rows.hpp>
#include <cie/analysis/schedulability.hpp>
#include <cie/viewer_export/graph_writer.hpp>
#include <cie/viewer_export/html_report.hpp>
#include <cie/viewer_export/instance_writer.hpp>
#include <cie/viewer_export/perfetto_export.hpp>
#include <cie/viewer_export/report_writers.hpp>
#include <cie/viewer_export/schedulability_writers.hpp>
#include <cie/viewer_export/tables.hpp>
#include <cie/viewer_export/verify_writers.hpp>
#include <cie/viewer_export/viewer_exports.hpp>

#include "perfetto_file.hpp"

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace cie::viewer_export {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::UnorderedElementsAre;
using Json = nlohmann::ordered_json;
using Rows = std::vector<std::vector<std::string>>;

analysis::AnalysisResult two_hosts(analysis::Observer* observer = nullptr,
                                   const SchedulingSpec* spec = nullptr) {
  static const auto trace = test::application_on_two_hosts();
  return test::analyze(trace, {.spec = spec}, observer);
}

// Which `plan` keeps on the robot, and not on the desk.
SchedulingSpec with_deadline() {
  return SchedulingSpec::parse("callback_groups:\n  - {id: plan, response_deadline: 10}\n",
                               "spec.yaml");
}

template <typename Write>
std::string text_of(Write write) {
  std::ostringstream out;
  write(out);
  return out.str();
}

Json report_json() {
  return Json::parse(
      text_of([](std::ostream& out) { write_report_json(out, two_hosts().report); }));
}

// The row of that number.
const Json& row(const Json& rows, const Json& index) {
  for (const auto& candidate : rows) {
    if (candidate["index"] == index) return candidate;
  }
  throw std::out_of_range(index.dump());
}

// Cells of those columns, line by line; without quotes in it.
Rows columns_of(const std::string& csv, const std::vector<std::string>& names) {
  const auto cells_of = [](const std::string& line) {
    std::istringstream stream(line + ',');
    std::vector<std::string> cells;
    for (std::string cell; std::getline(stream, cell, ',');)
      cells.push_back(cell);
    return cells;
  };
  std::istringstream stream(csv);
  std::string line;
  std::getline(stream, line);
  const auto header = cells_of(line);
  Rows rows;
  while (std::getline(stream, line)) {
    const auto cells = cells_of(line);
    auto& kept = rows.emplace_back();
    for (const auto& name : names) {
      const auto at = std::ranges::find(header, name) - header.begin();
      kept.push_back(cells.at(static_cast<std::size_t>(at)));
    }
  }
  return rows;
}

Rows table(const std::string& name, const std::vector<std::string>& columns) {
  return columns_of(
      text_of([&](std::ostream& out) { write_table(out, name, TableFormat::csv, two_hosts()); }),
      columns);
}

TEST(TwoHosts, AreToldApartByTheReportsRows) {
  const auto report = report_json();
  EXPECT_EQ(report["trace"]["hosts"], Json({"desk", "robot"}));
  ASSERT_EQ(report["processes"].size(), 2U);
  std::map<std::pair<std::string, std::string>, Json> longest;
  for (const auto& callback : report["callbacks"]) {
    const auto& process = row(report["processes"], callback["process"]);
    EXPECT_EQ(process["host"], callback["host"]);
    const auto& response = callback["response_time_ns"];
    longest[{process["host"], callback["logical_id"]}] =
        response.is_null() ? response : response["max"];
    for (const auto& thread : callback["threads"]) {
      const auto& other = row(report["threads"], thread["thread"]);
      EXPECT_EQ(other["process"], callback["process"]);
      EXPECT_EQ(other["callbacks"], Json::array({callback["logical_id"]}));
    }
  }
  EXPECT_EQ(longest,
            (std::map<std::pair<std::string, std::string>, Json>{{{"robot", "plan"}, 2},
                                                                 {{"robot", "show"}, 3},
                                                                 {{"robot", "idle"}, nullptr},
                                                                 {{"desk", "plan"}, 52},
                                                                 {{"desk", "show"}, 90},
                                                                 {{"desk", "idle"}, nullptr}}));
}

TEST(TwoHosts, HaveEdgesAndChainsOfTheirOwn) {
  const auto report = report_json();
  std::map<std::string, Json> communication;
  for (const auto& edge : report["edges"]) {
    const auto& from = row(report["callbacks"], edge["from"]);
    const auto& to = row(report["callbacks"], edge["to"]);
    EXPECT_EQ(from["process"], to["process"]);
    EXPECT_EQ(from["logical_id"], "plan");
    communication[from["host"]] = edge["communication_ns"]["max"];
  }
  EXPECT_EQ(communication, (std::map<std::string, Json>{{"robot", 14 - 11}, {"desk", 100 - 25}}));
  std::map<std::string, Json> latency;
  for (const auto& chain : report["chains"]) {
    const auto& process = row(report["processes"], chain["process"]);
    for (std::size_t i = 0; i < chain["callbacks"].size(); ++i) {
      const auto& callback = row(report["callbacks"], chain["callbacks"][i]);
      EXPECT_EQ(callback["process"], chain["process"]);
      EXPECT_EQ(chain["hop_table"][i]["from_callback"], callback["index"]);
      EXPECT_EQ(chain["hop_table"][i]["from"], callback["logical_id"]);
    }
    latency[process["host"]] = chain["path_latency_ns"]["max"];
  }
  EXPECT_EQ(latency, (std::map<std::string, Json>{{"robot", 17 - 10}, {"desk", 190 - 20}}));
}

TEST(TwoHosts, HaveHistogramsAndLanesOfTheirOwnOnThePage) {
  HtmlReport page;
  static const auto trace = test::application_on_two_hosts();
  const auto result = test::analyze(trace, {.keep_buckets = true}, &page);
  const auto html = text_of([&](std::ostream& out) { page.write(out, result, nullptr); });
  const auto begin = html.find('>', html.find("id=\"document\"")) + 1;
  const auto document = Json::parse(html.substr(begin, html.find("</script>", begin) - begin));
  const auto& report = document["report"];
  const auto& lanes = document["timeline"];
  std::set<int> drawn;
  for (const auto& lane : lanes["lanes"]) {
    EXPECT_EQ(lane["count"], 1);
    EXPECT_TRUE(drawn.insert(lane["callback"].get<int>()).second);
  }
  EXPECT_EQ(drawn.size(), 4U);
  for (std::size_t i = 0; i < report["callbacks"].size(); ++i) {
    const auto& response = report["callbacks"][i]["response_time_ns"];
    const auto& buckets = document["histograms"][i];
    EXPECT_EQ(drawn.contains(static_cast<int>(i)), !response.is_null());
    ASSERT_EQ(buckets.size(), response.is_null() ? 0U : 1U);
    if (response.is_null()) continue;
    EXPECT_EQ(buckets[0], Json::array({response["max"], 1})) << "below 128 ns it is exact";
  }
}

TEST(TwoHosts, AreTwoClustersOfTheGraph) {
  const auto dot = text_of([](std::ostream& out) { write_graph_dot(out, two_hosts().report); });
  EXPECT_THAT(dot, HasSubstr("label=\"pid 100 on robot\";"));
  EXPECT_THAT(dot, HasSubstr("label=\"pid 100 on desk\";"));
  EXPECT_THAT(dot, Not(HasSubstr("style=dashed"))) << "no message left its process";
  EXPECT_THAT(dot, HasSubstr("latency p50 3 ns, max 3 ns"));
  EXPECT_THAT(dot, HasSubstr("latency p50 75 ns, max 75 ns"));
  std::set<std::string> nodes;
  std::istringstream lines(dot);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("    \"")) nodes.insert(line.substr(0, line.find(" [")));
  }
  EXPECT_EQ(nodes.size(), 4U) << "of each host the two that a message links";
}

TEST(TwoHosts, AreTwoTablesOfTheText) {
  const auto text = text_of([](std::ostream& out) {
    const auto result = two_hosts();
    write_report_text(out, result.report, &result.verdicts, {});
  });
  for (const std::string what : {"Callbacks", "Threads"}) {
    for (const std::string host : {"robot", "desk"}) {
      const auto title = what + " of pid 100 on " + host + ", isolated executor";
      const auto at = text.find(title);
      ASSERT_NE(at, std::string::npos) << title << " is not in\n" << text;
      EXPECT_EQ(text.find(title, at + 1), std::string::npos) << "one table for each";
    }
  }
  const auto robot = text.find("Callbacks of pid 100 on robot");
  EXPECT_LT(text.find("52 ns"), text.size());
  EXPECT_THAT(text.substr(robot, text.find("\n\n", robot) - robot), Not(HasSubstr("52 ns")));
  EXPECT_THAT(text, HasSubstr("longest response time       90 ns  show (pid 100 on desk)"));
  EXPECT_THAT(text, HasSubstr("(pid 100 on robot): 2 callbacks, 1 instance complete"));
  EXPECT_THAT(text, HasSubstr("(pid 100 on desk): 2 callbacks, 1 instance complete"));
  EXPECT_THAT(text, HasSubstr("never ran                  2 of 6  callbacks"));
}

TEST(TwoHosts, AreNamedByEveryTable) {
  using Row = std::vector<std::string>;
  EXPECT_THAT(
      table("callbacks", {"host", "pid", "logical_id", "response_time_ns_max", "isolation"}),
      UnorderedElementsAre(Row{"robot", "100", "plan", "2", "isolated"},
                           Row{"robot", "100", "show", "3", "isolated"},
                           Row{"robot", "100", "idle", "", "never_ran"},
                           Row{"desk", "100", "plan", "52", "isolated"},
                           Row{"desk", "100", "show", "90", "isolated"},
                           Row{"desk", "100", "idle", "", "never_ran"}));
  EXPECT_THAT(table("callback_threads", {"host", "logical_id", "instances"}),
              UnorderedElementsAre(Row{"robot", "plan", "1"}, Row{"robot", "show", "1"},
                                   Row{"desk", "plan", "1"}, Row{"desk", "show", "1"}));
  EXPECT_THAT(table("threads", {"host", "name", "priority"}),
              UnorderedElementsAre(Row{"robot", "plan", "80"}, Row{"robot", "show", "70"},
                                   Row{"robot", "idle", "0"}, Row{"desk", "plan", "60"},
                                   Row{"desk", "show", "70"}, Row{"desk", "idle", "0"}));
  EXPECT_THAT(table("processes", {"host", "pid"}),
              UnorderedElementsAre(Row{"robot", "100"}, Row{"desk", "100"}));
  EXPECT_THAT(table("edges", {"from_host", "to_host", "communication_ns_max"}),
              UnorderedElementsAre(Row{"robot", "robot", "3"}, Row{"desk", "desk", "75"}));
  EXPECT_THAT(table("chains", {"host", "path_latency_ns_max"}),
              UnorderedElementsAre(Row{"robot", "7"}, Row{"desk", "170"}));
  EXPECT_THAT(table("chain_hops", {"host", "from_logical_id", "processing_ns_max"}),
              UnorderedElementsAre(Row{"robot", "plan", "1"}, Row{"robot", "show", "3"},
                                   Row{"desk", "plan", "5"}, Row{"desk", "show", "90"}));
  InstanceWriter instances;
  const auto result = two_hosts(&instances);
  EXPECT_THAT(columns_of(text_of([&](std::ostream& out) {
                           instances.write(out, TableFormat::csv, result.report);
                         }),
                         {"host", "logical_id", "start_ns"}),
              UnorderedElementsAre(Row{"robot", "plan", "10"}, Row{"robot", "show", "15"},
                                   Row{"desk", "plan", "5000020"}, Row{"desk", "show", "5000130"}));
}

TEST(TwoHosts, AreNamedByVerdicts) {
  const auto result = two_hosts();
  std::set<std::string> subjects;
  for (const auto& rule : result.verdicts.rules) {
    if (rule.id != "M3") continue;
    for (const auto& subject : rule.subjects)
      subjects.insert(subject.subject);
  }
  EXPECT_TRUE(subjects.contains("callback plan (pid 100 on robot)"));
  EXPECT_TRUE(subjects.contains("callback plan (pid 100 on desk)"));
}

TEST(TwoHosts, HaveVerdictsOfTheirOwn) {
  const auto spec = with_deadline();
  const auto result = two_hosts(nullptr, &spec);
  const analysis::ReportRows rows(result.report);
  std::map<std::string, analysis::Verdict> deadline;
  for (const auto& rule : result.verdicts.rules) {
    for (const auto& subject : rule.subjects) {
      if (subject.about.kind != analysis::SubjectKind::callback) continue;
      const auto* callback = rows.find(analysis::CallbackIndex{subject.about.index.value()});
      ASSERT_NE(callback, nullptr) << subject.subject;
      EXPECT_EQ(subject.about.process, callback->process);
      const auto& host = rows.process_of(*callback).host;
      EXPECT_EQ(subject.name(), "callback " + callback->logical_id);
      EXPECT_EQ(subject.place, " (pid 100 on " + host + ")");
      if (rule.id == "R3" && callback->logical_id == "plan") deadline[host] = subject.verdict;
    }
  }
  EXPECT_EQ(deadline, (std::map<std::string, analysis::Verdict>{
                          {"robot", analysis::Verdict::pass}, {"desk", analysis::Verdict::fail}}));
}

TEST(TwoHosts, AreReachedFromVerdictsByTheReportsRows) {
  const auto spec = with_deadline();
  const auto result = two_hosts(nullptr, &spec);
  const auto report = report_json();
  const auto verdicts = Json::parse(
      text_of([&](std::ostream& out) { write_verify_json(out, result.verdicts, result.report); }));
  std::map<std::string, Json> deadline;
  for (const auto& rule : verdicts["rules"]) {
    if (rule["id"] != "R3") continue;
    for (const auto& subject : rule["subjects"]) {
      ASSERT_EQ(subject["kind"], "callback");
      const auto& callback = row(report["callbacks"], subject["index"]);
      EXPECT_EQ(callback["process"], subject["process"]);
      if (callback["logical_id"] == "plan") deadline[callback["host"]] = subject["verdict"];
    }
  }
  EXPECT_EQ(deadline, (std::map<std::string, Json>{{"robot", "PASS"}, {"desk", "FAIL"}}));
}

TEST(TwoHosts, AreNamedByEveryFormatOfVerdicts) {
  const auto spec = with_deadline();
  const auto result = two_hosts(nullptr, &spec);
  const auto& report = result.report;
  const auto& verdicts = result.verdicts;
  const auto named = HasSubstr("callback plan (pid 100 on desk)");
  EXPECT_THAT(text_of([&](std::ostream& out) { write_verify_junit(out, verdicts, report); }),
              named);
  EXPECT_THAT(text_of([&](std::ostream& out) { write_verify_sarif(out, verdicts, report); }),
              named);
  EXPECT_THAT(text_of([&](std::ostream& out) { write_verify_tap(out, verdicts, report); }), named);
  EXPECT_THAT(text_of([&](std::ostream& out) { write_verify_json(out, verdicts, report); }), named);
}

TEST(TwoHosts, HaveBoundsOfTheirOwn) {
  const auto spec = SchedulingSpec::parse(
      "callback_groups:\n"
      "  - {id: plan, wcet: 60, min_inter_arrival: 100}\n"
      "  - {id: show, wcet: 60, min_inter_arrival: 200}\n",
      "spec.yaml");
  const auto report = two_hosts().report;
  const auto result = analysis::schedulability_of(report, &spec);
  const auto json = Json::parse(
      text_of([&](std::ostream& out) { write_schedulability_json(out, result, report); }));
  std::map<std::pair<std::string, std::string>, Json> bounds;
  for (const auto& callback : json["callbacks"])
    bounds[{callback["host"], callback["logical_id"]}] = callback["bound_ns"];
  EXPECT_EQ((bounds[{"robot", "plan"}]), 60);
  EXPECT_EQ((bounds[{"desk", "plan"}]), 60 + 60);
  const auto text =
      text_of([&](std::ostream& out) { write_schedulability_text(out, result, report, {}); });
  EXPECT_THAT(text, HasSubstr("plan (pid 100 on robot)"));
  EXPECT_THAT(text, HasSubstr("plan (pid 100 on desk)"));
}

TEST(TwoHosts, HaveTheirViolationsOnTheirMachinesOfPerfetto) {
  const auto spec = with_deadline();
  PerfettoExport perfetto({});
  const auto result = two_hosts(&perfetto, &spec);
  const auto file = test::decode(text_of([&](std::ostream& out) { perfetto.write(out, result); }));
  std::set<std::uint64_t> violated;
  std::set<std::uint64_t> late;  // the machine on which `plan` of the desk starts
  for (const auto& event : file.events) {
    const auto track = file.tracks.find(event.track);
    if (event.type == 3 && track != file.tracks.end() && track->second == "Enforcement")
      violated.insert(event.machine);
    if (event.type == 1 && event.time == 5'000'020) late.insert(event.machine);
  }
  ASSERT_EQ(late.size(), 1U);
  EXPECT_EQ(violated, late);
}

TEST(TwoHosts, AreTwoMachinesOfPerfetto) {
  PerfettoExport perfetto({});
  const auto result = two_hosts(&perfetto);
  const auto file = test::decode(text_of([&](std::ostream& out) { perfetto.write(out, result); }));
  EXPECT_EQ(file.machines.size(), 2U);
  std::set<std::uint64_t> tracks;  // where instances begin
  for (const auto& event : file.events) {
    const std::set<std::uint64_t> starts{10, 15, 5'000'020, 5'000'130};
    if (event.type == 1 && starts.contains(event.time)) tracks.insert(event.track);
  }
  EXPECT_GE(tracks.size(), 4U);
}

Json exported(std::string_view format) {
  const auto viewer = make_viewer_export(format, {});
  const auto result = two_hosts(viewer.get());
  return Json::parse(text_of([&](std::ostream& out) { viewer->write(out, result); }));
}

TEST(TwoHosts, AreTwoProcessesOfChrome) {
  const auto chrome = exported("chrome");
  std::map<std::string, std::set<std::int64_t>> pids;
  std::map<std::int64_t, std::string> names;
  for (const auto& event : chrome["traceEvents"]) {
    if (event["cat"] == "callback") pids[event["name"]].insert(event["pid"].get<std::int64_t>());
    if (event["name"] == "process_name")
      names[event["pid"].get<std::int64_t>()] = event["args"]["name"];
  }
  ASSERT_EQ(pids["plan"].size(), 2U);
  EXPECT_EQ(pids["plan"], pids["show"]);
  EXPECT_THAT(names[*pids["plan"].begin()], HasSubstr("(pid 100 on robot)"));
  EXPECT_THAT(names[*pids["plan"].rbegin()], HasSubstr("(pid 100 on desk)"));
}

TEST(TwoHosts, HaveProfilesOfTheirOwnInSpeedscope) {
  std::set<std::string> names;
  const auto speedscope = exported("speedscope");
  for (const auto& profile : speedscope["profiles"]) {
    EXPECT_EQ(profile["events"].size(), 2U);
    names.insert(profile["name"].get<std::string>());
  }
  EXPECT_EQ(names.size(), 4U);
}

TEST(TwoHosts, AreNamedByTheMessagesOfMcap) {
  const auto viewer = make_viewer_export("mcap", {});
  const auto result = two_hosts(viewer.get());
  const auto text = text_of([&](std::ostream& out) { viewer->write(out, result); });
  for (const std::string host : {"robot", "desk"}) {
    EXPECT_THAT(text, HasSubstr(R"("logical_id":"plan","host":")" + host + R"(","pid":100)"));
    EXPECT_THAT(text, HasSubstr(R"("topic":"/a","host":")" + host + R"(","pid":100)"));
  }
}

TEST(TwoHosts, AreTwoResourcesOfOpenTelemetry) {
  const auto viewer = make_viewer_export("otlp", {});
  const auto result = two_hosts(viewer.get());
  const auto text = text_of([&](std::ostream& out) { viewer->write(out, result); });
  EXPECT_THAT(text, HasSubstr("robot"));
  EXPECT_THAT(text, HasSubstr("desk"));
}

}  // namespace
}  // namespace cie::viewer_export
