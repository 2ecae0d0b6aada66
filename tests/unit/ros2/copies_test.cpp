// What two sessions recorded of one application at the same time has happened once.
#include "ros2_text.hpp"

#include <algorithm>
#include <cstdint>
#include <sstream>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;

// Two subscriptions of two nodes and a publisher, with messages from one to the other: what runs
// there takes 1 us and 2 us.
constexpr const char* kApplication = R"(
  0 rcl_init context_handle=0x1
  0 rcl_node_init node_handle=0x10 node_name=n namespace=/
  2 rcl_publisher_init publisher_handle=0x31 node_handle=0x10 rmw_publisher_handle=0x91 topic_name=/out queue_depth=1
  2 rcl_subscription_init subscription_handle=0x21 node_handle=0x10 rmw_subscription_handle=0xa1 topic_name=/t queue_depth=1
  2 rclcpp_subscription_init subscription_handle=0x21 subscription=0x41
  2 rclcpp_subscription_callback_added subscription=0x41 callback=0x51
  3 rcl_subscription_init subscription_handle=0x22 node_handle=0x10 rmw_subscription_handle=0xa2 topic_name=/out queue_depth=1
  3 rclcpp_subscription_init subscription_handle=0x22 subscription=0x42
  3 rclcpp_subscription_callback_added subscription=0x42 callback=0x52
  10000 callback_start callback=0x51
  10400 rclcpp_publish message=0x77
  10420 rcl_publish publisher_handle=0x31 message=0x77
  11000 callback_end callback=0x51
  20000 callback_start callback=0x52 tid=2
  22000 callback_end callback=0x52 tid=2
  30000 callback_start callback=0x51
  31000 callback_end callback=0x51
)";

// A process of this project's own events alone: a timer that skipped one period, and is released twice.
constexpr const char* kOwn = R"(
  0 cie:run_begin contract_version=1 executor=isolated pid=1 host=h boot_id=b moment=start monotonic_ns=0
  10 cie:node_init node_id=0 name=/n
  20 cie:group_init group_id=0 node_id=0 type=mutually_exclusive
  30 cie:callback_init callback_id=0 node_id=0 group_id=0 kind=timer logical_id=/n@Timer(1000) period_ns=1000 next_seq=0
  40 cie:thread_init tid=2 role=callback callback_id=0 group_id=0 name=n start_ns=40
  50 cie:thread_sched tid=2 moment=initial n=0 policy=0 cpus=0 error=0
  60 cie:thread_sched tid=2 moment=applied n=1 policy=0 cpus=0 error=0
  1000 cie:thread_wakeup tid=2 callback_id=0 reason=timer
  1100 cie:callback_start tid=2 callback_id=0 seq=0 release_kind=timer release_ns=1000 missed=0
  1200 cie:callback_end tid=2 callback_id=0 seq=0 status=ok
  3000 cie:thread_wakeup tid=2 callback_id=0 reason=timer
  3100 cie:callback_start tid=2 callback_id=0 seq=1 release_kind=timer release_ns=3000 missed=1
  3200 cie:callback_end tid=2 callback_id=0 seq=1 status=ok
  4000 cie:thread_sched tid=2 moment=audit n=2 policy=0 cpus=0 error=0
  4100 cie:thread_fini tid=2 read_backs=3
  4200 cie:callback_fini callback_id=0 started=2 ended=2 released=0 overwritten=0 lost=0
  4300 cie:run_end callbacks=1 threads=1 groups=1 publishers=0 status=0
)";

// Each event a second time, 4 ns after it.
std::string recorded_twice(const std::string& text, bool (*is_copied)(std::int64_t)) {
  std::istringstream lines(text);
  std::string twice;
  std::int64_t at = 0;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::int64_t time = 0;
    if (!(words >> time)) continue;
    std::string rest;
    std::getline(words, rest);
    at = std::max(time, at + 10);
    twice += std::to_string(at) + rest + '\n';
    if (is_copied(time)) twice += std::to_string(at + 4) + rest + " session=2\n";
  }
  return twice;
}

Ros2Result once() {
  return analyze_ros2(recorded_twice(kApplication, [](std::int64_t) { return false; }));
}

void expect_as_once(const Ros2Result& twice) {
  const auto whole = once();
  ASSERT_EQ(whole.instances.size(), 3U);
  EXPECT_EQ(twice.analysis.report.callbacks.size(), 2U);
  ASSERT_EQ(twice.instances.size(), whole.instances.size());
  for (std::size_t i = 0; i < whole.instances.size(); ++i) {
    EXPECT_EQ(twice.instances[i].start, whole.instances[i].start);
    EXPECT_EQ(twice.instances[i].end, whole.instances[i].end);
  }
  EXPECT_EQ(twice.publications, 1U);
  EXPECT_EQ(whole.publications, 1U);
  for (const auto* rule : {"E2", "E3", "M2", "M3", "M4"})
    EXPECT_EQ(twice.verdict(rule), whole.verdict(rule)) << twice.evidence(rule);
}

TEST(Ros2Copies, OfASecondSessionCountOnce) {
  expect_as_once(analyze_ros2(recorded_twice(kApplication, [](std::int64_t) { return true; })));
}

// Where one session hands over to the other, a run may begin in the first and end in both.
TEST(Ros2Copies, OfWhatRanWhenTheSecondSessionBeganCountOnce) {
  expect_as_once(
      analyze_ros2(recorded_twice(kApplication, [](std::int64_t time) { return time > 10'300; })));
}

// All that numbers and totals prove holds as if one session had recorded it.
TEST(Ros2Copies, OfOwnEventsCountOnce) {
  constexpr std::string_view kAllowsOne =
      "callback_groups:\n  - id: /n@Timer(1000)\n    missed_releases_allowed: 1\n";
  const auto judged = [&](bool (*is_copied)(std::int64_t)) {
    return analyze_ros2(recorded_twice(kOwn, is_copied), -1, kAllowsOne);
  };
  const auto once = judged([](std::int64_t) { return false; });
  ASSERT_EQ(once.instances.size(), 2U);
  ASSERT_EQ(once.verdict("R2"), Verdict::pass) << once.evidence("R2");
  ASSERT_EQ(once.verdict("T4"), Verdict::pass) << once.evidence("T4");
  const auto expect_as_once = [&once](const Ros2Result& twice) {
    EXPECT_EQ(twice.durations(), once.durations());
    for (const auto& rule : once.analysis.verdicts.rules)
      EXPECT_EQ(twice.verdict(rule.id), rule.verdict) << rule.id << ' ' << twice.evidence(rule.id);
  };
  expect_as_once(judged([](std::int64_t) { return true; }));
  // The second session began or ended in the middle of an instance.
  expect_as_once(judged([](std::int64_t time) { return time > 3100; }));
  expect_as_once(judged([](std::int64_t time) { return time < 1200; }));
}

TEST(Ros2Copies, AreNotWhatOnlyTheSecondSessionHas) {
  const auto result = analyze_ros2(std::string(kApplication) +
                                   "40000 callback_start callback=0x51 session=2\n"
                                   "41000 callback_end callback=0x51 session=2\n");
  EXPECT_EQ(result.instances.size(), 4U);
}

}  // namespace
}  // namespace cie::test
