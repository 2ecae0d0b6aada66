// A reader's queue: what is taken, what was pushed out, and when each sample arrived.
#include "dds/reader.hpp"

#include <cie/scheduling/clock.hpp>

#include "dds/context_state.hpp"
#include "dds/dds_qos.hpp"
#include "dds/message_pool.hpp"
#include "dds/serdata_ptr.hpp"
#include "dds/topic.hpp"
#include "support.hpp"

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace cie::executor {
namespace {

using cie_msgs::Keyed;
using cie_msgs::Sample;
using cie_msgs::String;

// How a message comes into the queue: as bytes of a copy, as a pointer, or with Cyclone's own
// serialisation, which is also that of types with keys.
enum class Way { copied, handed_over, serialized };

Context::Options options_for(Way way) {
  auto options = test::private_options();
  options.pass_pointers = way != Way::serialized;
  return options;
}

class ReaderTest : public testing::TestWithParam<Way> {
 protected:
  template <typename T>
  Reader make(const QoS& qos) {
    return Reader{context.state(), message_topic("/data"), qos, MessageTraits<T>::descriptor()};
  }
  void publish(Publisher<Sample>& publisher, std::uint64_t seq) const {
    auto message = make_message<Sample>();
    message->seq = seq;
    if (GetParam() == Way::copied) {
      publisher.publish(*message);
    } else {
      publisher.publish(std::move(message));
    }
  }
  Context context{options_for(GetParam())};
  Node node{context, "node"};
};

INSTANTIATE_TEST_SUITE_P(Ways, ReaderTest,
                         testing::Values(Way::copied, Way::handed_over, Way::serialized),
                         [](const testing::TestParamInfo<Way>& way) {
                           return way.param == Way::copied        ? "Copied"
                                  : way.param == Way::handed_over ? "HandedOver"
                                                                  : "Serialized";
                         });

// Null when the queue is empty.
template <typename T>
std::shared_ptr<const T> take(Reader& reader, MessageInfo& info) {
  MessagePool pool{reader.layout()};
  MessagePool::Loan message{pool};
  if (!reader.take(message, info)) return nullptr;
  return std::static_pointer_cast<const T>(message.handle());
}
template <typename T>
std::shared_ptr<const T> take(Reader& reader) {
  MessageInfo info;
  return take<T>(reader, info);
}

TEST_P(ReaderTest, CountsWhatAFullQueuePushedOut) {
  Reader reader = make<Sample>(QoS{KeepLast{2}});
  const auto publisher = node.create_publisher<Sample>("/data", QoS{KeepLast{2}});
  for (std::uint64_t seq = 1; seq <= 5; ++seq)
    publish(*publisher, seq);
  EXPECT_EQ(reader.delivery().count().overwritten(), 3U);
  for (std::uint64_t seq = 4; seq <= 5; ++seq) {
    const auto message = take<Sample>(reader);
    ASSERT_NE(message, nullptr);
    EXPECT_EQ(message->seq, seq);
  }
  EXPECT_EQ(take<Sample>(reader), nullptr);
  EXPECT_EQ(reader.delivery().count().overwritten(), 3U);
}

TEST_P(ReaderTest, KnowsTheArrivalOfEachSampleInTheQueue) {
  Reader reader = make<Sample>(QoS{KeepAll{}});
  const auto publisher = node.create_publisher<Sample>("/data", QoS{KeepAll{}});
  std::vector<std::int64_t> before;
  for (std::uint64_t i = 0; i < 50; ++i) {
    before.push_back(monotonic_now());
    publish(*publisher, i);
  }
  before.push_back(monotonic_now());
  MessageInfo info;
  for (std::size_t i = 0; i < 50; ++i) {
    ASSERT_NE(take<Sample>(reader, info), nullptr);
    EXPECT_GE(info.arrival_ns, before[i]);
    EXPECT_LE(info.arrival_ns, before[i + 1]);
  }
}

// What is freed and what is allocated next often have one address.
TEST_P(ReaderTest, KnowsTheArrivalOfASampleWhereAnotherOneWas) {
  Reader reader = make<Sample>(QoS{KeepLast{1}});
  const auto publisher = node.create_publisher<Sample>("/data", QoS{KeepLast{1}});
  MessageInfo info;
  for (std::uint64_t i = 0; i < 500; ++i) {
    publish(*publisher, 2 * i);  // pushed out, and freed
    const std::int64_t before = monotonic_now();
    publish(*publisher, 2 * i + 1);
    const auto message = take<Sample>(reader, info);
    ASSERT_NE(message, nullptr);
    ASSERT_EQ(message->seq, 2 * i + 1);
    ASSERT_GE(info.arrival_ns, before);
  }
}

TEST_P(ReaderTest, TakesNothingInOnceItIsClosed) {
  Reader reader = make<Sample>(QoS{KeepLast{3}});
  const auto publisher = node.create_publisher<Sample>("/data", QoS{KeepLast{3}});
  for (std::uint64_t i = 0; i < 5; ++i)
    publish(*publisher, i);  // two are pushed out
  ASSERT_NE(take<Sample>(reader), nullptr);
  for (std::uint64_t i = 0; i < 2; ++i)
    publish(*publisher, i);  // one more
  EXPECT_EQ(reader.close(), 3U);
  publish(*publisher, 9);
  EXPECT_EQ(take<Sample>(reader), nullptr);
  EXPECT_EQ(reader.close(), 3U);
}

TEST_P(ReaderTest, OfAKeyedTopicKnowsAtItsEndWhatWasPushedOut) {
  Reader reader = make<Keyed>(QoS{KeepLast{1}});
  const auto publisher = node.create_publisher<Keyed>("/data", QoS{KeepLast{1}});
  for (std::uint64_t i = 0; i < 4; ++i)
    publisher->publish({.id = 7, .seq = i});
  EXPECT_EQ(reader.delivery().count().overwritten(), 0U);  // a depth for each key tells nothing yet
  EXPECT_EQ(reader.close(), 3U);
}

// The depth holds for each key's value: nothing is pushed out here.
TEST_P(ReaderTest, OfAKeyedTopicIsCountedWhenItIsEmpty) {
  Reader reader = make<Keyed>(QoS{KeepLast{1}});
  const auto publisher = node.create_publisher<Keyed>("/data", QoS{KeepLast{1}});
  for (std::uint32_t id = 0; id < 3; ++id)
    publisher->publish({.id = id, .seq = 1});
  publisher->publish(std::make_shared<const Keyed>(Keyed{.id = 0, .seq = 2}));  // pushes one out
  int taken = 0;
  while (take<Keyed>(reader) != nullptr)
    ++taken;
  EXPECT_EQ(taken, 3);
  EXPECT_EQ(reader.delivery().count().overwritten(), 1U);
}

TEST_P(ReaderTest, CountsWhatItsLifespanEndedAsOverwritten) {
  Reader reader = make<Sample>(QoS{KeepLast{5}});
  const auto passing = node.create_publisher<Sample>(
      "/data", QoS{KeepLast{5}}.lifespan(std::chrono::milliseconds{1}));
  const auto lasting = node.create_publisher<Sample>("/data", QoS{KeepLast{5}});
  publish(*passing, 1);
  publish(*lasting, 2);
  publish(*passing, 3);
  std::this_thread::sleep_for(std::chrono::milliseconds{50});
  const auto message = take<Sample>(reader);
  ASSERT_NE(message, nullptr);
  EXPECT_EQ(message->seq, 2U);
  EXPECT_EQ(take<Sample>(reader), nullptr);
  EXPECT_EQ(reader.delivery().count().overwritten(), 2U);
}

// The end of a writer arrives as a notice without data; it is no message.
TEST_P(ReaderTest, TakesNoNoticeForAMessage) {
  Reader reader = make<Sample>(QoS{KeepLast{2}});
  auto publisher = node.create_publisher<Sample>("/data", QoS{KeepLast{2}});
  publish(*publisher, 1);
  ASSERT_NE(take<Sample>(reader), nullptr);
  publisher.reset();
  EXPECT_EQ(take<Sample>(reader), nullptr);
  EXPECT_EQ(reader.delivery().count().overwritten(), 0U);
}

TEST_P(ReaderTest, SeesEachWriterUnderItsOwnNumber) {
  Reader reader = make<Sample>(QoS{KeepLast{2}});
  const auto first = node.create_publisher<Sample>("/data", QoS{KeepLast{2}});
  const auto second = node.create_publisher<Sample>("/data", QoS{KeepLast{2}});
  EXPECT_NE(first->writer_gid(), second->writer_gid());
  MessageInfo info;
  for (const auto& publisher : {first, second}) {
    publish(*publisher, 1);
    ASSERT_NE(take<Sample>(reader, info), nullptr);
    EXPECT_EQ(info.writer_gid, publisher->writer_gid());
  }
}

// Texts are searched where a message is converted: not those of a message that nobody takes.
TEST(ReaderOfBytes, LosesWhatCannotBeReadAsItIsTaken) {
  auto options = options_for(Way::copied);
  options.on_warning = [](const std::string&) {};
  Context context{options};
  std::uint32_t lost = 0;
  EndpointEvents events;
  events.message_lost = [&lost](std::uint32_t count) { lost += count; };
  const dds_topic_descriptor& type = MessageTraits<String>::descriptor();
  Reader reader{context.state(),
                message_topic("/text"),
                QoS{1},
                type,
                {},
                {},
                std::make_shared<const EndpointEvents>(events)};
  const Topic topic{*context.state(), message_topic("/text"), type};
  if (topic.pointer_type() == nullptr)
    GTEST_SKIP() << "not possible here: built without CIE_MESSAGES_BY_POINTER";
  const dds::Entity writer{dds_create_writer(context.state()->participant(), topic.entity(),
                                             dds::to_dds(QoS{1}, "/text").get(), nullptr),
                           "creating the DDS writer", "/text"};
  const auto arrive = [&](char third) {
    std::vector<unsigned char> octets{0, 1, 0, 2, 6, 0, 0, 0, 'h', 'e', 'l', 'l', 'o', 0, 0, 0};
    octets[10] = static_cast<unsigned char>(third);
    const ddsrt_iovec_t part{octets.data(), octets.size()};
    dds::check(
        dds_forwardcdr(writer.get(), ddsi_serdata_from_ser_iov(topic.pointer_type(), SDK_DATA, 1,
                                                               &part, octets.size())),
        "publishing", "/text");
  };
  arrive(0);
  arrive('l');  // pushes it out, unread
  EXPECT_EQ(lost, 0U);
  EXPECT_EQ(reader.delivery().count().overwritten(), 1U);
  const auto message = take<String>(reader);
  ASSERT_NE(message, nullptr);
  EXPECT_STREQ(message->data, "hello");
  arrive(0);
  EXPECT_EQ(take<String>(reader), nullptr);
  EXPECT_EQ(lost, 1U);
}

}  // namespace
}  // namespace cie::executor
