// What lies between the traces of a host, and what lies within one.
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vocabulary/session_gaps.hpp>

namespace cie::test {
namespace {

using namespace analysis;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

// Streams are numbered as they are added; what is told of packets comes in order of time.
class Recording {
 public:
  void add(std::uint32_t trace, const std::string& host = "robot", Domain domain = Domain::user,
           std::optional<bool> has_callback_events = {}) {
    gaps_.apply(head(streams_++, 0), StreamBegin{.channel = 0,
                                                 .trace = trace,
                                                 .domain = domain,
                                                 .host = host,
                                                 .clock_uuid = "boot",
                                                 .path = {},
                                                 .has_callback_events = has_callback_events});
  }
  void packet(std::uint32_t stream, std::int64_t begin, std::int64_t end) {
    if (const auto gap = gaps_.apply(head(stream, begin), PacketBegin{})) {
      found.emplace_back(gap->begin.ns, gap->end.ns);
      are_before_runs.push_back(gap->is_before_runs);
    }
    gaps_.apply(head(stream, end), PacketEnd{});
  }
  void end(std::uint32_t stream) { gaps_.apply(head(stream, 0), StreamEnd{}); }

  std::vector<std::pair<std::int64_t, std::int64_t>> found;
  std::vector<bool> are_before_runs;  // of these

 private:
  static EventHead head(std::uint32_t stream, std::int64_t time) {
    return {
        .time = Timestamp{time}, .stream = StreamIndex{stream}, .cpu = {}, .pid = {}, .tid = {}};
  }

  SessionGaps gaps_;
  std::uint32_t streams_ = 0;
};

TEST(SessionGaps, AreFromTheLastEndOfATraceToTheFirstBeginOfAnother) {
  Recording recording;
  for (const std::uint32_t trace : {0U, 0U, 1U, 1U})
    recording.add(trace);
  recording.packet(0, 10, 30);
  recording.packet(1, 12, 31);  // of another CPU
  recording.end(0);
  recording.end(1);
  recording.packet(2, 40, 60);
  recording.packet(3, 45, 61);
  EXPECT_THAT(recording.found, ElementsAre(std::pair(31, 40)));
}

TEST(SessionGaps, AreBeforeRunsUntilASessionRecordsSome) {
  Recording recording;
  recording.add(0, "robot", Domain::user, false);
  recording.add(1, "robot", Domain::user, false);
  recording.add(2, "robot", Domain::user, true);
  recording.add(3);  // nobody knows
  recording.add(4, "robot", Domain::user, false);
  for (std::uint32_t stream = 0; stream < 5; ++stream) {
    recording.packet(stream, 10 * stream, 10 * stream + 1);
    recording.end(stream);
  }
  EXPECT_THAT(recording.are_before_runs, ElementsAre(true, true, false, false));
}

// A CPU's packet begins with its first event, wherever the one before it ended.
TEST(SessionGaps, AreNoneWithinATrace) {
  Recording recording;
  for (int cpu = 0; cpu < 3; ++cpu)
    recording.add(0);
  recording.packet(0, 10, 30);
  recording.packet(0, 40, 60);
  recording.end(0);
  recording.end(2);             // nothing ran there
  recording.packet(1, 70, 80);  // the first event of its CPU
  EXPECT_THAT(recording.found, IsEmpty());
}

TEST(SessionGaps, AreNoneWhileAnotherTraceGoesOn) {
  Recording recording;
  for (const std::uint32_t trace : {0U, 1U, 2U})
    recording.add(trace);
  recording.packet(1, 5, 35);
  recording.packet(0, 10, 30);
  recording.end(0);
  recording.packet(2, 32, 50);
  EXPECT_THAT(recording.found, IsEmpty());
}

TEST(SessionGaps, AreNoneWhereOneTraceBeginsAsTheOtherEnds) {
  Recording recording;
  recording.add(0);
  recording.add(1);
  recording.packet(0, 10, 30);
  recording.end(0);
  recording.packet(1, 30, 50);
  EXPECT_THAT(recording.found, IsEmpty());
}

TEST(SessionGaps, AreOfOneHostsApplications) {
  Recording recording;
  recording.add(0);
  recording.add(1, "desk");
  recording.add(2, "robot", Domain::kernel);
  recording.add(3);
  recording.packet(0, 10, 30);
  recording.end(0);
  recording.packet(1, 40, 60);
  recording.packet(2, 42, 100);
  recording.packet(3, 50, 60);
  EXPECT_THAT(recording.found, ElementsAre(std::pair(30, 50))) << "of the robot";
}

}  // namespace
}  // namespace cie::test
