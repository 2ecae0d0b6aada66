#include <cie/viewer_export/report_writers.hpp>

#include "report_screens.hpp"
#include "sample_report.hpp"

#include <cstdint>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

using analysis::Verdict;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

TEST(ReportScreen, SaysWhoseMessagesWereNotSent) {
  auto report = shared_report();
  report.processes.front().unsent = {{.node = "/a", .topic = "/scan", .messages = 3}};
  EXPECT_THAT(screen_of(report, test::sample_verdicts(), {.columns = 100}),
              HasSubstr("\n  3 messages were not sent in time and reached nobody: 3 on /scan\n"));
}

TEST(ReportScreen, OfATerminalOf80Columns) {
  EXPECT_EQ(screen_of(shared_report(), test::sample_verdicts(), {.columns = 80, .unicode = true}),
            "✗ FAIL  run 1: 1 of 2 callbacks share threads\n"
            "  130.0 ms on robot: 1 process, isolated executor; 3 callbacks, 14 instances,\n"
            "  nothing lost, 1 cut or never ended\n"
            "\n"
            "                                                        response time\n"
            "  callback                               count       p50       p99       max\n"
            "  lidar ← /sensing/lidar/top/points_raw    7+1  >1.750ms  >2.500ms  >2.500ms\n"
            "  plan timer 20 ms                           7   187.3us   289.4us   289.4us\n"
            "  chain braking                              6   892.3us   1.008ms   1.008ms\n"
            "  response time: \">\" at least, where a release is not known\n"
            "  worst: lidar ← /sensing/lidar/top/points_raw, instance 3 at +1.500 ms took\n"
            "         2.500 ms: 200.0 us preempted by cc1plus\n"
            "  releases missed: 3 of plan timer 20 ms\n"
            "  never ran: 1 callback: plan ⇐ /never called\n"
            "  all: cie report 'recordings/run 1' --window=+1s.. --all\n"
            "  rules: cie verify 'recordings/run 1' --window=+1s..\n"
            "  look: cie view 'recordings/run 1'\n"
            "  in place of --all: --threads, --chains\n");
}

TEST(ReportScreen, SaysHowManyProcessesToldTheirExecutor) {
  auto report = shared_report();
  report.processes.push_back(report.processes.front());
  report.processes.back().executor.reset();
  EXPECT_THAT(screen_of(report, test::sample_verdicts(), {.columns = 120}),
              HasSubstr("2 processes, 1 with the isolated executor; "));
}

TEST(ReportScreen, OfATerminalOf120ColumnsHasMoreColumns) {
  EXPECT_THAT(
      screen_of(shared_report(), test::sample_verdicts(), {.columns = 120, .unicode = true}),
      AllOf(
          HasSubstr(
              "\n\n"
              "                                                        response time                    own     start     exec.\n"
              "  callback                               count       p50       p99       max  missed  thread  lat. max  time max\n"
              "  lidar ← /sensing/lidar/top/points_raw    7+1  >1.750ms  >2.500ms  >2.500ms       -      NO         -         -\n"
              "  plan timer 20 ms                           7   187.3us   289.4us   289.4us       3     yes   14.88us   281.8us\n"
              "  chain braking                              6   892.3us   1.008ms   1.008ms       -       -         -         -\n"
              "  response time: \">\" at least, where a release is not known\n"
              "  worst: lidar ← /sensing/lidar/top/points_raw, instance 3 at +1.500 ms took 2.500 ms: "
              "200.0 us preempted by cc1plus\n"),
          HasSubstr("  all: cie report 'recordings/run 1' --window=+1s.. --all\n"
                    "  threads: cie report 'recordings/run 1' --window=+1s.. --threads\n"
                    "  chains: cie report 'recordings/run 1' --window=+1s.. --chains    "
                    "rules: cie verify 'recordings/run 1' --window=+1s..\n"
                    "  look: cie view 'recordings/run 1'\n")));
}

TEST(ReportScreen, OfAPipeIsAscii) {
  const auto text = screen_of(shared_report(), test::sample_verdicts());
  EXPECT_THAT(
      text,
      HasSubstr(
          "\n\n"
          "                                                         response time                    own\n"
          "  callback                                count       p50       p99       max  missed  thread\n"
          "  lidar <- /sensing/lidar/top/points_raw    7+1  >1.750ms  >2.500ms  >2.500ms       -      NO\n"
          "  plan timer 20 ms                            7   187.3us   289.4us   289.4us       3     yes\n"
          "  chain braking                               6   892.3us   1.008ms   1.008ms       -       -\n"));
  for (const char c : text)
    EXPECT_TRUE(c == '\n' || (c >= ' ' && c <= '~')) << text;
}

TEST(ReportScreen, IsNoFailWhereNobodyClaimedThatThreadsAreNotShared) {
  EXPECT_THAT(screen_of(unclaimed_report(), test::sample_verdicts()),
              StartsWith("run 1: callbacks share threads: 1 of 2\n"
                         "  130.0 ms on robot: 1 process, multi_threaded executor; "));
  const auto fail = StartsWith("FAIL  run 1: 1 of 2 callbacks share threads\n");
  auto expecting = usual_context();
  expecting.is_isolation_expected = true;
  EXPECT_THAT(screen_of(unclaimed_report(), test::sample_verdicts(), {}, expecting), fail);
  const auto spec = SchedulingSpec::parse("callback_groups: []\n", "app.yaml");
  auto specified = usual_context();
  specified.verify.spec = &spec;
  EXPECT_THAT(screen_of(unclaimed_report(), test::sample_verdicts(), {}, specified), fail);
}

analysis::VerdictReport with_missed_deadline(analysis::Report& report) {
  report.callbacks[0].response_deadline = analysis::Duration{100'000};
  report.callbacks[0].late = 5;
  auto verdicts = test::sample_verdicts();
  verdicts.rules.push_back(
      {.id = "R3",
       .name = "deadline",
       .verdict = Verdict::fail,
       .subjects = {{.about = {.kind = analysis::SubjectKind::callback, .index = 0},
                     .subject = "callback /a/plan@Timer(20000000)",
                     .verdict = Verdict::fail,
                     .checked = 7,
                     .evidence = {}}}});
  return verdicts;
}

TEST(ReportScreen, OfAMissedDeadlineIsAFailWhoeverDeclaredIt) {
  auto report = unclaimed_report();
  const auto verdicts = with_missed_deadline(report);
  const auto text = screen_of(report, verdicts);
  EXPECT_THAT(text,
              StartsWith("FAIL  run 1: 1 of 1 callback missed deadlines: late 5 of 7 instances\n"
                         "  callbacks share threads: 1 of 2\n"));
  EXPECT_LT(text.find("plan timer 20 ms"), text.find("lidar <-")) << "the late one is the worst";
  EXPECT_THAT(text, HasSubstr("187.3us   289.4us   289.4us   100.0us     5"));
}

TEST(ReportScreen, TellsOfLostAndOverwrittenSamples) {
  auto report = shared_report();
  report.callbacks[1].lost_samples = 0;
  report.callbacks[1].overwritten_samples = 0;
  EXPECT_THAT(screen_of(report, {}), Not(HasSubstr("samples")));
  report.callbacks[1].lost_samples = 2;
  report.callbacks[1].overwritten_samples = 5;
  EXPECT_THAT(screen_of(report, {}),
              HasSubstr("  samples lost: 2 of lidar <- /sensing/lidar/top/points_raw\n"
                        "  samples overwritten: 5 of lidar <- /sensing/lidar/top/points_raw\n"));
}

TEST(ReportScreen, NamesFirstWhatMissedOrLostTheMost) {
  auto report = shared_report();
  report.callbacks[0].overwritten_samples = 24;
  report.callbacks[1].overwritten_samples = 5;
  const auto text = screen_of(report, {});
  EXPECT_LT(text.find("lidar <-"), text.find("plan timer")) << "of the other order";
  EXPECT_THAT(text, HasSubstr("  samples overwritten: 24 of plan timer 20 ms, 5 of lidar <- "));
}

// As a comparison counts them: the other callback's seven runs kept their deadline.
TEST(ReportScreen, CountsTheRunsOfAllThatHaveADeadline) {
  auto report = unclaimed_report();
  const auto verdicts = with_missed_deadline(report);
  report.callbacks[1].response_deadline = analysis::Duration{100'000'000};
  report.callbacks[1].late = 0;
  EXPECT_THAT(
      screen_of(report, verdicts),
      StartsWith("FAIL  run 1: 1 of 1 callback missed deadlines: late 5 of 14 instances\n"));
}

// Late 5 times by 2.9 times its deadline at most, and once by 25 times.
TEST(ReportScreen, HasTheWorstAgainstItsDeadlineFirst) {
  auto report = unclaimed_report();
  const auto verdicts = with_missed_deadline(report);
  report.callbacks[1].response_deadline = analysis::Duration{100'000};
  report.callbacks[1].late = 1;
  const auto text = screen_of(report, verdicts);
  EXPECT_LT(text.find("lidar <-"), text.find("plan timer 20 ms"));
  EXPECT_THAT(text, HasSubstr("  worst: lidar <- "));
}

TEST(ReportScreen, SaysWhetherIsolationHoldsBesideWhatIsGraver) {
  auto report = test::sample_report();
  report.callbacks.erase(report.callbacks.begin() + 1);
  auto verdicts = with_missed_deadline(report);
  std::erase_if(verdicts.rules, [](const auto& rule) { return rule.id == "M2"; });
  EXPECT_THAT(screen_of(report, verdicts),
              StartsWith("FAIL  run 1: 1 of 1 callback missed deadlines: late 5 of 7 instances\n"
                         "  1 of 1 callback that ran had a thread of its own\n"));
}

TEST(ReportScreen, SaysNoMoreOfIsolationThanItsRulesDecide) {
  auto report = test::sample_report();
  report.callbacks.erase(report.callbacks.begin() + 1);
  const analysis::VerdictReport verdicts{
      .verdict = Verdict::inconclusive,
      .rules = {{.id = "M2", .name = "m", .verdict = Verdict::inconclusive, .subjects = {}},
                {.id = "M3", .name = "m", .verdict = Verdict::pass, .subjects = {}}}};
  EXPECT_THAT(
      screen_of(report, verdicts),
      StartsWith(
          "INCONCLUSIVE  run 1: whether callbacks share threads is not known; 1 rule undecided\n"
          "  as far as recorded, 1 of 1 callback that ran had a thread of its own\n"));
}

TEST(ReportScreen, SaysNotThatNothingIsLostWhereSomethingIsMissing) {
  using analysis::DefectKind;
  using analysis::Severity;
  auto report = unclaimed_report();  // of which the tracer counted no loss
  const auto counts = [&report] { return screen_of(report, {}, {.columns = 200}); };
  EXPECT_THAT(counts(), HasSubstr("14 instances, nothing lost, 1 cut"));
  report.defects.push_back(
      {.kind = DefectKind::damaged_packets, .severity = Severity::error, .count = 1, .advice = {}});
  EXPECT_THAT(counts(), HasSubstr("14 instances, 1 packet damaged, 1 cut"));
  report.defects.push_back(
      {.kind = DefectKind::seq_gaps, .severity = Severity::loss, .count = 5, .advice = {}});
  EXPECT_THAT(counts(), HasSubstr("14 instances, 5 missing, 1 packet damaged, 1 cut"));
  report.trace.lost_events = 7;
  EXPECT_THAT(counts(),
              HasSubstr("14 instances, 5 missing, 1 packet damaged, 7 events lost, 1 cut"));
  // Totals prove more: what is missing is not only between others.
  report.callbacks[0].runs_not_seen = 9;
  EXPECT_THAT(counts(), HasSubstr("14 instances, at least 5 missing, 1 packet damaged"));
  report.callbacks[0].outside_window = 4;  // which are told of by themselves
  EXPECT_THAT(counts(), HasSubstr("14 instances, 5 missing, 1 packet damaged"));
  report.defects = {{.kind = DefectKind::sched_switch_gaps,
                     .severity = Severity::loss,
                     .count = 15,
                     .advice = {}}};
  EXPECT_THAT(counts(),
              HasSubstr("14 instances, 15 gaps in context switches, 7 events lost, 1 cut"));
  report.trace.lost_events = 0;
  report.defects = {
      {.kind = DefectKind::host_gap, .severity = Severity::loss, .count = 1, .advice = {}}};
  EXPECT_THAT(counts(), HasSubstr("14 instances, 1 gap not recorded, 1 cut"));
}

TEST(ReportScreen, OfAChainOfTheSpecSaysWhetherItWasLate) {
  auto report = unclaimed_report();  // a path latency of 776.3 us to 1.008 ms
  report.chains[0].is_specified = true;
  const auto of = [&report](std::int64_t bound) {
    const auto spec = SchedulingSpec::parse(
        "chains:\n  - name: braking\n    callbacks: ['/a/plan@Timer(20000000)', "
        "'/perception/lidar@Subscription(/sensing/lidar/top/points_raw)']\n    path_latency: " +
            std::to_string(bound) + "\n",
        "app.yaml");
    auto specified = usual_context();
    specified.verify.spec = &spec;
    return screen_of(report, {}, {}, specified);
  };
  EXPECT_THAT(of(1'008'309), HasSubstr("1.008ms   1.008ms   1.008ms     0"));
  EXPECT_THAT(of(1'008'308), HasSubstr("1.008ms   1.008ms   1.008ms    >0"));
  EXPECT_THAT(of(700'000), HasSubstr("1.008ms   1.008ms   700.0us     6"));
}

// The second host booted 8 s after the first one, whose clock the recording's begin is of.
TEST(ReportScreen, OfSeveralHostsTellsTimesByOneClock) {
  auto report = shared_report();
  report.trace.hosts = {"desk", "robot"};
  report.hosts[0].shift = {8'000'000'000};
  auto later = usual_context();
  later.verify.worst_runs[0].start = {983'001'500'000 - 8'000'000'000};
  EXPECT_THAT(screen_of(report, {}, {.columns = 200}, later),
              HasSubstr("instance 3 at +1.500 ms took 2.500 ms: "));
  later.verify.worst_runs[0].start.ns -= 2'000'000;
  EXPECT_THAT(screen_of(report, {}, {.columns = 200}, later),
              HasSubstr("instance 3 at -500.0 us took 2.500 ms: "))
      << "before the other one's record began";
}

TEST(ReportScreen, OfSeveralHostsHasTheLengthOfEach) {
  auto report = unclaimed_report();  // of 130 ms
  auto& callback = report.callbacks[1];
  callback.release_source = analysis::ReleaseSource::start;
  callback.duration->sum = 450'000'000;
  report.callbacks = {callback};
  report.chains.clear();
  report.trace.hosts = {"desk", "robot"};
  EXPECT_THAT(screen_of(report, {}), HasSubstr("  130.0 ms on desk, robot: "));
  report.processes.push_back(report.processes[0]);
  report.processes[1].index = analysis::ProcessIndex{1};
  report.processes[1].host = "desk";
  report.processes[1].host_index = analysis::HostIndex{1};
  report.hosts.push_back({.name = "desk", .recorded = report.hosts[0].recorded});
  report.hosts[0].recorded = analysis::Duration{1'000'000'000};
  const auto text = screen_of(report, {});
  EXPECT_THAT(text, HasSubstr("  130.0 ms on desk, 1.000 s on robot: 2 processes"));
  EXPECT_THAT(text, HasSubstr("45.0%")) << "of the host that it ran on";
}

TEST(ReportScreen, TellsWhatNeverRanFromWhatRanUnseen) {
  auto report = shared_report();
  report.callbacks.push_back(report.callbacks[2]);
  report.callbacks[3].index = analysis::CallbackIndex{3};
  report.callbacks[3].logical_id = "/a/plan@Service(/asked)";
  report.callbacks[3].runs_not_seen = 50;
  EXPECT_THAT(screen_of(report, {}, {.columns = 200}),
              HasSubstr("  no instance seen: 1 callback: plan <= /asked\n"
                        "  never ran: 1 callback: plan <= /never called\n"));
}

TEST(ReportScreen, OfAWindowWithinARunSaysThatNoWholeOneWasSeen) {
  auto report = shared_report();
  report.callbacks = {report.callbacks[2]};
  EXPECT_THAT(screen_of(report, {}), HasSubstr("  no callback ran\n"));
  report.callbacks[0].runs_not_seen = 1;
  EXPECT_THAT(screen_of(report, {}), HasSubstr("  no instance of a callback was seen\n"));
  report.callbacks[0].cut = 1;
  EXPECT_THAT(screen_of(report, {}), AllOf(HasSubstr("no whole instance of a callback was seen\n"),
                                           HasSubstr("   0+1"), Not(HasSubstr("never ran"))));
}

TEST(ReportScreen, HasIdsWhereTheyAreAskedFor) {
  EXPECT_THAT(screen_of(shared_report(), {}, {.columns = 120, .ids = true}),
              AllOf(HasSubstr("\n  /a/plan@Timer(20000000)  "), HasSubstr(" --ids --all")));
}

// cie view has no window.
TEST(ReportScreen, OfAWindowSaysThatToLookIsAtAllOfTheRecording) {
  auto verdicts = test::sample_verdicts();
  EXPECT_THAT(screen_of(test::sample_report(), verdicts), HasSubstr("look: cie view"));
  verdicts.window = analysis::TimeWindow{.from = {983'000'000'000}, .to = {983'130'000'000}};
  EXPECT_THAT(screen_of(test::sample_report(), verdicts),
              HasSubstr("look (whole recording): cie view 'recordings/run 1'"));
}

TEST(ReportScreen, TellsWhyThereIsNothing) {
  EXPECT_THAT(screen_of({}, {}), HasSubstr("No callback was seen"));
  EXPECT_THAT(screen_of({}, {}), HasSubstr("\n  what it holds: cie events "));
  std::istringstream narrow(screen_of({}, {}, {.columns = 80}));
  for (std::string line; std::getline(narrow, line);)
    EXPECT_LE(line.size(), 80U) << line;
}

// A process that announced itself was recorded; nodes of rclcpp may have what rclcpp has for itself alone.
TEST(ReportScreen, NamesWhatProcessesWithoutCallbacksAre) {
  analysis::Report report;
  auto& process = report.processes.emplace_back();
  process.executor = "isolated";
  EXPECT_THAT(screen_of(report, {}, {.columns = 400}),
              AllOf(HasSubstr("No callback was seen: 1 process began and announced none."),
                    Not(HasSubstr("enabled"))));
  process.executor.reset();
  process.published = {{"/chatter", 3}};
  EXPECT_THAT(screen_of(report, {}, {.columns = 400}),
              AllOf(HasSubstr("show 1 process and 3 publications on /chatter, but no callback"),
                    HasSubstr("Callbacks of rclpy have no events"), Not(HasSubstr("enabled"))));
}

TEST(ReportScreen, TellsWhatIsRecordedOutsideOfWhatAllStreamsCover) {
  auto report = unclaimed_report();
  report.trace.begin = analysis::Timestamp{0};
  report.trace.end = analysis::Timestamp{45'000'000};
  report.trace.outside = {.instances = 7, .length = analysis::Duration{80'000'000}};
  EXPECT_THAT(screen_of(report, {}, {.columns = 200}),
              HasSubstr("14 instances, nothing lost, 7 more outside of what all streams cover "
                        "(45.00 ms of 125.0 ms), 1 cut"));
}

TEST(ReportScreen, NamesRecordingsThatFollowEachOtherAndAreReadAsOne) {
  auto report = unclaimed_report();
  const auto add = [&report](const char* path, const char* host, std::int64_t from,
                             std::int64_t to) {
    auto& recording = report.recordings.emplace_back();
    recording.path = path;
    recording.host = host;
    recording.begin.realtime_ns = from;
    recording.end.realtime_ns = to;
  };
  add("runs/one", "robot", 0, 10);
  add("runs/beside", "robot", 5, 30);
  add("runs/elsewhere", "cloud", 50, 60);
  EXPECT_THAT(screen_of(report, {}), Not(HasSubstr("are read as one")));
  add("runs/two", "robot", 20, 30);
  EXPECT_THAT(screen_of(report, {}),
              HasSubstr("  2 recordings, one after the other, are read as one: one, two\n"));
}

TEST(ReportScreen, LetsNoNameControlTheTerminal) {
  auto hostile = shared_report();
  const std::string evil = "\x1b]0;title\x07\x1b[2J\r\n\xC2\x9B";
  hostile.callbacks[0].logical_id = evil;
  hostile.callbacks[1].source = evil;
  hostile.processes[0].executor = evil;
  hostile.chains[0].name = evil;
  hostile.trace.paths = {evil};
  hostile.trace.hosts = {evil};
  hostile.defects[0].severity = analysis::Severity::error;
  hostile.defects[0].advice = evil;
  auto judged = usual_context();
  judged.verify.worst_runs[0].preempted_by = evil;
  const auto text = screen_of(hostile, test::sample_verdicts(), {}, judged);
  for (const char* control : {"\x1b", "\x07", "\r", "\xC2\x9B"})
    EXPECT_THAT(text, Not(HasSubstr(control)));
  EXPECT_THAT(text, HasSubstr("\\x1b]0;title\\x07"));
}

}  // namespace
}  // namespace cie::viewer_export
