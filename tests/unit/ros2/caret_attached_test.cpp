// CARET attached to processes that run: it tells what they made before, kind by kind and in any order, and
// when each was made (init_timestamp).
#include "ros2_text.hpp"

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using testing::UnorderedElementsAre;

std::string stored(int time, const std::string& event) {
  return "ros2_caret:" + event + " init_timestamp=" + std::to_string(time);
}

// Of node 0x10 if none is named. As CARET calls them, the first one at `time`.
std::vector<std::string> timer_made(int time, const std::string& handle,
                                    const std::string& callback, int period) {
  return {
      stored(time, "rcl_timer_init timer_handle=" + handle + " period=" + std::to_string(period)),
      stored(time + 1,
             "rclcpp_timer_callback_added timer_handle=" + handle + " callback=" + callback),
      stored(time + 2, "rclcpp_callback_register callback=" + callback + " symbol=tick"),
      stored(time + 3, "rclcpp_timer_link_node timer_handle=" + handle + " node_handle=0x10"),
      stored(time + 4, "callback_group_add_timer callback_group_addr=0x90 timer_handle=" + handle)};
}

std::vector<std::string> subscription_made(int time, const std::string& handle,
                                           const std::string& object, const std::string& callback,
                                           const std::string& topic) {
  return {stored(time, "rcl_subscription_init node_handle=0x10 queue_depth=1 subscription_handle=" +
                           handle + " topic_name=" + topic),
          stored(time + 1, "rclcpp_subscription_init subscription_handle=" + handle +
                               " subscription=" + object),
          stored(time + 2, "rclcpp_subscription_callback_added subscription=" + object +
                               " callback=" + callback),
          stored(time + 3, "rclcpp_callback_register callback=" + callback + " symbol=take"),
          stored(time + 4,
                 "callback_group_add_subscription callback_group_addr=0x91 subscription_handle=" +
                     handle)};
}

using Tellings = std::vector<std::string>;

Tellings operator+(Tellings one, const Tellings& other) {
  one.insert(one.end(), other.begin(), other.end());
  return one;
}

const Tellings kCaretNode{
    stored(50, "rcl_node_init node_handle=0x10 node_name=n namespace=/"),
    stored(51, "add_callback_group callback_group_addr=0x90 group_type_name=reentrant"),
    stored(52,
           "add_callback_group callback_group_addr=0x91 "
           "group_type_name=mutually_exclusive")};

std::string run_of(const std::string& callback, int time, int duration) {
  return std::to_string(time) + " callback_start callback=" + callback + '\n' +
         std::to_string(time + duration) + " callback_end callback=" + callback + '\n';
}

// One each nanosecond.
std::string told_from(int time, const Tellings& tellings) {
  std::string text;
  for (const auto& telling : tellings)
    text += std::to_string(time++) + ' ' + telling + '\n';
  return text;
}

// The callback runs before all that is told and behind it.
Ros2Result told_by_caret(const Tellings& tellings, const std::string& callback) {
  return analyze_ros2(run_of(callback, 1000, 5) + told_from(2000, tellings) +
                      run_of(callback, 3000, 7));
}

// Kind by kind as CARET stores them: names of events in order of the alphabet.
Tellings by_kind(Tellings tellings) {
  std::ranges::stable_sort(tellings, {}, [](const std::string& telling) {
    return telling.substr(0, telling.find(' '));
  });
  return tellings;
}

// In whatever order they are told.
void expect_of(const Tellings& tellings, const std::string& callback, const std::string& expected,
               const std::string& symbol) {
  auto shuffled = tellings;
  auto reversed = by_kind(tellings);
  std::ranges::reverse(reversed);
  std::vector<Tellings> orders{tellings, by_kind(tellings), reversed};
  std::minstd_rand random(1);
  for (int i = 0; i < 100; ++i) {
    std::shuffle(shuffled.begin(), shuffled.end(), random);
    orders.push_back(shuffled);
  }
  for (const auto& order : orders) {
    const auto result = told_by_caret(order, callback);
    const auto in_words = [&order] {
      std::string text;
      for (const auto& telling : order)
        text += telling + '\n';
      return text;
    };
    ASSERT_EQ(result.durations(), expected + ": 2 of 5 to 7\n") << in_words();
    const auto& row = result.callback(expected);
    // A symbol that is told before its callback is not kept.
    ASSERT_TRUE(row.symbol.empty() || row.symbol == symbol) << row.symbol << '\n' << in_words();
    ASSERT_TRUE(row.group) << in_words();
  }
}

// Of a timer and a subscription, whichever was made last, asked by the address of its callback.
void expect_last_made_of_two(const std::string& timer_handle, const std::string& timer_callback) {
  const auto timer = [&](int made) { return timer_made(made, timer_handle, timer_callback, 50); };
  const auto subscription = [](int made) {
    return subscription_made(made, "0x60", "0x70", "0x71", "/scan");
  };
  expect_of(kCaretNode + timer(100) + subscription(300), "0x71", "/n@Subscription(/scan)", "take");
  expect_of(kCaretNode + subscription(100) + timer(300), timer_callback, "/n@Timer(50)", "tick");
}

TEST(Ros2CaretAttached, AHandleIsThatOfWhatWasMadeLast) { expect_last_made_of_two("0x60", "0x61"); }

TEST(Ros2CaretAttached, AnAddressIsThatOfWhatWasMadeLast) {
  expect_last_made_of_two("0x50", "0x71");
}

TEST(Ros2CaretAttached, BothAreThoseOfWhatWasMadeLast) {
  expect_of(kCaretNode + timer_made(100, "0x60", "0x61", 10) + timer_made(300, "0x60", "0x61", 50),
            "0x61", "/n@Timer(50)", "tick");
  expect_of(kCaretNode + timer_made(100, "0x60", "0x61", 50) + timer_made(300, "0x60", "0x61", 10),
            "0x61", "/n@Timer(10)", "tick");
  expect_of(kCaretNode + timer_made(100, "0x60", "0x71", 10) +
                subscription_made(300, "0x60", "0x70", "0x71", "/scan"),
            "0x71", "/n@Subscription(/scan)", "take");
}

TEST(Ros2CaretAttached, SoAreObjects) {
  expect_of(kCaretNode + subscription_made(100, "0x60", "0x70", "0x71", "/old") +
                subscription_made(300, "0x62", "0x70", "0x72", "/new"),
            "0x72", "/n@Subscription(/new)", "take");
  expect_of(kCaretNode + subscription_made(100, "0x60", "0x70", "0x71", "/old") +
                subscription_made(300, "0x60", "0x70", "0x71", "/new"),
            "0x71", "/n@Subscription(/new)", "take");
}

TEST(Ros2CaretAttached, ANodeIsTheOneThatHadTheHandleThen) {
  const Tellings nodes{stored(50, "rcl_node_init node_handle=0x10 node_name=old namespace=/"),
                       stored(200, "rcl_node_init node_handle=0x10 node_name=n namespace=/")};
  auto old = timer_made(100, "0x60", "0x61", 50);
  for (const bool is_reversed : {false, true}) {
    auto order = nodes;
    if (is_reversed) std::ranges::reverse(order);
    const auto result = told_by_caret(order + old + timer_made(300, "0x62", "0x63", 50), "0x63");
    EXPECT_THAT(result.logical_ids(), UnorderedElementsAre("/old@Timer(50)", "/n@Timer(50)"));
    EXPECT_EQ(result.callback("/n@Timer(50)").instances, 2U);
  }
}

TEST(Ros2CaretAttached, EqualIdsAreNumberedInOrderOfCreation) {
  const auto first = timer_made(100, "0x60", "0x61", 50);
  const auto second = timer_made(300, "0x62", "0x63", 50);
  EXPECT_EQ(told_by_caret(kCaretNode + first + second, "0x63").callback("/n@Timer(50)#2").instances,
            2U);
  EXPECT_EQ(told_by_caret(kCaretNode + second + first, "0x63").callback("/n@Timer(50)#2").instances,
            2U);
}

TEST(Ros2CaretAttached, EqualIdsAreNumberedAlsoWhereTheirNodeIsToldLast) {
  const auto first = timer_made(100, "0x60", "0x61", 50);
  const auto second = timer_made(300, "0x62", "0x63", 50);
  for (const auto& timers : {first + second, second + first})
    EXPECT_EQ(told_by_caret(timers + kCaretNode, "0x63").callback("/n@Timer(50)#2").instances, 2U);
}

// As they were made, or kind by kind, which is how CARET tells them, once or twice.
TEST(Ros2CaretAttached, EqualIdsAreNumberedBehindThoseThatAreGone) {
  const auto second_is_there = [](const Tellings& all, const std::string& id) {
    for (const auto& order : {all, by_kind(all), by_kind(all) + by_kind(all)})
      EXPECT_EQ(told_by_caret(order, "0x71").callback(id + "#2").instances, 2U);
  };
  const auto subscription = [](int time) {
    return subscription_made(time, "0x60", "0x70", "0x71", "/scan");
  };
  second_is_there(kCaretNode + subscription(100) + subscription(300), "/n@Subscription(/scan)");
  second_is_there(
      kCaretNode + subscription(100) + subscription_made(300, "0x62", "0x70", "0x71", "/scan"),
      "/n@Subscription(/scan)");
  second_is_there(
      kCaretNode + timer_made(100, "0x60", "0x71", 50) + timer_made(300, "0x60", "0x71", 50),
      "/n@Timer(50)");
}

// What it tells while it records was made just now.
TEST(Ros2CaretAttached, WhatIsMadeNowHasNotRunBefore) {
  const auto result = told_by_caret(kCaretNode + timer_made(1990, "0x60", "0x61", 50), "0x61");
  EXPECT_EQ(result.callback("/n@Timer(50)").instances, 1U);
}

// A session that begins later tells the same again.
TEST(Ros2CaretAttached, WhatIsToldAgainIsTheSame) {
  const auto timer = timer_made(100, "0x60", "0x61", 50);
  const auto subscription = subscription_made(300, "0x60", "0x70", "0x71", "/scan");
  const auto all = kCaretNode + timer + subscription;
  EXPECT_EQ(told_by_caret(all + by_kind(all), "0x71").durations(),
            "/n@Subscription(/scan): 2 of 5 to 7\n");
}

// As rviz2 subscribes to a topic again.
TEST(Ros2CaretAttached, WhatIsMadeAgainWhereItLayIsAnother) {
  const auto runs = [](const auto& made) {
    return analyze_ros2(told_from(60, kCaretNode) + told_from(100, made(100)) +
                        run_of("0x71", 200, 5) + told_from(300, made(300)) + run_of("0x71", 400, 7))
        .durations();
  };
  EXPECT_EQ(runs([](int time) { return subscription_made(time, "0x60", "0x70", "0x71", "/scan"); }),
            "/n@Subscription(/scan): 1 of 5 to 5\n/n@Subscription(/scan)#2: 1 of 7 to 7\n");
  EXPECT_EQ(runs([](int time) { return timer_made(time, "0x60", "0x71", 50); }),
            "/n@Timer(50): 1 of 5 to 5\n/n@Timer(50)#2: 1 of 7 to 7\n");
  EXPECT_EQ(runs([](int time) {
              return Tellings{
                  stored(time, "rclcpp_service_callback_added service_handle=0x60 callback=0x71")};
            }),
            "?@Service(?): 1 of 5 to 5\n?@Service(?)#2: 1 of 7 to 7\n");
}

TEST(Ros2CaretAttached, APublisherIsTheOneThatWasMadeLast) {
  const std::string taker = R"(
    0 rcl_node_init pid=2 node_handle=0x10 node_name=b namespace=/
    0 rcl_subscription_init pid=2 subscription_handle=0x20 node_handle=0x10 rmw_subscription_handle=0xa1 topic_name=/new queue_depth=1
    0 rclcpp_subscription_init pid=2 subscription_handle=0x20 subscription=0x40
    0 rclcpp_subscription_callback_added pid=2 subscription=0x40 callback=0x50
)";
  const std::string sent = R"(
    600 rclcpp_publish pid=1 tid=1 message=0x99
    601 rcl_publish pid=1 tid=1 publisher_handle=0x60 message=0x99
    602 rmw_publish pid=1 tid=1 message=0x99 timestamp=1000602
    700 rmw_take pid=2 tid=2 rmw_subscription_handle=0xa1 message=0x98 source_timestamp=1000602 taken=1
    701 callback_start pid=2 tid=2 callback=0x50
    702 callback_end pid=2 tid=2 callback=0x50)";
  const auto old =
      stored(100, "rcl_publisher_init publisher_handle=0x60 node_handle=0x10 topic_name=/old") +
      '\n';
  const auto later =
      stored(300, "rcl_publisher_init publisher_handle=0x60 node_handle=0x10 topic_name=/new") +
      '\n';
  for (const auto& order : {"500 " + old + "501 " + later, "500 " + later + "501 " + old}) {
    const auto result = analyze_ros2(taker + order + sent);
    ASSERT_EQ(result.instances.size(), 1U);
    EXPECT_TRUE(result.instances.front().is_from_known_publisher) << order;
  }
}

}  // namespace
}  // namespace cie::test
