// What the first screen says of how long instances took.
#include <cie/viewer_export/report_writers.hpp>

#include "report_screens.hpp"
#include "sample_report.hpp"

#include <cstdint>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// As of ROS 2: no release is known.
TEST(ReportScreen, OfDurationsAloneSaysHowOftenAndHowMuchOfTheTime) {
  auto report = unclaimed_report();
  auto& callback = report.callbacks[1];
  callback.release_source = analysis::ReleaseSource::start;
  callback.inter_arrival = test::summary(20'000'000, 20'000'000, 6);
  report.callbacks = {callback};
  report.chains.clear();
  // 7 instances of 1.65 ms in 130 ms: 8.9 %.
  EXPECT_THAT(screen_of(report, test::sample_verdicts()),
              HasSubstr("                                   duration\n"));
  EXPECT_THAT(screen_of(report, test::sample_verdicts()),
              HasSubstr("   7+1  20.00ms  1.650ms  2.400ms  2.400ms  8.9%\n"));
}

// Seven runs of at most 289.4 us whose release is known, and one that took 50 ms or longer.
analysis::Report with_one_release_unknown() {
  auto report = unclaimed_report();
  auto& timer = report.callbacks[0];
  timer.response_time_lower = test::summary(50'000'000, 50'000'000, 1);
  timer.response_time_at_least = timer.response_time;
  timer.response_time_at_least->count = 8;
  timer.response_time_at_least->p99 = timer.response_time_at_least->max = 50'000'000;
  timer.release_source = analysis::ReleaseSource::mixed;
  timer.instances = 8;
  return report;
}

TEST(ReportScreen, ARunWhoseReleaseIsNotKnownMayBeTheLongest) {
  auto report = with_one_release_unknown();
  const auto text = screen_of(report, {});
  EXPECT_THAT(text, HasSubstr("    8  >187.3us  >50.00ms  >50.00ms       3     yes\n"));
  EXPECT_LT(text.find("plan timer 20 ms  "), text.find("lidar <-")) << "50 ms against 2.5 ms";
  report.callbacks[0].is_median_known = true;
  EXPECT_THAT(screen_of(report, {}),
              HasSubstr("    8   187.3us  >50.00ms  >50.00ms       3     yes\n"));
  report.callbacks[0].response_time_upper = test::summary(60'000'000, 60'000'000, 1);
  EXPECT_THAT(screen_of(report, {}),
              AllOf(HasSubstr("   response time         response\n"),
                    HasSubstr("      p50       p99       max   at most  missed"),
                    HasSubstr(">50.00ms  >50.00ms  <60.00ms       3"),
                    HasSubstr("  response time: \">\" at least, \"<\" at most, where a release is "
                              "not known\n")));
}

// As of ROS 2: the response time has an upper bound alone.
TEST(ReportScreen, BesideDurationsSaysWhatTheUpperBoundIsOf) {
  auto report = unclaimed_report();
  auto& callback = report.callbacks[1];
  callback.release_source = analysis::ReleaseSource::source_timestamp;
  callback.response_time_upper = test::summary(2'000'000, 60'000'000, 7);
  report.callbacks = {callback};
  report.chains.clear();
  const auto text = screen_of(report, test::sample_verdicts());
  EXPECT_THAT(text,
              AllOf(HasSubstr("   duration                response\n"),
                    HasSubstr("      p99      max  busy   at most\n"),
                    HasSubstr("2.400ms  8.9%  <60.00ms\n"),
                    HasSubstr("  response time: \"<\" at most, where a release is not known\n")));
}

TEST(ReportScreen, ARunWhoseReleaseIsNotKnownMayHaveTakenAnyTime) {
  auto report = with_one_release_unknown();
  report.callbacks[0].response_time_lower = test::summary(50'000, 50'000, 1);
  report.callbacks[0].response_time_at_least->p99 = 289'400;
  EXPECT_THAT(screen_of(report, {}), HasSubstr("    8  >187.3us  >289.4us  >289.4us       3"));
  report.callbacks[0].response_time_upper = test::summary(60'000'000, 60'000'000, 1);
  report.callbacks[0].response_time_lower->count = 2;
  EXPECT_THAT(screen_of(report, {}), HasSubstr(">289.4us  >289.4us       3")) << "of one of two";
}

TEST(ReportScreen, AShorterRunWhoseReleaseIsNotKnownIsNotTheLongest) {
  auto report = with_one_release_unknown();
  report.callbacks.resize(1);
  report.callbacks[0].response_time_lower = test::summary(50'000, 50'000, 1);
  report.callbacks[0].response_time_upper = test::summary(60'000, 60'000, 1);
  report.callbacks[0].response_time_at_least->p99 = 289'400;
  EXPECT_THAT(screen_of(report, {}),
              AllOf(HasSubstr("   8  >187.3us  >289.4us  289.4us       3"),
                    HasSubstr("\">\" at least, where"), Not(HasSubstr("at most"))));
}

TEST(ReportScreen, StartUpWorkAndWhatRanOnceDoNotLead) {
  auto report = unclaimed_report();
  report.callbacks[1].instances = 1;
  EXPECT_LT(screen_of(report, {}).find("plan timer"), screen_of(report, {}).find("lidar <-"));
  report.callbacks[1].instances = 7;
  EXPECT_GT(screen_of(report, {}).find("plan timer"), screen_of(report, {}).find("lidar <-"));
  report.callbacks[1].kind = CallbackKind::service;
  report.callbacks[1].source = "/container/_container/load_node";
  EXPECT_LT(screen_of(report, {}).find("plan timer"), screen_of(report, {}).find("lidar <-"));
}

TEST(ReportScreen, SaysHowLongWhatRanOnceTookWhereThereIsNoRoomForIt) {
  auto report = unclaimed_report();
  auto once = report.callbacks[0];
  for (int i = 0; i < 40; ++i)
    report.callbacks.push_back(report.callbacks[0]);
  once.instances = 1;
  once.response_time = test::summary(9'000'000'000, 9'000'000'000, 1);
  report.callbacks.push_back(once);
  for (std::uint32_t i = 0; i < report.callbacks.size(); ++i)
    report.callbacks[i].index = analysis::CallbackIndex{i};
  EXPECT_THAT(screen_of(report, {}),
              HasSubstr(" more callbacks; 1 of them took longer, up to 9.000s: once, or to start "
                        "others\n"));
}

TEST(ReportScreen, SaysHowLongARunThatDidNotEndHasBeenOpen) {
  auto report = shared_report();
  auto& callback = report.callbacks[0];  // of at most 289.4 us
  const auto text = [&report] { return screen_of(report, {}, {.columns = 200}); };
  callback.incomplete = 1;
  callback.longest_open = analysis::OpenRun{.seq = 7, .until_end = {200'000}};
  EXPECT_THAT(text(), Not(HasSubstr("did not end")));
  callback.response_deadline = analysis::Duration{100'000};
  EXPECT_THAT(text(),
              HasSubstr("  did not end: plan timer 20 ms, instance 7 began 200.0 us before the "
                        "end (deadline 100.0 us)\n"));
  callback.response_deadline.reset();
  callback.longest_open->until_end = {470'000'000};
  EXPECT_THAT(text(),
              HasSubstr("  did not end: plan timer 20 ms, instance 7 began 470.0 ms before the "
                        "end\n"));
}

}  // namespace
}  // namespace cie::viewer_export
