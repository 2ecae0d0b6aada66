#include <cie/tracepoints/schema.hpp>
#include <cie/viewer_export/report_writers.hpp>

#include "sample_report.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

std::string report_text_of(const analysis::Report& report,
                           const analysis::VerdictReport* verdicts = nullptr,
                           const TextStyle& style = {}) {
  std::ostringstream out;
  write_report_text(out, report, verdicts, style);
  return out.str();
}

void expect_within(const std::string& text, std::size_t columns) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    EXPECT_LE(display_width(line), columns) << line;
  }
}

TEST(ReportText, SaysFirstWhatMatters) {
  const auto verdicts = test::sample_verdicts();
  const auto text = report_text_of(test::sample_report(), &verdicts);
  const auto expect_order = [&](std::initializer_list<std::string_view> parts) {
    std::size_t at = 0;
    for (const auto part : parts) {
      const auto found = text.find(part, at);
      ASSERT_NE(found, std::string::npos) << part << " is missing or too early in\n" << text;
      at = found;
    }
  };
  expect_order({"Verdict    FAIL: 1 rule violated (M2 one-callback-per-thread)", "Worst", "Trace ",
                "Processes", "Defects of the trace", "Callbacks of pid 4001", "Threads of pid 4001",
                "Chain braking", "Notes"});
}

// As the column before it counts instances: those that ended, and those that did not.
TEST(ReportText, CountsLateInstancesThatNeverEnded) {
  auto report = test::sample_report();
  auto& callback = report.callbacks[0];
  callback.incomplete = 1;
  callback.response_deadline = analysis::Duration{1'000'000};
  const auto row = [&report] {
    const auto text = report_text_of(report, nullptr, {.columns = 200});
    const auto begin = text.find("/a/plan@Timer(20000000)", text.find("Callbacks of pid"));
    return text.substr(begin, text.find('\n', begin) - begin);
  };
  callback.late = 0;
  EXPECT_THAT(row(), testing::ContainsRegex("7\\+1 .* 1\\.000 ms +0 "));
  callback.late_open = 1;
  EXPECT_THAT(row(), testing::ContainsRegex("7\\+1 .* 1\\.000 ms +0\\+1 "));
  callback.late = 2;
  EXPECT_THAT(row(), testing::ContainsRegex("7\\+1 .* 1\\.000 ms +2\\+1 "));
}

TEST(ReportText, SaysHowManyMessagesCameFromPublishersThatWereNotRecorded) {
  auto report = test::sample_report();
  report.edges.resize(2);
  report.edges[0].messages = 5;
  report.edges[1].messages = 7;
  const auto text = [&report] { return report_text_of(report, nullptr, {.columns = 200}); };
  EXPECT_THAT(text(), Not(HasSubstr("messages taken")));
  report.edges[0].unrecorded = 2;
  EXPECT_THAT(text(), HasSubstr("\n2 of 12 messages taken came from publishers that were not "
                                "recorded\n"));
}

TEST(ReportText, SaysWhoseMessagesWereNotSent) {
  auto report = test::sample_report();
  const auto text = [&report] { return report_text_of(report, nullptr, {.columns = 200}); };
  EXPECT_THAT(text(), Not(HasSubstr("not sent")));
  report.processes.front().unsent = {{.node = "/a", .topic = "/scan", .messages = 1}};
  EXPECT_THAT(text(),
              HasSubstr("\n1 message was not sent in time and reached nobody: 1 on /scan\n"));
  report.processes.front().unsent->push_back({.node = "/a", .topic = "/map", .messages = 2});
  EXPECT_THAT(text(), HasSubstr("\n3 messages were not sent in time and reached nobody: 2 on /map, "
                                "1 on /scan\n"));
}

// Where ids are wanted, one can find it in the other outputs.
TEST(ReportText, NamesAChainWithoutASpecByItsFirstAndLastCallback) {
  auto report = test::sample_report();
  auto& chain = report.chains.front();
  chain.is_specified = false;
  chain.hops = {"/a/lidar@Timer(1000)", "/a/brake@Subscription(/stop)"};
  chain.name = chain.hops[0] + " -> " + chain.hops[1];
  const auto text = report_text_of(report, nullptr, {.columns = 200, .ids = true});
  EXPECT_THAT(text, HasSubstr("\nChain /a/lidar@Timer(1000) -> /a/brake@Subscription(/stop): 2 "));
}

TEST(ReportText, SaysThatARecordingIsIncompleteOnlyWhereSomethingIsMissing) {
  auto report = test::sample_report();
  report.defects.clear();
  report.trace.complete = false;
  const TextStyle wide{.columns = 200};
  EXPECT_THAT(report_text_of(report, nullptr, wide), HasSubstr("complete is not known"));
  report.defects = {{.kind = analysis::DefectKind::sched_switch_gaps,
                     .severity = analysis::Severity::loss,
                     .count = 1,
                     .advice = "record again"}};
  EXPECT_THAT(report_text_of(report, nullptr, wide), HasSubstr("complete is not known"))
      << "the kernel's are missing, no event of an application is";
  report.processes.front().complete = false;
  EXPECT_THAT(report_text_of(report, nullptr, wide), HasSubstr("NOT complete"));
}

TEST(ReportText, NamesTheWorstOffenders) {
  const auto text = report_text_of(test::sample_report());
  // At least 2.5 ms, where the longest one that is known exactly took 289.4 us.
  EXPECT_THAT(text, HasSubstr("longest response time   >2.500 ms  " +
                              test::sample_report().callbacks[1].logical_id + "\n"));
  auto exact = test::sample_report();
  exact.callbacks.erase(exact.callbacks.begin() + 1);
  EXPECT_THAT(report_text_of(exact),
              HasSubstr("longest response time    289.4 us  /a/plan@Timer(20000000)\n"));
  EXPECT_THAT(text, HasSubstr("most missed releases            3  /a/plan@Timer(20000000)\n"));
  EXPECT_THAT(
      text,
      HasSubstr("not isolated               1 of 2  callbacks that ran do not have a thread"));
  EXPECT_THAT(text, HasSubstr("never ran                  1 of 3  callbacks\n"));
}

TEST(ReportText, NamesTheLongestQueueAndTheMostExceptionsAndLosses) {
  auto report = test::sample_report();
  EXPECT_THAT(report_text_of(report), Not(HasSubstr("longest queue")));
  report.callbacks[1].longest_queue = 1;
  EXPECT_THAT(report_text_of(report), Not(HasSubstr("longest queue"))) << "nothing waits behind it";
  report.callbacks[1].longest_queue = 12;
  report.callbacks[0].exceptions = 3;
  report.callbacks[1].lost_samples = 4;
  report.callbacks[1].overwritten_samples = 5;
  const auto text = report_text_of(report);
  EXPECT_THAT(text,
              HasSubstr("longest queue          12 samples  " + report.callbacks[1].logical_id));
  EXPECT_THAT(text,
              HasSubstr("most exceptions                 3  " + report.callbacks[0].logical_id));
  EXPECT_THAT(text,
              HasSubstr("most lost samples               4  " + report.callbacks[1].logical_id));
  EXPECT_THAT(text,
              HasSubstr("most overwritten        5 samples  " + report.callbacks[1].logical_id));
}

TEST(ReportText, SaysWhoRanInsteadOfThePreempted) {
  auto report = test::sample_report();
  report.callbacks[0].preempted = test::summary(0, 2'500'000, 7);
  report.callbacks[0].preempted->sum = 7'000'000;
  report.callbacks[0].preempted_by = {{.tid = 77, .name = "hog\x1b", .time = {2'500'000}}};
  const auto text = report_text_of(report);
  EXPECT_THAT(text, HasSubstr("    longest by             2.500 ms  hog"));
  EXPECT_THAT(text, HasSubstr("(thread 77), of 7.000 ms in all its instances\n"));
  EXPECT_THAT(text, Not(HasSubstr("\x1b")));
}

TEST(ReportText, NamesNoIdleThreadAsPreemptor) {
  auto report = test::sample_report();
  report.callbacks[0].preempted = test::summary(0, 2'500'000, 7);
  report.callbacks[0].preempted->sum = 7'000'000;
  report.callbacks[0].preempted_by = {{.tid = 0, .name = "swapper/1", .time = {6'000'000}}};
  auto text = report_text_of(report);
  EXPECT_THAT(text, Not(HasSubstr("longest by")));
  EXPECT_THAT(text, Not(HasSubstr("swapper")));
  EXPECT_THAT(text, HasSubstr("    its CPU was idle       6.000 ms  "));
  report.callbacks[0].preempted_by.push_back({.tid = 77, .name = "hog", .time = {1'000'000}});
  text = report_text_of(report);
  EXPECT_THAT(text, HasSubstr("    longest by             1.000 ms  hog (thread 77)"));
  EXPECT_THAT(text, HasSubstr("    its CPU was idle       6.000 ms  "));
}

TEST(ReportText, NeverPrintsZeroForWhatWasNotMeasured) {
  const auto text = report_text_of(test::sample_report());
  EXPECT_THAT(
      text, HasSubstr("7+1  >1.750 ms  >2.500 ms  >2.500 ms         -         -       -     NO\n"));
  EXPECT_THAT(text, HasSubstr("\"-\" means not measured, never zero."));
  EXPECT_THAT(text, HasSubstr("cie record --kernel=yes"));
}

TEST(ReportText, ARunWhoseReleaseIsNotKnownMayBeTheLongest) {
  auto report = test::sample_report();
  report.callbacks[0].response_time_lower = test::summary(50'000'000, 50'000'000, 1);
  auto all = *report.callbacks[0].response_time;
  all.count = 8;
  all.p99 = all.max = 50'000'000;
  report.callbacks[0].response_time_at_least = all;
  const auto text = report_text_of(report);
  EXPECT_THAT(text, HasSubstr("  >187.3 us  >50.00 ms  >50.00 ms  14.88 us"));
  EXPECT_THAT(text, HasSubstr("longest response time   >50.00 ms  /a/plan@Timer(20000000)\n"));
}

// As of ROS 2: no release is known, nor who the threads are.
TEST(ReportText, OfBoundsAloneHasTheColumnsThatHaveValues) {
  auto report = test::sample_report();
  report.callbacks = {report.callbacks[1]};
  report.callbacks[0].inter_arrival = report.callbacks[0].duration;
  report.callbacks[0].inter_arrival->p50 = 20'000'000;
  report.threads = {report.threads[1]};
  const auto text = report_text_of(report);
  EXPECT_THAT(text, HasSubstr("response  duration   iso-\n"));
  EXPECT_THAT(text, HasSubstr("7+1  20.00 ms  >1.750 ms  >2.500 ms  >2.500 ms  2.400 ms     NO\n"));
  EXPECT_THAT(text, HasSubstr("  thread      tid  callback\n"));
}

TEST(ReportText, HasDeadlinesWithTheirLateInstances) {
  auto report = test::sample_report();
  EXPECT_THAT(report_text_of(report), Not(HasSubstr("deadline")));
  report.callbacks[0].response_deadline = analysis::Duration{200'000};
  report.callbacks[0].late = 2;
  EXPECT_THAT(report_text_of(report), HasSubstr("289.4 us  200.0 us     2  14.88 us"));
}

TEST(ReportText, NamesAFewOfThoseThatNeverRan) {
  auto report = test::sample_report();
  EXPECT_THAT(report_text_of(report),
              HasSubstr("1 callback never ran\n  /a/plan@Service(/never called)\n\n"));
  const auto idle = report.callbacks[2];
  for (int i = 0; i < 9; ++i)
    report.callbacks.push_back(idle);
  EXPECT_THAT(report_text_of(report),
              HasSubstr("10 callbacks never ran\n  /a/plan@Service(/never called)\n"));
  EXPECT_THAT(report_text_of(report), HasSubstr("  and 6 more; --format csv has all\n"));
}

TEST(ReportText, TellsWhatNeverRanFromWhatRanUnseen) {
  auto report = test::sample_report();
  report.callbacks.push_back(report.callbacks[2]);
  report.callbacks[3].logical_id = "/b@Service(/asked before)";
  report.callbacks[3].runs_not_seen = 50;
  const auto text = report_text_of(report);
  EXPECT_THAT(text, HasSubstr("  no instance seen           1 of 4  callbacks\n"
                              "  never ran                  1 of 4  callbacks\n"));
  EXPECT_THAT(text, HasSubstr("1 callback ran, but in nothing of what was recorded\n"
                              "  /b@Service(/asked before)\n"));
}

TEST(ReportText, SaysResponseTimeAndNeverLatencyForIt) {
  const auto text = report_text_of(test::sample_report());
  EXPECT_THAT(text, HasSubstr("response time"));
  EXPECT_THAT(text, Not(HasSubstr("response latency")));
}

TEST(ReportText, PrintsEveryRoleInFullWithinAHundredColumns) {
  auto report = test::sample_report();
  auto& thread = report.threads[0];
  thread.name = std::string(15, 'n');  // as long as the kernel allows
  thread.sched->policy_name = "SCHED_DEADLINE";
  thread.sched->runtime_ns = 2'000'000;
  thread.sched->period_ns = 10'000'000;
  for (const auto role :
       {ThreadRole::callback, ThreadRole::pool, ThreadRole::dispatcher, ThreadRole::worker}) {
    thread.role = role;
    const auto text = report_text_of(report);
    EXPECT_THAT(text, HasSubstr("4005  " + std::string(label(role)) + "  "));
    EXPECT_THAT(text, HasSubstr(thread.name));
    expect_within(text, 100);
  }
}

TEST(ReportText, SaysByHowMuchTheClocksOfHostsMayDiffer) {
  const auto text = report_text_of(test::sample_of_two_hosts());
  EXPECT_THAT(text, HasSubstr("message to another host"));
  EXPECT_THAT(text, HasSubstr("between hosts: add -3.000 ms to +400.0 us for their clocks\n"));
  EXPECT_THAT(
      text,
      HasSubstr(
          "Clocks of the hosts\n"
          R"(  desk to robot: 6 messages, 9 back; the clock of robot is 1.300 ms ahead, give or take 1.700 ms
  desk to shed: 1 message, 0 back; their clocks may differ by anything, because messages go only one
  way
)"));
  auto hostile = test::sample_of_two_hosts();
  hostile.clocks[0].first = "\x1b[2J" + std::string(1'000, 'x');
  expect_within(report_text_of(hostile), 100);
  EXPECT_EQ(report_text_of(hostile).find('\x1b'), std::string::npos);
  EXPECT_EQ(report_text_of(test::sample_report()).find("Clocks"), std::string::npos);
}

TEST(ReportText, SaysThatAClockWasSetWhereNoDifferenceHolds) {
  auto report = test::sample_of_two_hosts();
  report.clocks[0].ahead_ns = report.clocks[0].error_ns = std::nullopt;
  EXPECT_THAT(
      report_text_of(report),
      HasSubstr("desk to robot: 6 messages, 9 back; one of their clocks was set meanwhile"));
}

TEST(ReportText, FitsAHundredColumnsWhateverTheNames) {
  expect_within(report_text_of(test::sample_report()), 100);
  auto hostile = test::sample_report();
  const std::string huge(100'000, 'x');
  for (auto* name :
       {&hostile.callbacks[0].logical_id, &hostile.processes[0].name, &hostile.threads[0].name,
        &hostile.chains[0].name, &hostile.trace.paths[0], &hostile.chains[0].hop_table[0].from,
        &hostile.threads[0].callbacks[0], &hostile.threads[0].sched->policy_name}) {
    *name = huge;
  }
  const auto text = report_text_of(hostile);
  expect_within(text, 100);
  EXPECT_LT(text.size(), 20'000U);
}

TEST(ReportText, SaysWhatAHopTableLeavesOpen) {
  auto report = test::sample_report();
  auto& chain = report.chains[0];
  chain.hop_table[0].communication.reset();
  chain.hop_table[1].processing.reset();
  chain.undivided = test::summary(9'000, 9'000, 6);
  const auto text = report_text_of(report);
  EXPECT_THAT(text, HasSubstr("not divided"));
  EXPECT_THAT(text, HasSubstr("a release is not known on 6 of them"));
  chain.instances = 8;
  EXPECT_THAT(report_text_of(report), HasSubstr("path latency of 6 of 8 instances"));
}

TEST(ReportText, DividesAChainOfRos2ByStarts) {
  auto report = test::sample_report();
  auto& chain = report.chains[0];
  chain.path_latency.reset();
  chain.undivided.reset();
  chain.from_start = test::summary(70'000, 70'000, 6);
  chain.path_latency_upper = test::summary(90'000, 90'000, 5);
  chain.response = test::summary(4'000, 4'000, 3);
  for (auto& hop : chain.hop_table) {
    hop.processing.reset();
    hop.communication.reset();
  }
  chain.hop_table[0].start_to_publish = test::summary(20'000, 20'000, 6);
  chain.hop_table[0].publish_to_start = test::summary(30'000, 30'000, 6);
  chain.hop_table[1].start_to_publish = test::summary(20'000, 20'000, 6);
  std::ostringstream out;
  write_report_chains(out, report, {.columns = 100});
  const auto text = out.str();
  using testing::ContainsRegex;
  EXPECT_THAT(text, ContainsRegex("  path latency, at least +6  70.00 us"));
  EXPECT_THAT(text, ContainsRegex("    at most \\(5 of 6\\) +5  90.00 us"));
  EXPECT_THAT(text, ContainsRegex("    message to the next +6  30.00 us"));
  EXPECT_THAT(text, ContainsRegex("  response to the client +3  4.000 us"));
  EXPECT_THAT(text,
              HasSubstr("the first release is not known: \"at least\" is from the first start"));
  EXPECT_THAT(text, HasSubstr("\"at most\" leaves instances out that nothing bounds from above"));

  chain.path_latency_upper.reset();
  std::ostringstream without;
  write_report_chains(without, report, {.columns = 100});
  EXPECT_THAT(without.str(), testing::Not(HasSubstr("at most"))) << "there is no such row";
}

TEST(ReportText, SaysOnceWhatHoldsForSeveralChains) {
  auto report = test::sample_report();
  report.chains[0].instances = 0;
  report.chains.push_back(report.chains[0]);
  std::ostringstream out;
  write_report_chains(out, report, {.columns = 100});
  const auto text = out.str();
  const std::string note = "no instance of it was seen";
  const auto first = text.find(note);
  ASSERT_NE(first, std::string::npos);
  EXPECT_EQ(text.find(note, first + 1), std::string::npos) << text;
  EXPECT_NE(text.find("Chain ", text.find("Chain ") + 1), std::string::npos) << text;
}

TEST(ReportText, SaysWhereNothingTellsWhatWasTaken) {
  auto report = test::sample_report();
  const auto chains = [&report] {
    std::ostringstream out;
    write_report_chains(out, report, {.columns = 100});
    return out.str();
  };
  EXPECT_THAT(chains(), Not(HasSubstr("which message")));
  report.chains.clear();
  report.processes[0].tells_messages = false;
  EXPECT_EQ(
      chains(),
      "Nothing tells which message a callback took, so no chain leads through what they took: "
      "ros2:rmw_take\nwould tell it.\n\n");
  report.processes[0].tracetools = "2.3.0";
  EXPECT_EQ(
      chains(),
      "Nothing tells which message a callback took, so no chain leads through what tracetools 2.3.0\n"
      "recorded: ROS 2 Humble and later tell it.\n\n");
  report.processes.push_back(report.processes[0]);
  report.processes[1].tells_messages = true;
  EXPECT_THAT(chains(), StartsWith("In 1 of 2 processes nothing tells which message"));
}

TEST(ReportText, ListsEveryChainOfTheSpec) {
  auto report = test::sample_report();
  auto chain = report.chains[0];
  chain.is_specified = true;
  chain.instances = 0;
  chain.path_latency.reset();
  for (auto& hop : chain.hop_table) {
    hop.processing.reset();
    hop.communication.reset();
  }
  report.chains.clear();
  for (int i = 0; i < 30; ++i) {
    chain.name = "wanted" + std::to_string(i);
    report.chains.push_back(chain);
  }
  const auto text = report_text_of(report);
  for (int i = 0; i < 30; ++i)
    EXPECT_THAT(text, HasSubstr("Chain wanted" + std::to_string(i) + ": 2 callbacks, 0 instances"));
  EXPECT_THAT(text, HasSubstr("no instance of it was seen"));
  report.callbacks.clear();
  EXPECT_THAT(report_text_of(report), HasSubstr("Chain wanted29")) << "in a trace of nothing, too";
}

TEST(ReportText, FitsWithManyOfEverything) {
  auto report = test::sample_report();
  const auto callback = report.callbacks.front();
  const auto process = report.processes.front();
  for (int i = 0; i < 400; ++i) {
    report.callbacks.push_back(callback);
    report.callbacks.back().logical_id =
        std::string(static_cast<std::size_t>(i), 'n') + "@Timer(1)";
    report.callbacks.back().process = analysis::ProcessIndex{1 + static_cast<std::uint32_t>(i) / 4};
  }
  for (int i = 0; i < 120; ++i) {
    report.trace.hosts.push_back("robot" + std::string(static_cast<std::size_t>(3 * i), '-'));
    report.trace.paths.push_back("/recordings/" + std::to_string(i));
    report.processes.push_back(process);
    report.processes.back().pid = 5000 + i;
    report.processes.back().index = analysis::ProcessIndex{1 + static_cast<std::uint32_t>(i)};
  }
  const auto verdicts = test::sample_verdicts();
  const auto text = report_text_of(report, &verdicts);
  expect_within(text, 100);
  // Who has many hosts still sees the verdict and the defects on the first screen.
  EXPECT_EQ(text.find("Verdict "), 0U);
  const auto top = text.substr(0, text.find("Callbacks of pid"));
  EXPECT_LT(std::count(top.begin(), top.end(), '\n'), 60);
  EXPECT_THAT(top, HasSubstr("more; --format json has all"));
}

TEST(ReportText, FitsWithNumbersBeyondAllMeasure) {
  auto report = test::sample_report();
  auto& callback = report.callbacks.front();
  constexpr auto kHuge = std::numeric_limits<std::int64_t>::max();
  callback.instances = std::numeric_limits<std::uint64_t>::max();
  callback.incomplete = callback.instances;
  callback.missed_releases = callback.instances;
  for (auto* quantity :
       {&callback.response_time, &callback.start_latency, &callback.execution_time})
    *quantity = test::summary(kHuge, kHuge, 1);
  expect_within(report_text_of(report), 100);
}

TEST(ReportText, OfBoundsAloneNamesTheLongest) {
  auto report = test::sample_report();
  for (auto& callback : report.callbacks)
    callback.response_time.reset();
  EXPECT_THAT(report_text_of(report), HasSubstr("longest response time   >2.500 ms  "));
}

TEST(ReportText, LetsNoNameControlTheTerminal) {
  auto hostile = test::sample_report();
  const std::string evil =
      "\x1b]0;title\x07\x1b[2J\r\n\xC2\x9B"
      "31m";
  hostile.callbacks[0].logical_id = evil;
  hostile.processes[0].name = evil;
  hostile.processes[0].executor = evil;
  hostile.threads[0].name = evil;
  hostile.threads[0].callbacks = {evil};
  hostile.threads[0].sched->policy_name = evil;
  hostile.chains[0].name = evil;
  hostile.chains[0].hop_table[0].from = evil;
  hostile.trace.paths = {evil};
  hostile.trace.hosts = {evil};
  hostile.defects[0].advice = evil;
  const auto text = report_text_of(hostile);
  EXPECT_THAT(text, Not(HasSubstr("\x1b")));
  EXPECT_THAT(text, Not(HasSubstr("\r")));
  EXPECT_THAT(text, Not(HasSubstr("\x07")));
  EXPECT_THAT(text, Not(HasSubstr("\xC2\x9B")));
  EXPECT_THAT(text, HasSubstr("\\x1b]0;title\\x07"));
}

TEST(ReportText, HasColoursOnlyWhenTheStyleHas) {
  const auto verdicts = test::sample_verdicts();
  EXPECT_THAT(report_text_of(test::sample_report(), &verdicts, {.colour = true}),
              HasSubstr("\x1b[1;31m"));
  EXPECT_THAT(report_text_of(test::sample_report(), &verdicts, {.colour = false}),
              Not(HasSubstr("\x1b")));
}

TEST(ReportText, TellsWhyThereIsNothing) {
  EXPECT_THAT(report_text_of({}), HasSubstr("No callback was seen"));
}

}  // namespace
}  // namespace cie::viewer_export
