// Messages arrive: counted, in order, with the facts that come with them.
#include "executors.hpp"
#include "support.hpp"

#include <atomic>
#include <cstring>
#include <fstream>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using cie_msgs::Keyed;
using cie_msgs::Sample;
using cie_msgs::String;

constexpr std::uint32_t kCount = 200;

class Messages : public testing::TestWithParam<Kind> {};

INSTANTIATE_TEST_SUITE_P(Executors, Messages, every_executor(), name_of);

TEST_P(Messages, ArriveAllOnceAndInOrder) {
  Context context{private_options()};
  Node node{context, "node"};
  std::vector<std::uint64_t> seen;
  std::atomic<std::uint32_t> count{0};
  const auto subscription =
      node.create_subscription<Sample>("data", QoS{KeepAll{}}, [&](const Sample& sample) {
        seen.push_back(sample.seq);
        ++count;
      });
  const auto publisher = node.create_publisher<Sample>("data", QoS{KeepAll{}});
  const auto executor = test::make(GetParam());
  executor->add_node(node);
  Spinning spinning{*executor};
  const auto message = make_message<Sample>();
  for (std::uint32_t i = 0; i < kCount; ++i) {
    message->seq = i;
    publisher->publish(*message);
  }
  EXPECT_TRUE(eventually([&] { return count == kCount; }));
  spinning.cancel_and_wait();
  std::vector<std::uint64_t> expected(kCount);
  for (std::uint32_t i = 0; i < kCount; ++i)
    expected[i] = i;
  EXPECT_EQ(seen, expected);
}

TEST_P(Messages, CarryContentsAndFacts) {
  Context context{private_options()};
  Node node{context, "node"};
  std::promise<void> arrived;
  std::shared_ptr<const Sample> kept;
  MessageInfo facts;
  std::chrono::nanoseconds called{};
  const auto subscription = node.create_subscription<Sample>(
      "data", 10, [&](std::shared_ptr<const Sample> sample, const MessageInfo& info) {
        called = std::chrono::steady_clock::now().time_since_epoch();
        kept = std::move(sample);
        facts = info;
        arrived.set_value();
      });
  const auto publisher = node.create_publisher<Sample>("data", 10);
  const auto executor = test::make(GetParam());
  executor->add_node(node);
  Spinning spinning{*executor};
  const auto message = make_message<Sample>();
  set_text(message->frame_id, "lidar");
  resize(message->payload, 3);
  message->payload._buffer[2] = 7;
  const auto before = std::chrono::steady_clock::now().time_since_epoch();
  publisher->publish(*message);
  arrived.get_future().wait();
  spinning.cancel_and_wait();

  EXPECT_STREQ(kept->frame_id, "lidar");
  ASSERT_EQ(kept->payload._length, 3U);
  EXPECT_EQ(kept->payload._buffer[2], 7);
  EXPECT_GE(facts.arrival_ns, std::chrono::nanoseconds{before}.count());
  EXPECT_LE(facts.arrival_ns, called.count());
  EXPECT_EQ(facts.writer_gid, publisher->writer_gid());
  EXPECT_NE(facts.source_timestamp_realtime_ns, 0);
}

TEST(MessageMemory, IsReusedUnlessTheUserKeepsIt) {
  Context context{private_options()};
  Node node{context, "node"};
  std::vector<std::shared_ptr<const Sample>> kept;
  std::atomic<int> count{0};
  const auto subscription = node.create_subscription<Sample>(
      "data", QoS{KeepAll{}}, [&](std::shared_ptr<const Sample> sample) {
        kept.push_back(std::move(sample));
        ++count;
      });
  const auto publisher = node.create_publisher<Sample>("data", QoS{KeepAll{}});
  CallbackIsolatedExecutor executor;
  executor.add_node(node);
  Spinning spinning{executor};
  const auto message = make_message<Sample>();
  for (std::uint64_t i = 0; i < 5; ++i) {
    message->seq = i;
    publisher->publish(*message);
  }
  ASSERT_TRUE(eventually([&] { return count == 5; }));
  spinning.cancel_and_wait();
  for (std::uint64_t i = 0; i < 5; ++i)
    EXPECT_EQ(kept[i]->seq, i);
}

TEST(Topics, OfStringsAndKeysWorkToo) {
  Context context{private_options()};
  Node node{context, "node", "/robot"};
  std::atomic<int> count{0};
  std::string text;
  const auto strings = node.create_subscription<String>("/said", 1, [&](const String& message) {
    text = message.data;
    ++count;
  });
  const auto keyed = node.create_subscription<Keyed>("~/keyed", 1, [&](const Keyed&) { ++count; });
  const auto strings_out = node.create_publisher<String>("/said", 1);
  const auto keyed_out = node.create_publisher<Keyed>("/robot/node/keyed", 1);
  EXPECT_EQ(keyed->logical_id(), "/robot/node@Subscription(/robot/node/keyed)");
  CallbackIsolatedExecutor executor;
  executor.add_node(node);
  Spinning spinning{executor};
  const auto message = make_message<String>();
  set_text(message->data, "hello");
  strings_out->publish(*message);
  keyed_out->publish({.id = 1, .seq = 2});
  EXPECT_TRUE(eventually([&] { return count == 2; }));
  spinning.cancel_and_wait();
  EXPECT_EQ(text, "hello");
}

// How often the thread that collects Cyclone's garbage went to sleep.
std::uint64_t sleeps_of_collector() {
  for (const auto& thread : threads_now()) {
    if (thread.name != "gc") continue;
    std::ifstream status{"/proc/self/task/" + std::to_string(thread.tid) + "/status"};
    for (std::string word; status >> word;) {
      std::uint64_t count = 0;
      if (word == "voluntary_ctxt_switches:" && status >> count) return count;
    }
  }
  ADD_FAILURE() << "there is no thread called gc";
  return 0;
}

// It would wake up for every message if nobody held the instance of a topic without keys: three
// system calls each. (A subscription of the process holds it, so there is none here.)
TEST(BestEffort, LeavesTheCollectorAsleep) {
  Context context{private_options()};
  Node node{context, "node"};
  const auto publisher = node.create_publisher<Sample>("data", SensorDataQoS{});
  const auto publish_some = [&] {
    for (std::uint32_t i = 0; i < kCount; ++i) {
      publisher->publish(make_message<Sample>());
      publisher->publish(*make_message<Sample>());
      std::this_thread::sleep_for(500us);  // for the collector to have gone to sleep again
    }
  };
  publish_some();
  const std::uint64_t before = sleeps_of_collector();
  publish_some();
  EXPECT_LT(sleeps_of_collector() - before, kCount / 4);
}

TEST(TransientLocal, GivesALateSubscriptionItsOwnArrivalTime) {
  Context context{private_options()};
  Node node{context, "node"};
  const auto publisher = node.create_publisher<Sample>("map", QoS{KeepLast{1}}.transient_local());
  const auto message = make_message<Sample>();
  publisher->publish(*message);
  const auto created = std::chrono::steady_clock::now().time_since_epoch();
  std::promise<std::int64_t> arrival;
  const auto subscription = node.create_subscription<Sample>(
      "map", QoS{KeepLast{1}}.transient_local(),
      [&](const Sample&, const MessageInfo& info) { arrival.set_value(info.arrival_ns); });
  CallbackIsolatedExecutor executor;
  executor.add_node(node);
  Spinning spinning{executor};
  EXPECT_GE(arrival.get_future().get(), std::chrono::nanoseconds{created}.count());
  spinning.cancel_and_wait();
}

}  // namespace
}  // namespace cie::test
