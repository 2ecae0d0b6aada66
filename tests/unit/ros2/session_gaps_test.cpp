// Between two sessions nobody recorded: what ran into that time and what runs after it are no pair.
#include "ros2_text.hpp"
#include "timer_text.hpp"

#include <algorithm>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using testing::HasSubstr;

constexpr const char* kTaker = "/n@Subscription(/t)";
constexpr const char* kDeadline =
    "callback_groups:\n  - {id: \"/n@Subscription(/t)\", response_deadline: 1us}\n";

std::string subscription(int pid) {
  const auto of_process = " pid=" + std::to_string(pid) + ' ';
  return "  0 rcl_init" + of_process + "context_handle=0x1\n  0 rcl_node_init" + of_process +
         "node_handle=0x10 node_name=n namespace=/\n  2 rcl_subscription_init" + of_process +
         "subscription_handle=0x21 node_handle=0x10 rmw_subscription_handle=0xa1 topic_name=/t "
         "queue_depth=1\n  2 rclcpp_subscription_init" +
         of_process +
         "subscription_handle=0x21 subscription=0x41\n  2 rclcpp_subscription_callback_added" +
         of_process + "subscription=0x41 callback=0x51\n";
}

std::string run(int start, int end, int pid = 1) {
  const auto text = [pid](int time, const char* event) {
    return "  " + std::to_string(time) + ' ' + event + " pid=" + std::to_string(pid) +
           " callback=0x51\n";
  };
  return text(start, "callback_start") + text(end, "callback_end");
}

// The run that begins at 3000 ended unseen, and the one that ends at 9100 began unseen.
std::string runs_around(const std::string& session) {
  return subscription(1) + run(1000, 1100) + "  3000 callback_start callback=0x51\n" + session +
         "  9100 callback_end callback=0x51\n" + run(12'000, 12'100);
}

bool has_gap(const Ros2Result& result) {
  return std::ranges::any_of(result.analysis.report.defects, [](const TraceDefect& defect) {
    return defect.kind == DefectKind::host_gap;
  });
}

// Of the run that begins then; -1: it is open.
std::int64_t end_of(const Ros2Result& result, std::int64_t start) {
  const auto row = std::ranges::find(result.instances, start, &InstanceRow::start);
  return row == result.instances.end() ? 0 : row->end;
}

TEST(Ros2SessionGaps, AnEndAfterOneIsOfNoStartBeforeIt) {
  const auto result = analyze_ros2(runs_around("  3500 session until=9000\n"), -1, kDeadline);
  EXPECT_EQ(end_of(result, 3000), -1);
  const auto& callback = result.callback(kTaker);
  ASSERT_TRUE(callback.duration);
  EXPECT_EQ(callback.duration->count, 2U);
  EXPECT_EQ(callback.duration->max, 100);
  EXPECT_EQ(result.verdict("R3"), Verdict::inconclusive) << result.evidence("R3");
  EXPECT_TRUE(has_gap(result));
  EXPECT_FALSE(result.analysis.report.trace.complete);
}

TEST(Ros2SessionGaps, AreNoneWhereOneSessionFollowsTheOther) {
  const auto result = analyze_ros2(runs_around("  3500 session until=3500\n"), -1, kDeadline);
  EXPECT_EQ(end_of(result, 3000), 9100);
  const auto& callback = result.callback(kTaker);
  EXPECT_EQ(callback.instances, 3U);
  EXPECT_EQ(callback.cut, 0U);
  EXPECT_EQ(result.verdict("R3"), Verdict::fail) << "that run took 6.1 us";
  EXPECT_FALSE(has_gap(result));
  const auto& trace = result.analysis.report.trace;
  EXPECT_EQ(*trace.end - *trace.begin, Duration{12'101}) << "of both";
}

// Runs are of 1 us and 0.1 us: three in 4.5 us that were recorded, of 13.001 us in all.
TEST(Ros2SessionGaps, AreNoTimeInWhichThreadsMightHaveRun) {
  const auto result =
      analyze_ros2(subscription(1) + run(1000, 2000) + "  3500 session until=12000\n" +
                   run(12'100, 12'200) + run(12'900, 13'000));
  ASSERT_EQ(result.analysis.report.hosts.size(), 1U);
  EXPECT_EQ(result.analysis.report.hosts[0].recorded, Duration{3'500 + 1'001});
  const auto& trace = result.analysis.report.trace;
  EXPECT_EQ(*trace.end - *trace.begin, Duration{13'001}) << "with the gap";
}

TEST(Ros2SessionGaps, OutsideTheWindowAreNoDefectOfIt) {
  const auto runs = subscription(1) + run(1000, 1100) + "  3500 session until=9000\n" +
                    run(12'000, 12'100) + run(13'000, 13'100);
  const auto in_window = [&runs](std::int64_t from, std::int64_t to) {
    return has_gap(analyze_ros2(runs, -1, {}, TimeWindow{.from = {from}, .to = {to}}));
  };
  EXPECT_TRUE(in_window(500, 12'500));
  EXPECT_TRUE(in_window(8'000, 12'500));
  EXPECT_FALSE(in_window(9'000, 12'500));
  EXPECT_FALSE(in_window(500, 3'500));
}

TEST(Ros2SessionGaps, MayHideThatACallbackRanOnAnotherThread) {
  const auto runs = [](const std::string& session) {
    return subscription(1) + run(1000, 1100) + session + run(12'000, 12'100);
  };
  EXPECT_EQ(analyze_ros2(runs("")).verdict("M3"), Verdict::pass);
  const auto result = analyze_ros2(runs("  3500 session until=9000\n"));
  EXPECT_EQ(result.verdict("M3"), Verdict::inconclusive);
  EXPECT_THAT(result.evidence("M3"), HasSubstr("between two sessions"));
}

// As `ros2 trace --dual-session` records them.
TEST(Ros2SessionGaps, RunsAreRecordedSinceTheSessionThatRecordsThem) {
  const auto result = analyze_ros2(subscription(1) + "  3500 session of runs until=9000\n" +
                                   run(9100, 9200) + run(12'000, 12'100));
  EXPECT_EQ(result.callback(kTaker).instances, 2U);
  const auto& report = result.analysis.report;
  const auto gap = std::ranges::find(report.defects, DefectKind::host_gap, &TraceDefect::kind);
  ASSERT_NE(gap, report.defects.end());
  EXPECT_THAT(gap->advice, HasSubstr("what its applications made, and nothing in between"));
  EXPECT_EQ(report.hosts.front().recorded, Duration{12'101 - 9000}) << "of it they are a share";
  EXPECT_EQ(result.verdict("M3"), Verdict::inconclusive) << "a client may have been made meanwhile";
}

// The timer is made in the first one; whether an executor served it before the second one nobody tells.
TEST(Ros2SessionGaps, MayHideThatATimerWasServedBefore) {
  using namespace timers;
  const auto with = [](const std::string& session) {
    Text text;
    text.add(45 * kMs, session.empty() ? "rcl_node_init node_handle=0x11" : session);
    for (std::int64_t k = 7; k < 20; ++k)
      text.run(expiry(k) + 50 * kUs);
    return text.analyze();
  };
  EXPECT_EQ(with("").verdict("R2"), Verdict::pass) << with("").evidence("R2");
  EXPECT_EQ(with("session of runs until=46000000").verdict("R2"), Verdict::inconclusive);
}

// One process ended with its session, and another one began in the next.
TEST(Ros2SessionGaps, HideNothingOfProcessesThatDidNotLiveThen) {
  const auto result =
      analyze_ros2(subscription(1) + run(1000, 1100) + "  3500 session until=9000\n" +
                   "  9000 rcl_init pid=2 " + "context_handle=0x1\n" + run(12'000, 12'100, 2));
  EXPECT_FALSE(has_gap(result));
  EXPECT_NE(result.verdict("T2"), Verdict::inconclusive);
}

// Whatever it tells there: nothing but the events tells that it did not end before.
TEST(Ros2SessionGaps, WereLivedThroughByAProcessThatTellsOfAnythingOnBothSides) {
  const std::string session = "  3500 session until=9000\n";
  const std::string poll = " rclcpp_executor_wait_for_work timeout=0\n";
  const std::string take = " rmw_take rmw_subscription_handle=0xa1 taken=0\n";
  for (const auto& sign : {poll, take}) {
    const auto behind =
        analyze_ros2(subscription(1) + run(1000, 1100) + session + "  12000" + sign);
    EXPECT_TRUE(has_gap(behind)) << sign;
    EXPECT_EQ(behind.verdict("T2"), Verdict::inconclusive) << sign;
    EXPECT_EQ(behind.verdict("M3"), Verdict::inconclusive) << sign;
    const auto before =
        analyze_ros2("  100" + sign + session + "  10000 rcl_node_init node_handle=0x10\n" +
                     run(12'000, 12'100));
    EXPECT_TRUE(has_gap(before)) << sign;
  }
}

// A timer publishes every 100, and the subscription takes that 5 later. The runs at 300 and 400 were
// not recorded.
std::string chain(const std::string& session, bool has_all) {
  auto text = pair_of_period(100);
  for (const int time : {100, 200, 300, 400, 500, 600}) {
    const bool is_hidden = time == 300 || time == 400;
    if (time == 300) text += session;
    if (is_hidden && !has_all) continue;
    const auto at = [time](int later) { return "  " + std::to_string(time + later); };
    const auto stamp = std::to_string(kRealtimeOffset + time + 2);
    text += at(0) + " callback_start pid=1 tid=1 callback=0x30\n" + at(1) +
            " rclcpp_publish pid=1 tid=1 publisher_handle=0x60 message=0x9\n" + at(1) +
            " rcl_publish pid=1 tid=1 publisher_handle=0x60 message=0x9\n" + at(2) +
            " rmw_publish pid=1 tid=1 message=0x9 timestamp=" + stamp + "\n" + at(3) +
            " callback_end pid=1 tid=1 callback=0x30\n" + at(5) +
            " rmw_take pid=2 tid=2 message=0x8 source_timestamp=" + stamp + " taken=1\n" + at(6) +
            " callback_start pid=2 tid=2 callback=0x50\n" + at(7) +
            " callback_end pid=2 tid=2 callback=0x50\n";
  }
  return text;
}

constexpr const char* kBounds = R"yaml(
chains:
  - name: c
    callbacks: ["/a@Timer(100)", "/b@Subscription(/t)"]
    reaction_time: 200
    data_age: 200
)yaml";

TEST(Ros2SessionGaps, ReactionTimesAndDataAgesDoNotGoAcross) {
  const auto largest = [](const Ros2Result& result) {
    const auto& reaction = result.analysis.report.chains.at(0).reaction_time;
    const auto& age = result.analysis.report.chains.at(0).data_age;
    return std::pair(reaction ? reaction->max : 0, age ? age->max : 0);
  };
  const auto whole = analyze_ros2(chain("", true), -1, kBounds);
  // A stimulus just after one start is read by the next one, whose answer comes 7 later.
  EXPECT_EQ(largest(whole), std::pair(107L, 107L));
  EXPECT_EQ(whole.verdict("Q2"), Verdict::pass) << whole.evidence("Q2");
  const auto cut = analyze_ros2(chain("  250 session until=450\n", false), -1, kBounds);
  EXPECT_EQ(largest(cut), std::pair(107L, 107L));
  EXPECT_EQ(cut.verdict("Q2"), Verdict::inconclusive) << cut.evidence("Q2");
  // Where it was recorded that nothing happened, it took that long.
  const auto paused = analyze_ros2(chain("", false), -1, kBounds);
  EXPECT_EQ(largest(paused), std::pair(307L, 307L));
  EXPECT_EQ(paused.verdict("Q2"), Verdict::fail);
}

// Whoever wrote a message that fits no publication may have done so unseen, if it lived then.
TEST(Ros2SessionGaps, MayHideThePublicationOfAMessage) {
  const std::string take = R"(
  700 rmw_take pid=2 tid=2 message=0x8 source_timestamp=1000300 taken=1
  701 callback_start pid=2 tid=2 callback=0x50
  702 callback_end pid=2 tid=2 callback=0x50
)";
  const auto is_of_recorded_writer = [&](const std::string& session) {
    const auto result = analyze_ros2(chain(session, false) + take);
    return std::ranges::any_of(result.instances, [](const InstanceRow& row) {
      return row.start == 701 && row.is_from_known_publisher;
    });
  };
  EXPECT_FALSE(is_of_recorded_writer(""));
  EXPECT_TRUE(is_of_recorded_writer("  250 session until=450\n"));
}

}  // namespace
}  // namespace cie::test
