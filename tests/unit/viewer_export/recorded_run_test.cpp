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
std::vector<std::string> replayed(RecordedRun& run) {
  std::vector<std::string> told;
  std::vector<std::int64_t> starts(64);
  std::vector<std::pair<std::size_t, std::vector<std::uint64_t>>> receivers;
  run.replay(
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
    EXPECT_EQ(run.first_time(), 1'000) << "the first release";
    EXPECT_EQ(run.deliveries(), 3U);
    EXPECT_EQ(run.backward_deliveries(), 1U);
    EXPECT_EQ(run.skipped(), 1U);
  }
}

// Which of the publications at 1, 2, 3, … some instance took, by `run`.
std::vector<std::int64_t> taken_publications(RecordedRun& run) {
  std::vector<std::int64_t> taken;
  run.replay([](const RecordedInstance&) {},
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
  EXPECT_FALSE(run.first_time().has_value());
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

}  // namespace
}  // namespace cie::viewer_export
