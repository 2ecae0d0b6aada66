// Which number each class of events has, where only the streams are left to say it.
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include <ctf/metadata/tokens.hpp>
#include <ctf/salvage/event_numbering.hpp>
#include <ctf/salvage/provider_schema.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::analysis::ctf {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;
using testing::ThrowsMessage;

using Kind = ProviderField::Kind;
constexpr ProviderField kOneNumber[]{{.name = "a", .kind = Kind::u32}};
constexpr ProviderField kTwoNumbers[]{{.name = "a", .kind = Kind::u32},
                                      {.name = "b", .kind = Kind::u32}};
constexpr ProviderField kLongNumber[]{{.name = "a", .kind = Kind::u64}};
constexpr ProviderField kText[]{{.name = "a", .kind = Kind::text}};
constexpr std::string_view kColours[]{"red", "green"};
constexpr ProviderField kLabel[]{{.name = "a", .kind = Kind::label, .labels = kColours}};
constexpr ProviderField kCharacter[]{{.name = "a", .kind = Kind::characters, .length = 1}};

// A packet from 1000 to 2000, event by event.
class PacketWriter {
 public:
  PacketWriter() { packet_.begin = 1000, packet_.end = 2000; }

  PacketWriter& event(std::uint16_t id, std::uint32_t time, std::int32_t pid = 7,
                      std::int32_t tid = 8) {
    return add(id).add(time).add(pid).add(tid);
  }
  template <typename T>
  PacketWriter& add(T value) {
    const auto at = packet_.events.size();
    packet_.events.resize(at + sizeof value);
    std::memcpy(packet_.events.data() + at, &value, sizeof value);
    return *this;
  }
  PacketWriter& text(const std::string& value) {
    packet_.events.insert(packet_.events.end(), value.c_str(), value.c_str() + value.size() + 1);
    return *this;
  }
  std::vector<PacketBytes> only() const { return {packet_}; }
  const PacketBytes& packet() const { return packet_; }

 private:
  PacketBytes packet_;
};

TEST(EventNumbering, FollowsFromTheSizesOfEvents) {
  const std::vector<ProviderEvent> classes{{"one", kOneNumber}, {"two", kTwoNumbers}};
  PacketWriter writer;
  writer.event(0, 1001).add(std::uint64_t{0xffff'ffff'ffff});
  writer.event(1, 1002).add(std::uint32_t{0xffff'ffff});
  writer.event(0, 1003).add(std::uint64_t{5});
  EXPECT_THAT(find_numbering(writer.only(), classes), ElementsAre(Pair(0, 1), Pair(1, 0)));
}

TEST(EventNumbering, IsTheSameInAllPackets) {
  const std::vector<ProviderEvent> classes{{"one", kOneNumber}, {"text", kText}};
  PacketWriter first;  // four bytes either way: a number, or three characters
  first.event(0, 1001).text("abc");
  EXPECT_THAT([&] { find_numbering(first.only(), classes); },
              ThrowsMessage<MetadataError>(HasSubstr("more than one way")));
  PacketWriter second;
  second.event(0, 1001).text("longer");
  const std::vector<PacketBytes> both{first.packet(), second.packet()};
  EXPECT_THAT(find_numbering(both, classes), ElementsAre(Pair(0, 1)));
}

TEST(EventNumbering, RefusesWhatTwoClassesOfOneSizeLeaveOpen) {
  const std::vector<ProviderEvent> classes{{"two", kTwoNumbers}, {"long", kLongNumber}};
  PacketWriter writer;
  writer.event(0, 1001).add(std::uint64_t{1});
  EXPECT_THAT([&] { find_numbering(writer.only(), classes); },
              ThrowsMessage<MetadataError>(HasSubstr("more than one way")));
}

TEST(EventNumbering, TellsByContents) {
  const std::vector<ProviderEvent> classes{{"label", kLabel}, {"character", kCharacter}};
  PacketWriter writer;
  writer.event(0, 1001).add(std::uint8_t{1});
  writer.event(0, 1002).add(std::uint8_t{2});  // no colour has this number
  EXPECT_THAT(find_numbering(writer.only(), classes), ElementsAre(Pair(0, 1)));
}

TEST(EventNumbering, TellsReleasesFromMessagesByWhatTheyCount) {
  // All are of 20 bytes: a count of samples here, a time of the day there, or in the middle.
  constexpr std::int64_t kTimeOfDay = 1'700'000'000'000'000'000;
  PacketWriter writer;
  writer.event(0, 1001).add(std::uint32_t{1}).add(std::uint64_t{0}).add(kTimeOfDay);
  writer.event(1, 1002).add(std::uint32_t{1}).add(std::uint64_t{5}).add(std::uint64_t{0});
  writer.event(2, 1003).add(std::uint32_t{1}).add(kTimeOfDay).add(std::uint64_t{1});
  const auto numbering = find_numbering(writer.only(), event_channel_events());
  EXPECT_EQ(event_channel_events()[numbering.at(0)].name, "cie:publish");
  EXPECT_EQ(event_channel_events()[numbering.at(1)].name, "cie:callback_release");
  EXPECT_EQ(event_channel_events()[numbering.at(2)].name, "cie:publish_failed");
}

TEST(EventNumbering, RefusesWhatIsNoneOfTheClasses) {
  const std::vector<ProviderEvent> classes{{"one", kOneNumber}, {"long", kLongNumber}};
  const auto expect_refused = [&classes](const PacketWriter& writer) {
    EXPECT_THAT([&] { find_numbering(writer.only(), classes); },
                ThrowsMessage<MetadataError>(HasSubstr("none of cie's")));
  };
  PacketWriter of_another_size;
  of_another_size.event(0, 1001).add(std::uint32_t{0}).add(std::uint8_t{0});
  expect_refused(of_another_size);
  PacketWriter later_than_its_packet;
  later_than_its_packet.event(0, 2001).add(std::uint32_t{0});
  expect_refused(later_than_its_packet);
  PacketWriter of_no_thread;
  of_no_thread.event(0, 1001, 7, -1).add(std::uint32_t{0});
  expect_refused(of_no_thread);
  PacketWriter with_a_large_number;
  with_a_large_number.event(2, 1001).add(std::uint32_t{0});
  expect_refused(with_a_large_number);
  PacketWriter cut;
  cut.event(0, 1001).add(std::uint16_t{0});
  expect_refused(cut);
}

TEST(EventNumbering, OfNoEventsIsEmpty) {
  EXPECT_TRUE(find_numbering({}, state_channel_events()).empty());
  EXPECT_TRUE(find_numbering(PacketWriter{}.only(), state_channel_events()).empty());
}

TEST(EventNumbering, ReadsExtendedHeaders) {
  const std::vector<ProviderEvent> classes{{"one", kOneNumber}, {"long", kLongNumber}};
  PacketWriter writer;
  writer.add(std::uint16_t{0xffff}).add(std::uint32_t{1}).add(std::uint64_t{1500});
  writer.add(std::int32_t{7}).add(std::int32_t{8}).add(std::uint32_t{0});
  EXPECT_THAT(find_numbering(writer.only(), classes), ElementsAre(Pair(1, 0)));
}

// In a time namespace or not, which recordings without the last field of run_begin do not say.
TEST(EventNumbering, FindsWhereItWasRecorded) {
  for (const bool is_old : {false, true}) {
    PacketWriter writer;
    writer.event(0, 1001)
        .add(std::uint32_t{1})
        .text("0.1")
        .text("isolated")
        .text("boot")
        .text("host");
    writer.add(std::uint32_t{7}).add(std::uint64_t{1}).add(std::int64_t{1});
    writer.add(std::int64_t{300}).add(std::int64_t{1'000'300});  // monotonic, real time
    writer.add(std::uint32_t{4}).text("").add(std::uint8_t{0});
    if (!is_old) writer.add(std::int64_t{0});
    const auto packets = writer.only();
    const auto classes = is_old ? old_state_channel_events() : state_channel_events();
    const auto numbering = find_numbering(packets, classes);
    const auto found = recorded_on(packets, classes, numbering);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->host, "host");
    EXPECT_EQ(found->boot_id, "boot");
    EXPECT_EQ(found->clock_offset_ns, 1'000'000);
  }
}

}  // namespace
}  // namespace cie::analysis::ctf
