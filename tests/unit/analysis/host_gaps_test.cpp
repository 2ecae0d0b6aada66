// When nothing is known of a machine, from what sessions and the packets of all machines cover.
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <model/host_gaps.hpp>

namespace cie::test {
namespace {

using namespace analysis;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::StartsWith;

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr HostIndex kRobot{0};
constexpr HostIndex kDeskHost{1};

// Times are seconds of the desk's clock; the robot's shows 1000 s more.
struct Facts {
  Model model;

  Facts() {
    model.hosts.push_back(
        {.name = "robot", .told = "robot", .clock_uuid = "a", .clock_offset_ns = 0});
    model.hosts.push_back(
        {.name = "desk", .told = "desk", .clock_uuid = "b", .clock_offset_ns = 1000 * kSecond});
    model.begin = Timestamp{0};
  }

  static Timestamp at(HostIndex host, std::int64_t seconds) {
    return Timestamp{(seconds + (host == kRobot ? 1000 : 0)) * kSecond};
  }
  void add_stream(HostIndex host, std::uint32_t channel, std::int64_t from, std::int64_t to,
                  Domain domain = Domain::user) {
    model.streams.push_back({.channel = channel,
                             .domain = domain,
                             .host = host,
                             .begin = at(host, from),
                             .end = at(host, to)});
  }
  void add_session_gap(HostIndex host, std::int64_t from, std::int64_t to) {
    model.session_gaps.push_back({.host = host, .from = at(host, from), .to = at(host, to)});
  }
  void add_process(HostIndex host, std::int64_t from, std::int64_t to, bool has_ended) {
    auto& process = model.processes.emplace_back();
    process.host = host;
    process.first_seen = EventRef{.time = at(host, from)};
    process.last_seen = EventRef{.time = at(host, to)};
    process.has_cie_events = true;
    if (has_ended) process.run_end = RunTotals{};
  }
  std::vector<std::string> gaps() const {
    std::vector<std::string> words;
    for (const auto& gap : host_gaps(model)) {
      const auto text = in_words(gap, model);
      words.push_back(text.substr(0, text.find(" after")));
    }
    return words;
  }
};

TEST(HostGaps, AreWhatLiesBetweenTwoSessionsOfOneProcess) {
  Facts facts;
  facts.add_session_gap(kRobot, 11, 14);
  facts.add_process(kRobot, 3, 20, true);
  EXPECT_THAT(facts.gaps(), ElementsAre("nothing is known of robot from 11.000 s to 14.000 s"));
}

TEST(HostGaps, AreNoneBetweenRecordingsOfProcessesOfTheirOwn) {
  Facts facts;
  facts.add_session_gap(kRobot, 10, 14);
  facts.add_process(kRobot, 3, 9, true);
  facts.add_process(kRobot, 15, 19, true);
  EXPECT_THAT(facts.gaps(), IsEmpty());
}

TEST(HostGaps, LastToTheEndOfWhatOtherMachinesRecorded) {
  Facts facts;
  facts.add_stream(kRobot, 0, 1, 10);
  facts.add_process(kRobot, 1, 10, false);
  EXPECT_THAT(facts.gaps(), IsEmpty()) << "there is nobody to compare with";
  facts.add_stream(kDeskHost, 1, 1, 12);
  facts.add_process(kDeskHost, 1, 12, true);
  EXPECT_THAT(facts.gaps(), IsEmpty()) << "packets take their time";
  facts.add_stream(kDeskHost, 1, 1, 30);
  EXPECT_THAT(facts.gaps(), ElementsAre("nothing is known of robot from 10.000 s to 30.000 s"));
  facts.add_stream(kRobot, 2, 1, 40, Domain::kernel);  // tells nothing of applications
  EXPECT_THAT(facts.gaps(), ElementsAre(StartsWith("nothing is known of robot from 10.000 s")));
  facts.model.processes.front().run_end = RunTotals{};
  EXPECT_THAT(facts.gaps(), IsEmpty()) << "it said good-bye";
}

// As of two boots of one machine, or of recordings that have nothing to do with each other.
TEST(HostGaps, AreNoneBeforeARecordingThatBeganLater) {
  Facts facts;
  facts.add_stream(kRobot, 0, 1, 10);
  facts.add_process(kRobot, 1, 10, false);
  facts.add_stream(kDeskHost, 1, 800'000, 800'010);
  facts.add_process(kDeskHost, 800'000, 800'010, true);
  EXPECT_THAT(facts.gaps(), IsEmpty());
}

// Those of its processes that had ended before its last session said good-bye.
TEST(HostGaps, AtTheEndAreOfProcessesOfTheLastSession) {
  Facts facts;
  facts.add_stream(kRobot, 0, 1, 5);
  facts.add_stream(kRobot, 1, 8, 10);
  facts.add_session_gap(kRobot, 5, 8);
  facts.add_stream(kDeskHost, 2, 1, 30);
  facts.add_process(kRobot, 1, 5, false);
  EXPECT_THAT(facts.gaps(), IsEmpty());
  facts.add_process(kRobot, 8, 10, false);
  EXPECT_THAT(facts.gaps(), ElementsAre("nothing is known of robot from 10.000 s to 30.000 s"));
}

}  // namespace
}  // namespace cie::test
