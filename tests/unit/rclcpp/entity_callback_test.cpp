// Which announcement a message is taken for.
#include "entity_callback.hpp"

#include <cie/scheduling/clock.hpp>

#include "support/rclcpp/tests/recorded_releases.hpp"

#include <chrono>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <thread>

#include <gtest/gtest.h>
#include <time.h>

namespace cie_rclcpp {
namespace {

using cie::scheduling::GroupState;
using cie::scheduling::monotonic_now;
using test::releases_of;

std::shared_ptr<Admission> open_admission() {
  auto admission = std::make_shared<Admission>();
  admission->open([] { return false; });
  return admission;
}

std::int64_t realtime_now() {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

// A queue in the middleware, by hand: keep-last (depth 0: keep-all), and announced once per message.
struct Queue {
  explicit Queue(std::size_t queue_depth) : depth(queue_depth) {}
  // `ahead`: of the publisher's clock.
  void send(std::int64_t ahead = 0) {
    if (depth > 0 && messages.size() == depth) messages.pop_front();
    const std::int64_t sent = realtime_now() + ahead;
    messages.push_back(sent);
    const std::int64_t before = monotonic_now();
    notice(Inbox::Source::middleware, 1, 0);
    announced[sent] = {before, monotonic_now()};
    std::this_thread::sleep_for(std::chrono::microseconds{1});  // times differ
  }
  std::size_t depth;
  std::deque<std::int64_t> messages{};                                        // when they were sent
  std::map<std::int64_t, std::pair<std::int64_t, std::int64_t>> announced{};  // between these two
  Entity::Notice notice{};
  std::function<void()> before_take = [] {};
  std::optional<std::size_t> came_before{};  // as told to who begins to listen
};

class QueueEntity final : public Entity {
 public:
  explicit QueueEntity(Queue& queue) : queue_(queue) {}
  std::string name() const override { return "/x"; }
  cie::CallbackKind kind() const noexcept override { return cie::CallbackKind::subscription; }
  std::size_t depth() const override { return queue_.depth; }
  void connect(Notice notice) override {
    queue_.notice = std::move(notice);
    if (queue_.came_before) queue_.notice(Inbox::Source::middleware, *queue_.came_before, 0);
  }
  void disconnect() noexcept override {}
  bool run_next(Inbox::Source, int, const Begin& begin) override {
    std::exchange(queue_.before_take, [] {})();
    if (queue_.messages.empty()) return false;
    const std::int64_t sent = queue_.messages.front();
    queue_.messages.pop_front();
    begin(sent, 1);
    return true;
  }

 private:
  Queue& queue_;
};

class EntityCallbackTest : public testing::Test {
 protected:
  explicit EntityCallbackTest(std::size_t depth = 3) : queue_(depth) { test::forget_releases(); }
  void send(int count, std::int64_t ahead = 0) {
    for (int i = 0; i < count; ++i)
      queue_.send(ahead);
  }
  void run(int count) {
    for (int i = 0; i < count; ++i)
      EXPECT_TRUE(callback_.execute_one()) << i;
  }
  // By the announcement of its message.
  void expect_own_release(std::size_t instance) {
    const auto all = releases_of(callback_.id());
    ASSERT_LT(instance, all.size());
    const auto& [before, after] = queue_.announced.at(all[instance].source_timestamp_realtime_ns);
    EXPECT_GE(all[instance].release_ns, before) << instance;
    EXPECT_LE(all[instance].release_ns, after) << instance;
  }
  std::int64_t release(std::size_t instance) {
    return releases_of(callback_.id()).at(instance).release_ns;
  }

  Queue queue_;
  EntityCallback callback_{
      std::make_shared<GroupState>(cie::kNoNode, cie::GroupType::mutually_exclusive),
      {.kind = cie::CallbackKind::subscription,
       .logical_id = cie::trace::unique_logical_id("/t@Subscription(/x)")},
      std::make_unique<QueueEntity>(queue_),
      open_admission(),
      [] {}};
};

TEST_F(EntityCallbackTest, RunsOnceForEachMessage) {
  EXPECT_FALSE(callback_.execute_one());
  queue_.send();
  queue_.send();
  EXPECT_EQ(callback_.queued(), 2U);
  EXPECT_TRUE(callback_.execute_one());
  EXPECT_TRUE(callback_.execute_one());
  EXPECT_FALSE(callback_.execute_one());
  const auto all = releases_of(callback_.id());
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].kind, cie::ReleaseKind::data);
  EXPECT_GT(all[0].release_ns, 0);
  EXPECT_GT(all[1].release_ns, all[0].release_ns);
  expect_own_release(0);
  expect_own_release(1);
}

// The announcement is there, its message is not (somebody else took it): no instance.
TEST_F(EntityCallbackTest, DoesNotRunWithoutAMessage) {
  queue_.send();
  queue_.messages.clear();
  EXPECT_FALSE(callback_.execute_one());
  EXPECT_TRUE(releases_of(callback_.id()).empty());
}

// A full queue that is written to between the announcement's taking and the message's: each of the
// three that are left is taken for the announcement of the one before it.
TEST_F(EntityCallbackTest, KnowsNoReleaseAfterAMessageThatWasOverwritten) {
  send(3);
  queue_.before_take = [this] { send(1); };
  run(3);
  EXPECT_FALSE(callback_.execute_one());
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_EQ(release(i), -1) << i;
  send(1);
  run(1);
  expect_own_release(3);
}

// It was not full when its announcement was taken, and was when the message was.
TEST_F(EntityCallbackTest, KnowsNoneAlsoWhereTheQueueFilledMeanwhile) {
  send(1);
  queue_.before_take = [this] { send(4); };
  run(3);
  EXPECT_FALSE(callback_.execute_one());
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_EQ(release(i), -1) << i;
}

// With one message more the announcements overflow, too, and the one that was left over is dropped.
TEST_F(EntityCallbackTest, KnowsThemAgainOnceTheQueueOverflows) {
  send(3);
  queue_.before_take = [this] { send(1); };
  run(1);
  EXPECT_EQ(release(0), -1);
  send(1);
  run(3);
  EXPECT_FALSE(callback_.execute_one());
  for (std::size_t i = 1; i < 4; ++i)
    expect_own_release(i);
}

constexpr std::int64_t kAhead = 3'600'000'000'000;  // of a publisher's clock; no test takes so long

// Each looks later than its announcement, and is its own: the queue is never full.
TEST_F(EntityCallbackTest, TakesNoClockThatIsAheadForALaterMessage) {
  for (std::size_t i = 0; i < 6; i += 2) {
    send(2, kAhead);
    run(2);
    expect_own_release(i);
    expect_own_release(i + 1);
  }
}

// The first messages of such a clock find a full queue: no announcement is taken for another's, and
// none is left over.
TEST_F(EntityCallbackTest, KeepsTheAnnouncementsOfAClockThatIsAheadInAFullQueue) {
  send(3, kAhead);
  run(3);
  EXPECT_TRUE(queue_.messages.empty());
  EXPECT_EQ(callback_.queued(), 0U);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_EQ(release(i), -1) << i;
  for (std::size_t i = 3; i < 6; ++i) {
    send(1, kAhead);
    run(1);
    expect_own_release(i);
  }
}

// The middleware announces the end of the last writer, too. What was sent later is then taken for it.
TEST_F(EntityCallbackTest, TakesNoAnnouncementWithoutAMessageForThatOfALaterOne) {
  queue_.notice(Inbox::Source::middleware, 1, 0);
  send(1);
  run(1);
  EXPECT_EQ(release(0), -1);
  queue_.notice(Inbox::Source::middleware, 1, 0);
  EXPECT_FALSE(callback_.execute_one()) << "two announcements, and nothing came";
  send(1);
  run(1);
  expect_own_release(1);
}

// As long as one is left over, each is taken for the announcement of the one before it.
TEST_F(EntityCallbackTest, KnowsThemAgainOnceNoAnnouncementIsLeftOver) {
  queue_.notice(Inbox::Source::middleware, 1, 0);
  send(1);
  run(1);
  send(1);
  run(1);
  EXPECT_EQ(callback_.queued(), 1U);
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_EQ(release(i), -1) << i;
  EXPECT_FALSE(callback_.execute_one());
  send(1);
  run(1);
  expect_own_release(2);
}

class KeepAllTest : public testing::Test {
 protected:
  KeepAllTest() { test::forget_releases(); }
  Queue queue_{0};
};

// rmw_cyclonedds says of a queue that keeps all that 0 messages came before.
TEST_F(KeepAllTest, RunsWhatCameBeforeAndWasNotCounted) {
  for (int i = 0; i < 3; ++i)
    queue_.messages.push_back(realtime_now());
  queue_.came_before = 0;
  EntityCallback callback{
      std::make_shared<GroupState>(cie::kNoNode, cie::GroupType::mutually_exclusive),
      {.kind = cie::CallbackKind::subscription,
       .logical_id = cie::trace::unique_logical_id("/t@Subscription(/all)")},
      std::make_unique<QueueEntity>(queue_),
      open_admission(),
      [] {}};
  for (int i = 0; i < 3; ++i)
    EXPECT_TRUE(callback.execute_one()) << i;
  EXPECT_FALSE(callback.execute_one());
  queue_.send();
  EXPECT_TRUE(callback.execute_one());
  const auto all = releases_of(callback.id());
  ASSERT_EQ(all.size(), 4U);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_EQ(all[i].release_ns, -1) << i;
  const auto& [before, after] = queue_.announced.at(all[3].source_timestamp_realtime_ns);
  EXPECT_GE(all[3].release_ns, before);
  EXPECT_LE(all[3].release_ns, after);
}

class KeepLastOneTest : public EntityCallbackTest {
 protected:
  KeepLastOneTest() : EntityCallbackTest(1) {}
};

// It is always full.
TEST_F(KeepLastOneTest, KnowsNoReleaseOfAClockThatIsAhead) {
  for (std::size_t i = 0; i < 2; ++i) {
    send(1, kAhead);
    run(1);
    EXPECT_EQ(release(i), -1) << i;
  }
  send(1);
  run(1);
  expect_own_release(2);
}

TEST_F(EntityCallbackTest, TellsWhenItsEntityForgetsIt) {
  int told = 0;
  {
    Entity::Notice kept;
    kept = [gone = farewell([&told] { ++told; })](Inbox::Source, std::size_t, int) {};
    const Entity::Notice copy = kept;
    kept = nullptr;
    EXPECT_EQ(told, 0);
  }
  EXPECT_EQ(told, 1);
}

}  // namespace
}  // namespace cie_rclcpp
