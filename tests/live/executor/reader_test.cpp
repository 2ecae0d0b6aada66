// A reader's queue: what is taken, what was pushed out, and when each sample arrived.
#include "reader.hpp"

#include "clock.hpp"
#include "context_state.hpp"
#include "support.hpp"

#include <cstdint>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

namespace cie::executor {
namespace {

using cie_msgs::Keyed;
using cie_msgs::Sample;

class ReaderTest : public testing::Test {
 protected:
  template <typename T>
  Reader make(const QoS& qos) {
    return Reader{context.state(), message_topic("/data"), qos, MessageTraits<T>::descriptor()};
  }
  Context context{test::private_options()};
  Node node{context, "node"};
};

TEST_F(ReaderTest, CountsWhatAFullQueuePushedOut) {
  Reader reader = make<Sample>(QoS{KeepLast{2}});
  const auto publisher = node.create_publisher<Sample>("/data", QoS{KeepLast{2}});
  const auto message = make_message<Sample>();
  for (int i = 0; i < 5; ++i) {
    ++message->seq;
    publisher->publish(*message);
  }
  EXPECT_EQ(reader.delivery().count().overwritten(), 3U);
  MessageInfo info;
  ASSERT_TRUE(reader.take(message.get(), info));
  EXPECT_EQ(message->seq, 4U);
  ASSERT_TRUE(reader.take(message.get(), info));
  EXPECT_EQ(message->seq, 5U);
  EXPECT_FALSE(reader.take(message.get(), info));
  EXPECT_EQ(reader.delivery().count().overwritten(), 3U);
}

TEST_F(ReaderTest, KnowsTheArrivalOfEachSampleInTheQueue) {
  Reader reader = make<Sample>(QoS{KeepAll{}});
  const auto publisher = node.create_publisher<Sample>("/data", QoS{KeepAll{}});
  const auto message = make_message<Sample>();
  std::vector<std::int64_t> before;
  for (int i = 0; i < 50; ++i) {
    before.push_back(monotonic_now());
    publisher->publish(*message);
  }
  before.push_back(monotonic_now());
  MessageInfo info;
  for (std::size_t i = 0; i < 50; ++i) {
    ASSERT_TRUE(reader.take(message.get(), info));
    EXPECT_GE(info.arrival_ns, before[i]);
    EXPECT_LE(info.arrival_ns, before[i + 1]);
  }
}

TEST_F(ReaderTest, TakesNothingInOnceItIsClosed) {
  Reader reader = make<Sample>(QoS{KeepLast{3}});
  const auto publisher = node.create_publisher<Sample>("/data", QoS{KeepLast{3}});
  const auto message = make_message<Sample>();
  MessageInfo info;
  for (int i = 0; i < 5; ++i)
    publisher->publish(*message);  // two are pushed out
  ASSERT_TRUE(reader.take(message.get(), info));
  for (int i = 0; i < 2; ++i)
    publisher->publish(*message);  // one more
  EXPECT_EQ(reader.close(), 3U);
  publisher->publish(*message);
  EXPECT_FALSE(reader.take(message.get(), info));
  EXPECT_EQ(reader.close(), 3U);
}

TEST_F(ReaderTest, OfAKeyedTopicKnowsAtItsEndWhatWasPushedOut) {
  Reader reader = make<Keyed>(QoS{KeepLast{1}});
  const auto publisher = node.create_publisher<Keyed>("/data", QoS{KeepLast{1}});
  for (std::uint64_t i = 0; i < 4; ++i)
    publisher->publish({.id = 7, .seq = i});
  EXPECT_EQ(reader.delivery().count().overwritten(), 0U);  // a depth for each key tells nothing yet
  EXPECT_EQ(reader.close(), 3U);
}

// The depth holds for each key's value: nothing is pushed out here.
TEST_F(ReaderTest, OfAKeyedTopicIsCountedWhenItIsEmpty) {
  Reader reader = make<Keyed>(QoS{KeepLast{1}});
  const auto publisher = node.create_publisher<Keyed>("/data", QoS{KeepLast{1}});
  for (std::uint32_t id = 0; id < 3; ++id)
    publisher->publish({.id = id, .seq = 1});
  publisher->publish({.id = 0, .seq = 2});  // pushes out the first
  Keyed message{};
  MessageInfo info;
  int taken = 0;
  while (reader.take(&message, info))
    ++taken;
  EXPECT_EQ(taken, 3);
  EXPECT_EQ(reader.delivery().count().overwritten(), 1U);
}

// The end of a writer arrives as a notice without data; it is no message.
TEST_F(ReaderTest, TakesNoNoticeForAMessage) {
  Reader reader = make<Sample>(QoS{KeepLast{2}});
  auto publisher = node.create_publisher<Sample>("/data", QoS{KeepLast{2}});
  const auto message = make_message<Sample>();
  publisher->publish(*message);
  MessageInfo info;
  ASSERT_TRUE(reader.take(message.get(), info));
  publisher.reset();
  EXPECT_FALSE(reader.take(message.get(), info));
  EXPECT_EQ(reader.delivery().count().overwritten(), 0U);
}

TEST_F(ReaderTest, SeesEachWriterUnderItsOwnNumber) {
  Reader reader = make<Sample>(QoS{KeepLast{2}});
  const auto first = node.create_publisher<Sample>("/data", QoS{KeepLast{2}});
  const auto second = node.create_publisher<Sample>("/data", QoS{KeepLast{2}});
  EXPECT_NE(first->writer_gid(), second->writer_gid());
  const auto message = make_message<Sample>();
  MessageInfo info;
  for (const auto& publisher : {first, second}) {
    publisher->publish(*message);
    ASSERT_TRUE(reader.take(message.get(), info));
    EXPECT_EQ(info.writer_gid, publisher->writer_gid());
  }
}

}  // namespace
}  // namespace cie::executor
