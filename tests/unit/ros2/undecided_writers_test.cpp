// Messages of which it is not told which publication they are, and what that leaves of chains.
#include "ros2_text.hpp"

#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

// Process 3, which publishes /t.
const std::string kOther = R"(
  2 rcl_node_init pid=3 node_handle=0x10 node_name=c namespace=/
  2 rcl_publisher_init pid=3 publisher_handle=0x60 node_handle=0x10 topic_name=/t
)";

// Humble: no publish tells its source timestamp. A timer on thread 1 of process 1 publishes /t every
// 10 ms; so may process 3, at other times. A subscription in process 2 takes both.
class Scans {
 public:
  // `set`: by how much CLOCK_REALTIME was set since the recording began.
  Scans& round(std::int64_t k, bool is_other_at_once = false, std::int64_t set = 0) {
    const auto start = k * 10'000'000 + 60'000;
    add(start - 10'000, "rclcpp_executor_wait_for_work pid=1 timeout=1");
    add(start - 5'000, "rclcpp_executor_get_next_ready pid=1");
    add(start, "callback_start pid=1 callback=0x30");
    add(start + 1'000, "rclcpp_publish pid=1 message=0x99");
    add(start + 2'000, "rcl_publish pid=1 publisher_handle=0x60 message=0x99");
    if (is_other_at_once) {
      add(start + 2'500, "rclcpp_publish pid=3 tid=3 message=0x98");
      add(start + 2'700, "rcl_publish pid=3 tid=3 publisher_handle=0x60 message=0x98");
    }
    add(start + 3'000, "rmw_publish pid=1 message=0x99");
    if (is_other_at_once) add(start + 3'700, "rmw_publish pid=3 tid=3 message=0x98");
    if (is_other_at_once) add(start + 9'000, "rclcpp_executor_wait_for_work pid=3 tid=3 timeout=1");
    add(start + 10'000, "callback_end pid=1 callback=0x30");
    const auto written = kRealtimeOffset + start + 3'200 + set;
    add(start + 100'000,
        "rmw_take pid=2 tid=2 message=0x88 taken=1 source_timestamp=" + std::to_string(written));
    add(start + 110'000, "callback_start pid=2 tid=2 callback=0x50");
    add(start + 120'000, "callback_end pid=2 tid=2 callback=0x50");
    return *this;
  }
  // Without who makes them.
  const std::string& events() const noexcept { return text_; }
  Ros2Result analyze_without_spec() const {
    return analyze_ros2(pair_of_period(10'000'000) + kOther + text_);
  }
  Ros2Result analyze() const {
    return analyze_ros2(pair_of_period(10'000'000) + kOther + text_, -1, R"yaml(
callback_groups: []
chains:
  - name: scan
    callbacks: ["/a@Timer(10000000)", "/b@Subscription(/t)"]
    path_latency: 1000000
    data_age: 15000000
)yaml");
  }

 private:
  void add(std::int64_t time, const std::string& event) {
    text_ += std::to_string(time) + ' ' + event + '\n';
  }
  std::string text_;
};

TEST(Ros2UndecidedWriters, AMessageOfWhicheverPublisherLeavesAChainUndecided) {
  Scans known;
  Scans either;
  for (std::int64_t k = 1; k <= 6; ++k) {
    known.round(k);
    either.round(k, k == 3);
  }
  EXPECT_EQ(known.analyze().verdict("Q2"), analysis::Verdict::pass);
  const auto result = either.analyze();
  EXPECT_EQ(result.verdict("Q2"), analysis::Verdict::inconclusive)
      << "what was measured across the unknown instance is no data age\n"
      << result.evidence("Q2");
  EXPECT_THAT(result.evidence("Q2"),
              testing::HasSubstr("the publish of the message taken here is not known"));
  EXPECT_THAT(result.chains(), ElementsAre("scan: 5"));
}

// From one start of the timer to the next end of the chain it is a period and 120 us.
TEST(Ros2UndecidedWriters, AgesAndReactionsDoNotGoAcrossOneWithoutASpec) {
  Scans scans;
  for (std::int64_t k = 1; k <= 6; ++k)
    scans.round(k, k == 3);
  const auto result = scans.analyze_without_spec();
  ASSERT_THAT(result.chains(), ElementsAre("/a@Timer(10000000) -> /b@Subscription(/t): 5"));
  const auto& chain = result.analysis.report.chains.front();
  ASSERT_TRUE(chain.data_age && chain.reaction_time);
  EXPECT_EQ(chain.data_age->count, 3U) << "1 to 2, 4 to 5, 5 to 6";
  EXPECT_EQ(chain.data_age->max, 10'120'000);
  EXPECT_EQ(chain.reaction_time->max, 10'120'000);
}

TEST(Ros2UndecidedWriters, MessagesThatFitNoPublishAnyMoreLeaveAChainUndecided) {
  for (const std::int64_t set : {-1'000'000'000, -3'000'000, 1'000'000'000}) {
    Scans scans;
    for (std::int64_t k = 1; k <= 10; ++k)
      scans.round(k, false, k > 4 ? set : 0);
    const auto result = scans.analyze();
    EXPECT_NE(result.verdict("Q2"), analysis::Verdict::pass) << set;
    EXPECT_EQ(result.verdict("Q2"), analysis::Verdict::inconclusive)
        << set << result.evidence("Q2");
  }
}

// CLOCK_REALTIME was set forward by a second between message 1, which is taken late, and message 2, which is
// being published then: the timestamp of the first lies in the future.
TEST(Ros2UndecidedWriters, AMessageFromTheFutureIsOfNoCallForCertain) {
  constexpr const char* kSpec = R"yaml(
callback_groups: []
chains:
  - name: scan
    callbacks: ["/a@Timer(10000000)", "/b@Subscription(/t)"]
    path_latency: 5000000
)yaml";
  const auto of = [&](std::int64_t set) {
    const auto stamp = std::to_string(kRealtimeOffset + 10'003'500 + set);
    return analyze_ros2(pair_of_period(10'000'000) + R"(
      10000000 callback_start pid=1 callback=0x30
      10001000 rclcpp_publish pid=1 message=0x99
      10002000 rcl_publish pid=1 publisher_handle=0x60 message=0x99
      10003000 rmw_publish pid=1 message=0x99
      10009000 callback_end pid=1 callback=0x30
      20000000 callback_start pid=1 callback=0x30
      20001000 rclcpp_publish pid=1 message=0x99
      20002000 rcl_publish pid=1 publisher_handle=0x60 message=0x99
      20003000 rmw_publish pid=1 message=0x99
      20010000 rmw_take pid=2 tid=2 message=0x88 taken=1 source_timestamp=)" +
                            stamp + R"(
      20011000 callback_start pid=2 tid=2 callback=0x50
      20012000 callback_end pid=2 tid=2 callback=0x50
      20090000 callback_end pid=1 callback=0x30
)",
                        -1, kSpec);
  };
  EXPECT_EQ(of(0).verdict("Q2"), analysis::Verdict::fail);
  EXPECT_EQ(of(1'000'000'000).verdict("Q2"), analysis::Verdict::inconclusive);
  EXPECT_THAT(of(1'000'000'000).analysis.report.edges, IsEmpty());
}

// Humble: a timer publishes /t, and its callback runs on for 8 ms. Meanwhile somebody else publishes,
// whose message alone is taken.
std::string taken_of_another(const std::string& others_stream) {
  std::string text;
  const auto add = [&text](std::int64_t time, const std::string& event) {
    text += std::to_string(time) + ' ' + event + '\n';
  };
  for (std::int64_t k = 1; k <= 4; ++k) {
    const auto start = k * 10'000'000;
    add(start, "callback_start pid=1 callback=0x30");
    add(start + 1'000, "rclcpp_publish pid=1 message=0x99");
    add(start + 2'000, "rcl_publish pid=1 publisher_handle=0x60 message=0x99");
    add(start + 3'000, "rmw_publish pid=1 message=0x99");
    const auto other = start + 4'000'000;
    add(other, "rclcpp_publish pid=3 tid=3 message=0x98" + others_stream);
    add(other + 1'000,
        "rcl_publish pid=3 tid=3 publisher_handle=0x60 message=0x98" + others_stream);
    add(other + 2'000, "rmw_publish pid=3 tid=3 message=0x98" + others_stream);
    add(other + 9'000, "rclcpp_executor_wait_for_work pid=3 tid=3 timeout=1" + others_stream);
    add(start + 8'000'000, "callback_end pid=1 callback=0x30");
    add(start + 8'100'000, "rmw_take pid=2 tid=2 message=0x88 taken=1 source_timestamp=" +
                               std::to_string(kRealtimeOffset + other + 5'000));
    add(start + 8'110'000, "callback_start pid=2 tid=2 callback=0x50");
    add(start + 8'120'000, "callback_end pid=2 tid=2 callback=0x50");
  }
  return text;
}
TEST(Ros2UndecidedWriters, WhatAnotherCpuLosesProvesNoCall) {
  const auto described = pair_of_period(10'000'000) + kOther;
  const std::string loss = "1000000 lost until=90000000\n";
  EXPECT_THAT(analyze_ros2(described + taken_of_another(" stream=2")).chains(), IsEmpty());
  const auto result = analyze_ros2(described + loss + taken_of_another(" stream=2"));
  EXPECT_THAT(result.chains(), IsEmpty());
  EXPECT_THAT(result.analysis.report.edges, IsEmpty());
}

// Whoever wrote message 3 was not recorded, and may have written the others as well.
TEST(Ros2UndecidedWriters, NothingIsProvenOfATopicThatSomebodyWritesWhoIsNotRecorded) {
  const auto of = [](std::int64_t set) {
    Scans scans;
    for (std::int64_t k = 1; k <= 6; ++k)
      scans.round(k, false, k == 3 ? set : 0);
    return scans.analyze();
  };
  EXPECT_EQ(of(0).verdict("Q2"), analysis::Verdict::pass);
  const auto result = of(3'000'000);
  EXPECT_EQ(result.verdict("Q2"), analysis::Verdict::inconclusive);
  EXPECT_THAT(result.evidence("Q2"),
              testing::HasSubstr("somebody whose publications are not recorded writes on /t"));
  EXPECT_THAT(result.chains(), ElementsAre("scan: 2")) << "those before";
}

// It was made before the recording, so that its topic is not known.
TEST(Ros2UndecidedWriters, NorIsACallProvenBesideOneOfAPublisherThatWasNotAnnounced) {
  const auto result = analyze_ros2(pair_of_period(10'000'000) + taken_of_another(""));
  EXPECT_THAT(result.chains(), IsEmpty());
  EXPECT_THAT(result.analysis.report.edges, IsEmpty());
}

// rcl announces the publisher of /rosout by one address and publishes by another. Where the whole process
// was seen, a publisher that was not announced is that one.
TEST(Ros2UndecidedWriters, LogMessagesAreOfNoOtherTopic) {
  std::string text = pair_of_period(10'000'000) + R"(
    2 rcl_node_init pid=3 node_handle=0x10 node_name=c namespace=/
    2 rcl_publisher_init pid=3 publisher_handle=0x66 node_handle=0x10 topic_name=/rosout
)";
  Scans scans;
  for (std::int64_t k = 1; k <= 3; ++k)
    scans.round(k, k == 2);
  const auto chains_of = [&](const std::string& begin) {
    return analyze_ros2(begin + text + scans.events()).chains();
  };
  const std::string kChain = "/a@Timer(10000000) -> /b@Subscription(/t): ";
  EXPECT_THAT(chains_of("0 rcl_init pid=3 context_handle=0x1\n"), ElementsAre(kChain + "3"));
  EXPECT_THAT(chains_of(""), ElementsAre(kChain + "2"))
      << "made before the recording, for all we know";
}

// The two processes of pair_of_period() on two hosts.
std::string pair_on_two_hosts() {
  std::string text;
  std::istringstream pair(pair_of_period(10'000'000));
  for (std::string line; std::getline(pair, line);)
    text += line + (line.find("pid=2") != std::string::npos ? " boot=other\n" : "\n");
  return text;
}

// In the K-th period of 10 ms, the first one publishes 2 ms after its begin, and the second one takes
// that message `taken` after it.
std::string published(std::int64_t k) {
  const auto time = [k](std::int64_t later) { return std::to_string(k * 10'000'000 + later); };
  return time(2'000'000) + " callback_start pid=1 callback=0x30\n" + time(2'011'000) +
         " rclcpp_publish pid=1 message=0x99\n" + time(2'012'000) +
         " rcl_publish pid=1 publisher_handle=0x60 message=0x99\n" + time(2'013'000) +
         " rmw_publish pid=1 message=0x99 timestamp=" +
         std::to_string(kRealtimeOffset + k * 10'000'000 + 2'013'000) + '\n' + time(2'015'000) +
         " callback_end pid=1 callback=0x30\n";
}
std::string taken(std::int64_t k, std::int64_t taken) {
  const auto time = [k](std::int64_t later) { return std::to_string(k * 10'000'000 + later); };
  return time(taken) + " rmw_take pid=2 tid=2 boot=other message=0x88 taken=1 source_timestamp=" +
         std::to_string(kRealtimeOffset + k * 10'000'000 + 2'013'000) + '\n' + time(taken + 2'000) +
         " callback_start pid=2 tid=2 boot=other callback=0x50\n" + time(taken + 12'000) +
         " callback_end pid=2 tid=2 boot=other callback=0x50\n";
}

// The second one's clock is 2 ms behind, so that it takes messages before they were written.
TEST(Ros2UndecidedWriters, AMessageMayBeTakenBeforeItIsPublishedByAClockThatIsAhead) {
  constexpr int kRounds = 5;
  auto text = pair_on_two_hosts();
  for (std::int64_t k = 1; k <= kRounds; ++k)
    text += taken(k, 18'000) + published(k);
  EXPECT_THAT(analyze_ros2(text).chains(),
              ElementsAre("/a@Timer(10000000) -> /b@Subscription(/t): " + std::to_string(kRounds)));
}

// What the publisher wrote after the end of its machine's record is unknown, not another one's.
TEST(Ros2UndecidedWriters, AMessageFromAfterItsPublishersRecordLeavesAChainUndecided) {
  constexpr const char* kSpec = R"yaml(
callback_groups: []
chains:
  - name: scan
    callbacks: ["/a@Timer(10000000)", "/b@Subscription(/t)"]
    path_latency: 1000000
)yaml";
  const auto rounds = [](std::int64_t from, std::int64_t until, bool is_told) {
    std::string text;
    for (auto k = from; k < until; ++k)
      text += (is_told ? published(k) : "") + taken(k, 2'100'000);
    return text;
  };
  const auto begin = pair_on_two_hosts() + rounds(1, 5, true);
  const auto whole = analyze_ros2(begin + rounds(5, 10, true), -1, kSpec);
  EXPECT_THAT(whole.evidence("Q2"), Not(HasSubstr("incomplete")));
  const auto cut =
      analyze_ros2(begin + "45000000 session until=120000000\n" + rounds(5, 10, false), -1, kSpec);
  EXPECT_THAT(cut.evidence("Q2"), HasSubstr("5 incomplete instances of the chain"));
}

}  // namespace
}  // namespace cie::test
