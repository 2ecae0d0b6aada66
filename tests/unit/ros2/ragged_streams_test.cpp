// The streams of a channel begin or end at different times: of a flight recorder's buffers, of a copy
// that was cut off. Outside the time that all of them cover, events of one CPU are missing, and no loss
// tells so.
#include "ros2_text.hpp"

#include <string>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

using analysis::Verdict;

// 0x30 is the timer with period 1, 0x31 that with period 2.
Ros2Result result_of(const std::string& events) { return analyze_ros2(kTwoTimers + events); }

// The first one's end at 71 and its next start are on the CPU whose record ends at 65.
const std::string kEndsEarly = R"(
    60 callback_start callback=0x30 stream=2
    65 second_ends
    75 callback_start callback=0x31
    76 callback_end callback=0x31
    86 callback_end callback=0x30
    90 callback_start callback=0x30
    91 callback_end callback=0x30
)";
// Its end at 42 and its next start at 44 are on the CPU whose record begins at 50.
const std::string kBeginsLate = R"(
    40 callback_start callback=0x30
    43 callback_start callback=0x31 tid=2
    45 callback_end callback=0x31 tid=2
    50 second_begins
    52 callback_end callback=0x30 stream=2
    60 callback_start callback=0x30 stream=2
    61 callback_end callback=0x30 stream=2
)";
// Another session beside it, which records the first CPU.
const std::string kOtherSession = R"(
    2 rcl_node_init node_handle=0x10 node_name=n namespace=/ session=2
)";

TEST(Ros2RaggedStreams, NothingEndsBehindTheEndOfOneThatBeganBefore) {
  const auto result = result_of(R"(
    10 callback_start callback=0x30 stream=2
    11 callback_end callback=0x30 stream=2
    20 callback_start callback=0x31
    21 callback_end callback=0x31
)" + kEndsEarly);
  EXPECT_NE(result.verdict("E3"), Verdict::fail) << result.evidence("E3");
  EXPECT_EQ(result.callback("/n@Timer(1)").instances, 1U);
  for (const auto& row : result.instances)
    EXPECT_LE(row.end, 65) << row.logical_id << " from " << row.start;
}

// `lttng rotate` ends a stream with its last packet: that CPU was quiet from then on.
TEST(Ros2RaggedStreams, InAChunkNothingIsMissingBehindTheEndOfOne) {
  EXPECT_EQ(result_of(kEndsEarly).callback("/n@Timer(1)").incomplete, 1U);
  auto chunk = kEndsEarly;
  const std::string end = "second_ends";
  chunk.insert(chunk.find(end) + end.size(), " of_chunk");
  const auto timer = result_of(chunk).callback("/n@Timer(1)");
  EXPECT_EQ(timer.incomplete, 0U);
  EXPECT_EQ(timer.cut, 1U) << "from 60 to 86, where the window ends at 65";
  EXPECT_EQ(timer.outside_window, 1U) << "from 90 to 91";
}

// What a thread does next on one CPU follows on what it did there last, whichever other CPU's record ended
// meanwhile, as in a snapshot.
TEST(Ros2RaggedStreams, NothingIsMissingOfAThreadThatStayedOnAnotherCpu) {
  const auto timer = [](const std::string& time) {
    return result_of(
               "10 callback_start callback=0x31 stream=2\n11 callback_end callback=0x31 stream=2\n"
               "60 callback_start callback=0x30\n" +
               time +
               " second_ends\n70 callback_end callback=0x30\n"
               "90 callback_start callback=0x30\n91 callback_end callback=0x30\n")
        .callback("/n@Timer(1)");
  };
  EXPECT_EQ(timer("65").cut, 1U);
  EXPECT_EQ(timer("65").incomplete, 0U);
  EXPECT_EQ(timer("70").instances, 1U);
  EXPECT_EQ(timer("70").incomplete, 0U);
}

TEST(Ros2RaggedStreams, NorWhereTheRecordOfAnotherCpuBegan) {
  const auto timer = result_of(R"(
    40 callback_start callback=0x30
    50 second_begins
    52 callback_end callback=0x30
    60 callback_start callback=0x30 stream=2
    61 callback_end callback=0x30 stream=2
)")
                         .callback("/n@Timer(1)");
  EXPECT_EQ(timer.incomplete, 0U);
  EXPECT_EQ(timer.instances, 1U);
}

// Another session beside it tells what one CPU's stream of this one does not, if it records that CPU.
TEST(Ros2RaggedStreams, AnotherSessionTellsNothingOfACpuThatItDoesNotRecord) {
  const auto result = result_of(kOtherSession + kBeginsLate + R"(
    70 callback_start callback=0x31 tid=2
    71 callback_end callback=0x31 tid=2
)");
  EXPECT_EQ(result.callback("/n@Timer(1)").instances, 1U) << result.durations();
}

TEST(Ros2RaggedStreams, NorDoesItBehindTheEndOfOne) {
  const auto result = result_of(kOtherSession + kEndsEarly);
  EXPECT_EQ(result.callback("/n@Timer(1)").instances, 0U) << result.durations();
}

TEST(Ros2RaggedStreams, NothingGoesOnFromBeforeTheBeginOfOne) {
  const auto result = result_of(kBeginsLate);
  EXPECT_EQ(result.callback("/n@Timer(1)").instances, 1U) << result.durations();
  EXPECT_NE(result.verdict("E2"), Verdict::fail) << result.evidence("E2");
}

// Another timer is made at its address meanwhile, which runs on another thread.
TEST(Ros2RaggedStreams, WhatRunsSinceTheBeginOfOneMayBeAnother) {
  const auto result = result_of(R"(
    10 callback_start callback=0x30 tid=1
    11 callback_end callback=0x30 tid=1
    50 second_begins
    60 callback_start callback=0x30 tid=2
    61 callback_end callback=0x30 tid=2
    70 callback_start callback=0x30 tid=2
    71 callback_end callback=0x30 tid=2
    80 callback_start callback=0x31 tid=1 stream=2
    81 callback_end callback=0x31 tid=1 stream=2
)");
  EXPECT_EQ(result.verdict("M3"), Verdict::inconclusive) << result.evidence("M3");
}

}  // namespace
}  // namespace cie::test
