// What every export to a viewer draws from.
#include "timelines/recorded_run.hpp"

#include "output/nesting.hpp"
#include "sample_instances.hpp"

#include <cstdint>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

using testing::ElementsAre;

class Recorder final : public analysis::Observer {
 public:
  explicit Recorder(RecordedRun& run) : run_(run) {}
  void on_instance(const analysis::Instance& instance) override { run_.add(instance); }
  void on_publication(const analysis::Publication& publication) override { run_.add(publication); }

 private:
  RecordedRun& run_;
};

// "time what", an instance by its thread and seq, a publication with the start of its receivers.
std::vector<std::string> replayed(RecordedRun& run, const CommonClock& clock = {}) {
  std::vector<std::string> told;
  std::vector<std::int64_t> starts(64);
  std::vector<std::pair<std::size_t, std::vector<std::uint64_t>>> receivers;
  run.replay(
      {}, clock,
      [&](const RecordedInstance& r) {
        starts.at(r.index) = r.instance.start.ns;
        told.push_back(std::to_string(r.instance.start.ns) + " " + std::to_string(r.instance.tid) +
                       "#" + std::to_string(r.instance.seq) +
                       (r.takes_seen_message ? " from a message" : ""));
      },
      [&](const RecordedPublication& r) {
        receivers.emplace_back(told.size(), std::vector(r.receivers.begin(), r.receivers.end()));
        told.push_back(std::to_string(r.publication.time.ns) + " " + run.topics().name(r.topic));
      });
  for (const auto& [at, of] : receivers) {
    for (const auto index : of)
      told[at] += " to " + std::to_string(starts.at(index));
  }
  return told;
}

TEST(RecordedRun, TellsEverythingInOrderOfTimeWithMessagesJoined) {
  for (const std::size_t in_memory : {1U, 3U, 1000U}) {
    RecordedRun run(in_memory, {});
    Recorder recorder(run);
    test::feed_application(recorder);
    EXPECT_THAT(replayed(run),
                ElementsAre("1100 11#0", "1400 /points to 1500 to 1600", "1500 12#0 from a message",
                            "1600 13#0 from a message", "2100 11#1", "2100 /points to 2600",
                            "2600 12#1 from a message", "3000 14#1", "3100 12#2", "3200 14#2",
                            "3350 12#3", "5000 /points", "6000 11#3"));
    EXPECT_EQ(run.first_time({}), 1'000) << "the first release";
    EXPECT_EQ(run.deliveries(), 3U);
    EXPECT_EQ(run.backward_deliveries(), 1U);
    EXPECT_EQ(run.skipped(), 1U);
  }
}

TEST(RecordedRun, TellsNoReleaseThatWasTakenBack) {
  RecordedRun run(1'000, {});
  auto told = test::instance(test::kTimer, 11, 0, 100, 150, 160);
  told.release_source = analysis::ReleaseSource::timer_grid;
  run.add(told);
  analysis::Report report;
  report.callbacks.emplace_back().index = told.callback;  // has no response time
  run.replay(
      report, {},
      [](const RecordedInstance& r) {
        EXPECT_EQ(r.instance.release, analysis::Timestamp{150});
        EXPECT_EQ(r.instance.release_source, analysis::ReleaseSource::start);
      },
      [](const RecordedPublication&) {});
}

// Which of the publications at 1, 2, 3, … some instance took, by `run`.
std::vector<std::int64_t> taken_publications(RecordedRun& run) {
  std::vector<std::int64_t> taken;
  run.replay(
      {}, {}, [](const RecordedInstance&) {},
      [&](const RecordedPublication& r) {
        if (!r.receivers.empty()) taken.push_back(r.publication.time.ns);
      });
  return taken;
}

TEST(RecordedRun, JoinsMessagesThatWereTakenLongAfterTheyWerePublished) {
  RecordedRun run(1'000, {});
  constexpr std::int64_t kMany = 200'000;  // more than are looked up on the way
  for (std::int64_t k = 1; k <= kMany; ++k)
    run.add(test::publication(k, 11, static_cast<std::uint64_t>(k), k));
  const auto take = [&](std::int64_t message) {
    const auto start = kMany + 10 * message;
    run.add(test::taking(test::instance(test::kTrack, 12, 0, -1, start, start + 5), message));
  };
  take(7);
  take(kMany);
  take(7);
  take(kMany + 1);  // nobody published it
  EXPECT_THAT(taken_publications(run), ElementsAre(7, kMany));
  EXPECT_EQ(run.deliveries(), 3U);
}

TEST(RecordedRun, JoinsMessagesWhosePublicationIsToldLater) {
  RecordedRun run(1, {});
  run.add(test::taking(test::instance(test::kTrack, 12, 0, -1, 500, 600), 1));
  run.add(test::taking(test::instance(test::kTrack, 12, 1, -1, 700, 800), 2));
  run.add(test::publication(400, 11, 0, 1));
  run.add(test::publication(900, 11, 1, 2));  // after it was taken
  EXPECT_THAT(taken_publications(run), ElementsAre(400));
  EXPECT_EQ(run.deliveries(), 1U);
  EXPECT_EQ(run.backward_deliveries(), 1U);
}

TEST(RecordedRun, GivesTheReceiversOfAMessagePublishedTwiceToTheFirst) {
  for (const bool is_told_late : {false, true}) {
    RecordedRun run(1, {});
    const auto take = [&] {
      run.add(test::taking(test::instance(test::kTrack, 12, 0, -1, 500, 600), 1));
    };
    if (!is_told_late) run.add(test::publication(300, 11, 0, 1));
    if (!is_told_late) run.add(test::publication(400, 11, 1, 1));
    take();
    if (is_told_late) run.add(test::publication(300, 11, 0, 1));
    if (is_told_late) run.add(test::publication(400, 11, 1, 1));
    EXPECT_THAT(taken_publications(run), ElementsAre(300));
  }
}

// A host that was booted `later` than the first one, whose clock shows so much less.
analysis::Report two_hosts_booted_apart(std::int64_t later) {
  analysis::Report report;
  report.hosts = {{.name = "desk", .clock_offset_ns = 50'000, .shift = {0}},
                  {.name = "robot", .clock_offset_ns = 50'000 + later, .shift = {later}}};
  return report;
}

// Two messages, there and back, 5 each way by one clock; the robot's shows 1 000 less.
void feed_there_and_back(RecordedRun& run) {
  const auto on_robot = [](auto told) {
    told.host = analysis::HostIndex{1};
    return told;
  };
  run.add(test::publication(2'010, 11, 0, 1));
  run.add(on_robot(test::taking(test::instance(test::kTrack, 12, 0, -1, 1'015, 1'018), 1)));
  run.add(on_robot(test::publication(1'017, 12, 1, 2)));
  run.add(test::taking(test::instance(test::kDrive, 13, 0, -1, 2'022, 2'025), 2));
}

TEST(RecordedRun, ComparesTimesOfTwoHostsByOneClock) {
  for (const std::size_t in_memory : {1U, 1000U}) {
    RecordedRun run(in_memory, {});
    feed_there_and_back(run);
    const CommonClock clock(two_hosts_booted_apart(1'000));
    // Each time is its own host's; the order is that of one clock.
    EXPECT_THAT(replayed(run, clock),
                ElementsAre("2010 /points to 1015", "1015 12#0 from a message",
                            "1017 /points to 2022", "2022 13#0 from a message"));
    EXPECT_EQ(run.deliveries(), 2U);
    EXPECT_EQ(run.backward_deliveries(), 0U);
    EXPECT_EQ(run.first_time(clock), 2'010);
  }
}

TEST(RecordedRun, JoinsLateMessagesOfTwoHostsByOneClock) {
  RecordedRun run(1, {});
  auto take = test::taking(test::instance(test::kTrack, 12, 0, -1, 1'015, 1'018), 1);
  take.host = analysis::HostIndex{1};
  run.add(take);  // its publication is told after it
  run.add(test::publication(2'010, 11, 0, 1));
  replayed(run, CommonClock(two_hosts_booted_apart(1'000)));
  EXPECT_EQ(run.deliveries(), 1U);
  EXPECT_EQ(run.backward_deliveries(), 0U);
}

TEST(CommonClock, IsThatOfTheHostThatHasBeenUpTheLongest) {
  using analysis::HostIndex;
  // The desk's is the clock of the report; the robot was up 300 before it.
  auto report = two_hosts_booted_apart(-300);
  const CommonClock clock(report);
  EXPECT_EQ(clock.of(HostIndex{1}, 100), 100) << "below zero on the desk's clock";
  EXPECT_EQ(clock.of(HostIndex{0}, 100), 100 + 300);
  EXPECT_EQ(clock.of_summary({100}), 100 + 300);
  EXPECT_EQ(clock.realtime_or_own(HostIndex{0}, 100), 100U + 50'000);
  EXPECT_EQ(clock.realtime_or_own(HostIndex{1}, 100), 100U + 50'000 - 300);
  report.hosts[0].clock_offset_ns.reset();
  report.hosts[1].shift = {};  // nothing relates the two
  EXPECT_FALSE(CommonClock(report).is_shifted());
  EXPECT_FALSE(CommonClock(report).realtime_offset());
}

TEST(ThreadTable, KnowsThreadsByNumber) {
  ThreadTable table;
  // Equal but for the host, and tids that fall together.
  using analysis::HostIndex;
  const std::vector<ThreadKey> threads{{HostIndex{0}, 1, 2},
                                       {HostIndex{1}, 1, 2},
                                       {HostIndex{0}, 1, 2 + 1'024},
                                       {HostIndex{0}, -1, -1}};
  for (int round = 0; round < 2; ++round) {
    for (std::uint32_t i = 0; i < threads.size(); ++i)
      EXPECT_EQ(table.number(threads[i]), i);
  }
  EXPECT_EQ(table.all(), threads);
}

TEST(RecordedRun, IsEmptyWithoutAnything) {
  RecordedRun run(1, {});
  EXPECT_TRUE(replayed(run).empty());
  EXPECT_FALSE(run.first_time({}).has_value());
}

TEST(Nesting, KnowsWhatIsAroundAMoment) {
  Nesting<char> nesting;
  EXPECT_TRUE(nesting.enter(10, 50, 'a'));
  EXPECT_TRUE(nesting.enter(20, 30, 'b'));
  EXPECT_EQ(*nesting.around(25), 'b');
  EXPECT_EQ(*nesting.around(30), 'b') << "an end belongs to what ends there";
  EXPECT_FALSE(nesting.enter(40, 60, 'c')) << "it ends after what it began in";
  EXPECT_EQ(*nesting.around(45), 'a');
  EXPECT_EQ(nesting.around(51), nullptr);
  EXPECT_TRUE(nesting.enter(55, {}, 'd')) << "never ends";
  EXPECT_TRUE(nesting.enter(56, {}, 'e'));
  EXPECT_EQ(*nesting.around(1'000'000), 'e');
}

TEST(Nesting, EndsWhatAnotherProcessOfTheSameIdsLeftOpen) {
  Nesting<char> nesting;
  nesting.change_process(analysis::ProcessIndex{1});
  nesting.enter(10, 20, 'a');
  nesting.enter(30, {}, 'b');
  nesting.enter(40, {}, 'c');
  EXPECT_EQ(nesting.change_process(analysis::ProcessIndex{1}), 0U) << "the same one goes on";
  EXPECT_EQ(*nesting.around(50), 'c');
  EXPECT_EQ(nesting.change_process(analysis::ProcessIndex{2}), 2U);
  EXPECT_EQ(nesting.around(50), nullptr);
}

}  // namespace
}  // namespace cie::viewer_export
