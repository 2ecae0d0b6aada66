// Samples as bytes: what is written, and that nothing is believed that comes from elsewhere.
#include "dds/message_data.hpp"

#include <cie/executor/message.hpp>

#include "dds/serdata_ptr.hpp"

#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <cie_messages.hpp>
#include <gtest/gtest.h>

namespace cie::executor {
namespace {

using cie_msgs::Keyed;
using cie_msgs::Sample;
using cie_msgs::String;
using Octets = std::vector<unsigned char>;

struct UnrefType {
  void operator()(ddsi_sertype* type) const noexcept { ddsi_sertype_unref(type); }
};
using TypePtr = std::unique_ptr<ddsi_sertype, UnrefType>;

template <typename T>
TypePtr type_of() {
  return TypePtr{
      make_pointer_type(std::make_shared<const MessageLayout>(MessageTraits<T>::descriptor()))};
}

SerdataPtr received(const ddsi_sertype& type, const Octets& octets) {
  const ddsrt_iovec_t part{const_cast<unsigned char*>(octets.data()), octets.size()};
  return SerdataPtr{ddsi_serdata_from_ser_iov(&type, SDK_DATA, 1, &part, octets.size())};
}

Octets octets_of(const ddsi_serdata& data) {
  Octets octets(ddsi_serdata_size(&data));
  ddsi_serdata_to_ser(&data, 0, octets.size(), octets.data());
  return octets;
}

// Plain CDR, little endian, two octets of padding; the length counts the final zero.
const Octets kHello{0x00, 0x01, 0x00, 0x02, 6, 0, 0, 0, 'h', 'e', 'l', 'l', 'o', 0, 0, 0};

class MessageData : public testing::Test {
 protected:
  void SetUp() override {
    if (strings == nullptr)
      GTEST_SKIP() << "not possible here: built without CIE_MESSAGES_BY_POINTER";
  }
  TypePtr strings = type_of<String>();
};

TEST_F(MessageData, OfAPointerIsThePointerUntilSomebodyWantsBytes) {
  auto message = make_message<String>();
  set_text(message->data, "hello");
  const std::shared_ptr<const String> shared{std::move(message)};
  const SerdataPtr data{make_message_data(*strings, shared)};
  EXPECT_EQ(message_of(*data), shared);
  EXPECT_EQ(octets_of(*data), kHello);
  EXPECT_EQ(message_of(*data), shared);
}

TEST_F(MessageData, LetsGoOfItsMessageAtTheEnd) {
  const std::shared_ptr<const String> shared{make_message<String>()};
  SerdataPtr data{make_message_data(*strings, shared)};
  EXPECT_EQ(shared.use_count(), 2);
  data.reset();
  EXPECT_EQ(shared.use_count(), 1);
}

TEST_F(MessageData, OfACopyIsBytes) {
  const auto message = make_message<String>();
  set_text(message->data, "hello");
  const SerdataPtr data{ddsi_serdata_from_sample(strings.get(), SDK_DATA, message.get())};
  set_text(message->data, "changed");
  EXPECT_EQ(message_of(*data), nullptr);
  EXPECT_EQ(octets_of(*data), kHello);
}

TEST_F(MessageData, IsReadInEitherByteOrder) {
  const Octets big_endian{0x00, 0x00, 0x00, 0x00, 0, 0, 0, 6, 'h', 'e', 'l', 'l', 'o', 0};
  for (const Octets& octets : {kHello, big_endian}) {
    const SerdataPtr data = received(*strings, octets);
    ASSERT_NE(data, nullptr);
    const auto message = make_message<String>();
    ASSERT_TRUE(ddsi_serdata_to_sample(data.get(), message.get(), nullptr, nullptr));
    EXPECT_STREQ(message->data, "hello");
    EXPECT_EQ(octets_of(*data), kHello);
  }
}

TEST_F(MessageData, RefusesWhatIsCutShort) {
  // The last two octets are padding, which need not be there.
  for (std::size_t size = 0; size + 2 < kHello.size(); ++size) {
    EXPECT_EQ(received(*strings, Octets(kHello.begin(), kHello.begin() + static_cast<int>(size))),
              nullptr)
        << size;
  }
}

TEST_F(MessageData, RefusesOtherEncodings) {
  for (const int identifier : {0x02, 0x03, 0x06, 0x07, 0x08, 0x09, 0x0a, 0x0b, 0xff}) {
    Octets octets = kHello;
    octets[1] = static_cast<unsigned char>(identifier);
    EXPECT_EQ(received(*strings, octets), nullptr) << identifier;
  }
}

TEST_F(MessageData, RefusesATextWithoutEnd) {
  Octets octets = kHello;
  octets[13] = '!';
  EXPECT_EQ(received(*strings, octets), nullptr);
}

// It is a message, but not one that a C string could hold: who takes it would get "he".
TEST_F(MessageData, IsUnreadableWithAZeroInATextThatCameAsBytes) {
  EXPECT_FALSE(is_unreadable(*received(*strings, kHello)));
  for (const std::size_t at : {8U, 10U, 12U}) {
    Octets octets = kHello;
    octets[at] = 0;
    const SerdataPtr data = received(*strings, octets);
    ASSERT_NE(data, nullptr);
    EXPECT_TRUE(is_unreadable(*data)) << at;
  }
  Octets empty{0x00, 0x01, 0x00, 0x00, 1, 0, 0, 0, 0};
  EXPECT_FALSE(is_unreadable(*received(*strings, empty)));
}

// Whatever the network brings, it is refused or it is a message (the sanitizers watch).
TEST_F(MessageData, SurvivesEveryByte) {
  const TypePtr samples = type_of<Sample>();
  const auto message = make_message<Sample>();
  set_text(message->frame_id, "lidar");
  resize(message->payload, 40);
  const SerdataPtr good{ddsi_serdata_from_sample(samples.get(), SDK_DATA, message.get())};
  const Octets octets = octets_of(*good);
  std::mt19937 random{20260801};
  int read = 0;
  for (int i = 0; i < 20000; ++i) {
    Octets changed = octets;
    for (auto n = random() % 4; n-- > 0;)
      changed[4 + random() % (changed.size() - 4)] = static_cast<unsigned char>(random());
    if (i % 2 == 0) changed.resize(4 + random() % (changed.size() - 3));
    const SerdataPtr data = received(*samples, changed);
    if (data == nullptr) continue;
    ++read;
    ASSERT_TRUE(ddsi_serdata_to_sample(data.get(), message.get(), nullptr, nullptr));
    EXPECT_NE(message->frame_id, nullptr);
    EXPECT_LE(message->payload._length, octets.size());
  }
  EXPECT_GT(read, 0);
}

TEST_F(MessageData, HasOneTypeForEqualLayouts) {
  const TypePtr again = type_of<String>();
  const TypePtr other = type_of<Sample>();
  EXPECT_TRUE(ddsi_sertype_equal(strings.get(), again.get()));
  EXPECT_EQ(ddsi_sertype_hash(strings.get()), ddsi_sertype_hash(again.get()));
  EXPECT_FALSE(ddsi_sertype_equal(strings.get(), other.get()));
}

TEST_F(MessageData, LeavesTypesWithKeysToCyclone) { EXPECT_EQ(type_of<Keyed>(), nullptr); }

}  // namespace
}  // namespace cie::executor
