// What one callback does wrong stays with it: it throws, never ends, or acts as it is destroyed.
#include "executors.hpp"
#include "support.hpp"

#include <atomic>
#include <memory>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

using cie_msgs::Sample;

// Executors that serve others while one callback does not end: a thread is left.
auto executors_with_a_thread_left() {
  return testing::Values("isolated", "multi", "isolated-waitset", "multi-waitset");
}

class Throwing : public testing::TestWithParam<Kind> {};
INSTANTIATE_TEST_SUITE_P(Executors, Throwing, every_executor(), name_of);

// Each message is one instance of each subscription, whatever the other one does.
TEST_P(Throwing, CostsTheOthersNoInstance) {
  constexpr int kMessages = 200;
  Context context{private_options()};
  std::atomic<int> failures{0};
  ExecutorOptions options;
  options.on_exception = [&](const CallbackFailure&) { ++failures; };
  const auto executor = make(GetParam(), options);
  Node node{context, "node"};
  std::atomic<int> runs{0};
  const auto throwing = node.create_subscription<Sample>(
      "data", QoS{KeepAll{}}, [](const Sample&) { throw std::runtime_error{"no more fuel"}; });
  const auto sound =
      node.create_subscription<Sample>("data", QoS{KeepAll{}}, [&](const Sample&) { ++runs; });
  const auto publisher = node.create_publisher<Sample>("data", QoS{KeepAll{}});
  executor->add_node(node);
  Spinning spinning{*executor};
  const auto message = make_message<Sample>();
  for (int i = 0; i < kMessages; ++i)
    publisher->publish(*message);
  EXPECT_TRUE(eventually([&] { return runs >= kMessages && failures >= kMessages; }));
  spinning.cancel_and_wait();
  EXPECT_EQ(runs, kMessages);
  EXPECT_EQ(failures, kMessages);
}

class Blocking : public testing::TestWithParam<Kind> {};
INSTANTIATE_TEST_SUITE_P(Executors, Blocking, executors_with_a_thread_left(), name_of);

// Whoever may end only when the test lets it.
class Gate {
 public:
  void wait() {
    is_entered_ = true;
    while (!is_open_)
      std::this_thread::sleep_for(1ms);
  }
  void open() { is_open_ = true; }
  bool is_entered() const { return is_entered_; }

 private:
  std::atomic<bool> is_open_{false};
  std::atomic<bool> is_entered_{false};
};

TEST_P(Blocking, HoldsUpNobodyElse) {
  constexpr int kMessages = 200;
  Context context{private_options()};
  const auto executor = make(GetParam());
  Node node{context, "node"};
  Gate gate;
  std::atomic<int> runs{0};
  std::atomic<int> timer_runs{0};
  const auto timer = node.create_one_shot_timer(1us, [&] { gate.wait(); });
  const auto second_timer = node.create_wall_timer(1ms, [&] { ++timer_runs; });
  const auto subscription =
      node.create_subscription<Sample>("data", QoS{KeepAll{}}, [&](const Sample&) { ++runs; });
  const auto publisher = node.create_publisher<Sample>("data", QoS{KeepAll{}});
  executor->add_node(node);
  Spinning spinning{*executor};
  ASSERT_TRUE(eventually([&] { return gate.is_entered(); }));
  const auto message = make_message<Sample>();
  for (int i = 0; i < kMessages; ++i)
    publisher->publish(*message);
  EXPECT_TRUE(eventually([&] { return runs == kMessages && timer_runs > 20; }));
  // Nodes come and go as before.
  {
    Node other{context, "other"};
    std::atomic<int> other_runs{0};
    const auto third_timer = other.create_wall_timer(1ms, [&] { ++other_runs; });
    executor->add_node(other);
    EXPECT_TRUE(eventually([&] { return other_runs > 2; }));
  }
  gate.open();
  spinning.cancel_and_wait();
}

// A callback cannot be ended from outside: it is waited for, and the others run no more meanwhile.
TEST_P(Blocking, IsWaitedForByCancelAndByNobodyElse) {
  Context context{private_options()};
  const auto executor = make(GetParam());
  Node node{context, "node"};
  Gate gate;
  std::atomic<int> runs{0};
  const auto timer = node.create_one_shot_timer(1us, [&] { gate.wait(); });
  const auto second_timer = node.create_wall_timer(1ms, [&] { ++runs; });
  executor->add_node(node);
  Spinning spinning{*executor};
  ASSERT_TRUE(eventually([&] { return gate.is_entered() && runs > 2; }));
  executor->cancel();
  int before = -1;
  EXPECT_TRUE(eventually([&] {  // until they stand still
    const int now = runs;
    std::this_thread::sleep_for(20ms);
    return std::exchange(before, now) == now;
  }));
  EXPECT_FALSE(spinning.is_done());
  gate.open();
  spinning.wait();
}

// A callback's function whose end is a message.
class PublishesAtItsEnd {
 public:
  PublishesAtItsEnd(std::shared_ptr<Publisher<Sample>> publisher, std::atomic<int>& ends)
      : last_(new Last{std::move(publisher), ends}) {}
  void operator()() const {}
  void operator()(const Sample&) const {}

 private:
  struct Last {
    Last(std::shared_ptr<Publisher<Sample>> to, std::atomic<int>& count)
        : publisher(std::move(to)), ends(count) {}
    Last(const Last&) = delete;
    Last& operator=(const Last&) = delete;
    ~Last() {
      ++ends;
      publisher->publish(*make_message<Sample>());
    }
    std::shared_ptr<Publisher<Sample>> publisher;
    std::atomic<int>& ends;
  };
  std::shared_ptr<Last> last_;  // functions are copied
};

class Dying : public testing::TestWithParam<Kind> {};
INSTANTIATE_TEST_SUITE_P(Executors, Dying, every_executor(), name_of);

// It is destroyed once, after it went out of service, when nothing of the executor is locked:
// others get what it publishes, and it does not get its own.
TEST_P(Dying, MayPublishFromItsDestructor) {
  constexpr int kRounds = 20;
  constexpr int kEach = 3;
  Context context{private_options()};
  const auto executor = make(GetParam());
  Node stays{context, "stays"};
  std::atomic<int> received{0};
  const auto subscription = stays.create_subscription<Sample>("last_words", QoS{KeepAll{}},
                                                              [&](const Sample&) { ++received; });
  executor->add_node(stays);
  std::atomic<int> ends{0};
  {
    Spinning spinning{*executor};
    for (int round = 0; round < kRounds; ++round) {
      Node goes{context, "goes"};
      const auto publisher = goes.create_publisher<Sample>("last_words", QoS{KeepAll{}});
      const auto timer = goes.create_wall_timer(1ms, PublishesAtItsEnd{publisher, ends});
      const auto guard_condition =
          goes.create_guard_condition("go", PublishesAtItsEnd{publisher, ends});
      executor->add_node(goes);
      // The subscription is to what it publishes itself.
      const auto second_subscription = goes.create_subscription<Sample>(
          "last_words", QoS{KeepAll{}}, PublishesAtItsEnd{publisher, ends});
      if (round % 2 == 0) executor->remove_node(goes);
    }
    EXPECT_TRUE(eventually([&] { return received == kEach * kRounds; }));
    spinning.cancel_and_wait();
  }
  EXPECT_EQ(ends, kEach * kRounds);
  EXPECT_EQ(received, kEach * kRounds);
}

}  // namespace
}  // namespace cie::test
