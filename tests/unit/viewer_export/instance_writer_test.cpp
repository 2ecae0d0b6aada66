#include <cie/viewer_export/instance_writer.hpp>

#include "sample_instances.hpp"

#include <sstream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace cie::viewer_export {
namespace {

using analysis::Duration;
using analysis::Instance;
using analysis::Timestamp;
using test::instance;

constexpr const char* kHeader =
    "logical_id,pid,tid,seq,release_ns,wakeup_ns,start_ns,end_ns,cpu_start,cpu_end,execution_ns,"
    "preempted_ns,blocked_ns,release_source,waking_ns,wake_delay_ns,missed,status,host\n";

// Has process 0.
analysis::Report on_robot() {
  analysis::Report report;
  report.processes.emplace_back().host = "robot";
  report.processes.back().pid = test::kPid;
  return report;
}

std::string written(InstanceWriter& writer, TableFormat format = TableFormat::csv) {
  std::ostringstream out;
  writer.write(out, format, on_robot());
  return out.str();
}

Instance full_instance() {
  Instance i = instance("/a@Timer(1)", 11, 18446744073709551615U, 100, 150, 250);
  i.wakeup = Timestamp{120};
  i.waking = Timestamp{110};
  i.cpu_start = 1;
  i.cpu_end = 0;
  i.execution = Duration{60};
  i.preempted = Duration{30};
  i.blocked = Duration{10};
  i.wake_delay = Duration{0};
  i.missed = 2;
  i.status = CallbackStatus::exception;
  return i;
}

TEST(InstanceCsv, HasTheColumnsOfTheContract) {
  InstanceWriter writer;
  writer.on_instance(full_instance());
  EXPECT_EQ(written(writer), std::string(kHeader) +
                                 "/a@Timer(1),4001,11,18446744073709551615,100,120,150,250,1,0,60,"
                                 "30,10,exact,110,0,2,exception,robot\n");
}

TEST(InstanceCsv, LeavesUnknownFieldsEmpty) {
  InstanceWriter writer;
  Instance open = instance("/a@Timer(1)", 11, 0, 100, 150, -1);
  open.release_source = analysis::ReleaseSource::wakeup;
  writer.on_instance(open);
  EXPECT_EQ(written(writer),
            std::string(kHeader) + "/a@Timer(1),4001,11,0,100,,150,,,,,,,wakeup,,,0,,robot\n");
}

TEST(InstanceCsv, WithoutASignOfReleaseTheStartIsTheBound) {
  InstanceWriter writer;
  writer.on_instance(instance("/a@Timer(1)", 11, 0, -1, 150, 160));
  EXPECT_EQ(written(writer),
            std::string(kHeader) + "/a@Timer(1),4001,11,0,150,,150,160,,,,,,start,,,0,ok,robot\n");
}

// As the analysis took back the releases of the first timer, and not those of the other.
TEST(InstanceCsv, TheStartIsTheBoundWhereACalculatedReleaseWasTakenBack) {
  InstanceWriter writer;
  auto report = on_robot();
  for (const auto number : {0U, 1U}) {
    auto row = instance("/a@Timer(1)", 11, number, 100, 150, 160);
    row.callback = analysis::CallbackIndex{number};
    row.release_source = analysis::ReleaseSource::timer_grid;
    row.missed = 3;
    writer.on_instance(row);
    report.callbacks.emplace_back().index = row.callback;
  }
  report.callbacks.back().response_time.emplace().count = 1;
  std::ostringstream out;
  writer.write(out, TableFormat::csv, report);
  EXPECT_EQ(out.str(), std::string(kHeader) +
                           "/a@Timer(1),4001,11,0,150,,150,160,,,,,,start,,,,ok,robot\n" +
                           "/a@Timer(1),4001,11,1,100,,150,160,,,,,,timer_grid,,,3,ok,robot\n");
}

TEST(InstanceCsv, OrdersByStartThenThreadHoweverRowsArriveAndHoweverFewFitInMemory) {
  for (const std::size_t rows_in_memory : {std::size_t{1}, std::size_t{2}, std::size_t{100}}) {
    InstanceWriter writer({}, rows_in_memory);
    writer.on_instance(instance("b", 12, 0, -1, 300, 310));
    writer.on_instance(instance("c", 13, 0, -1, 200, 320));
    writer.on_instance(instance("a", 11, 1, -1, 300, 330));
    writer.on_instance(instance("a", 11, 0, -1, 100, -1));
    EXPECT_EQ(written(writer), std::string(kHeader) +
                                   "a,4001,11,0,100,,100,,,,,,,start,,,0,,robot\n"
                                   "c,4001,13,0,200,,200,320,,,,,,start,,,0,ok,robot\n"
                                   "a,4001,11,1,300,,300,330,,,,,,start,,,0,ok,robot\n"
                                   "b,4001,12,0,300,,300,310,,,,,,start,,,0,ok,robot\n");
  }
}

TEST(InstanceCsv, QuotesHostileNames) {
  InstanceWriter writer;
  writer.on_instance(instance("a,\"b\"\xFF", 11, 0, -1, 1, 2));
  EXPECT_EQ(written(writer),
            std::string(kHeader) +
                "\"a,\"\"b\"\"\xEF\xBF\xBD\",4001,11,0,1,,1,2,,,,,,start,,,0,ok,robot\n");
}

TEST(InstanceCsv, TellsHostsApartWhosePidsAndTidsAreTheSame) {
  auto report = on_robot();
  report.processes.push_back(report.processes.front());
  report.processes.front().index = analysis::ProcessIndex{1};
  report.processes.back().host = "desk";
  for (const auto order : {InstanceOrder::by_start, InstanceOrder::by_process}) {
    InstanceWriter writer({}, 10, order);
    for (const std::uint32_t host : {1U, 0U}) {
      auto i = instance("a", 11, 0, -1, 100 + host, 110);
      i.callback = analysis::CallbackIndex{host};
      i.process = analysis::ProcessIndex{1 - host};
      writer.on_instance(i);
    }
    std::ostringstream out;
    writer.write(out, TableFormat::csv, report);
    const std::string robot = "a,4001,11,0,100,,100,110,,,,,,start,,,0,ok,robot\n";
    const std::string desk = "a,4001,11,0,101,,101,110,,,,,,start,,,0,ok,desk\n";
    // By process: in the order in which they were met first.
    EXPECT_EQ(out.str(),
              kHeader + (order == InstanceOrder::by_start ? robot + desk : desk + robot));
  }
}

TEST(InstanceCsv, LeavesTheThreadEmptyWhereEventsDoNotTellIt) {
  InstanceWriter writer;
  writer.on_instance(instance("a", -1, 0, -1, 100, 110));  // no context vtid
  EXPECT_EQ(written(writer),
            std::string(kHeader) + "a,4001,,0,100,,100,110,,,,,,start,,,0,ok,robot\n");
}

TEST(InstanceCsv, OfNothingIsAHeader) {
  InstanceWriter writer;
  EXPECT_EQ(written(writer), kHeader);
}

TEST(InstanceJsonLines, HasTheSameNamesAndNullForUnknown) {
  InstanceWriter writer;
  writer.on_instance(full_instance());
  writer.on_instance(instance("line\nbreak \"quoted\" \x1b[31m", 12, 0, 400, 500, -1));
  std::istringstream lines(written(writer, TableFormat::json_lines));
  std::string line;
  ASSERT_TRUE(std::getline(lines, line));
  EXPECT_EQ(line, R"x({"logical_id":"/a@Timer(1)","pid":4001,"tid":11,"seq":18446744073709551615,)x"
                  R"x("release_ns":100,"wakeup_ns":120,"start_ns":150,"end_ns":250,"cpu_start":1,)x"
                  R"x("cpu_end":0,"execution_ns":60,"preempted_ns":30,"blocked_ns":10,)x"
                  R"x("release_source":"exact","waking_ns":110,"wake_delay_ns":0,"missed":2,)x"
                  R"x("status":"exception","host":"robot"})x");
  ASSERT_TRUE(std::getline(lines, line));
  const auto row = nlohmann::json::parse(line);
  EXPECT_EQ(row.at("logical_id"), "line\nbreak \"quoted\" \x1b[31m");
  EXPECT_TRUE(row.at("end_ns").is_null());
  EXPECT_TRUE(row.at("cpu_start").is_null());
  EXPECT_TRUE(row.at("status").is_null());
  EXPECT_EQ(row.size(), 19U);
  EXPECT_FALSE(std::getline(lines, line)) << line;
}

}  // namespace
}  // namespace cie::viewer_export
