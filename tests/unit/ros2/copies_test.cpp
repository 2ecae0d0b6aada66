// What two sessions recorded of one application at the same time has happened once.
#include "ros2_text.hpp"

#include <algorithm>
#include <cstdint>
#include <sstream>
#include <string>

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

TEST(Ros2Copies, AreNotWhatOnlyTheSecondSessionHas) {
  const auto result = analyze_ros2(std::string(kApplication) +
                                   "40000 callback_start callback=0x51 session=2\n"
                                   "41000 callback_end callback=0x51 session=2\n");
  EXPECT_EQ(result.instances.size(), 4U);
}

}  // namespace
}  // namespace cie::test
