// What files of a recording are called, and how their packets begin.
#include <cie/tracepoints/recording_layout.hpp>

#include <array>
#include <bit>
#include <cstdint>

#include <gtest/gtest.h>

namespace cie {
namespace {

TEST(ChannelOf, IsWhatStandsBeforeTheCpu) {
  EXPECT_EQ(channel_of("events_0"), kEventChannel);
  EXPECT_EQ(channel_of("state_12"), kStateChannel);
  EXPECT_EQ(channel_of("ros2_3"), kRos2EventChannel);
  EXPECT_EQ(channel_of("ros2_state_3"), kRos2StateChannel) << "and not that of the other events";
  EXPECT_EQ(channel_of("metadata"), "metadata");
}

TEST(CpuOf, IsTheNumberAtTheEnd) {
  EXPECT_EQ(cpu_of("events_0"), 0U);
  EXPECT_EQ(cpu_of("ros2_state_12"), 12U);
  for (const auto* other : {"metadata", "events_", "events_1x", "_4", "events_99999999999", ""})
    EXPECT_EQ(cpu_of(other), std::nullopt) << other;
}

// A packet of 4096 bytes, of which 100 are used.
constexpr PacketHeader kPacket{.magic = kPacketMagic,
                               .trace_uuid = {},
                               .stream_id = 0,
                               .stream_instance_id = 1,
                               .begin = 10,
                               .end = 20,
                               .content_bits = 800,
                               .packet_bits = 32768,
                               .number = 5,
                               .discarded_events = 2};

bool is_whole(const PacketHeader& packet, std::uint64_t left) {
  const auto bytes = std::bit_cast<std::array<std::uint8_t, sizeof(PacketHeader)>>(packet);
  const auto header = packet_header(bytes, left);
  return header && header->number == packet.number;
}

TEST(PacketHeaders, AreThoseOfWholePackets) {
  EXPECT_TRUE(is_whole(kPacket, 4096));
  EXPECT_TRUE(is_whole(kPacket, 5000)) << "another may follow";
  EXPECT_FALSE(is_whole(kPacket, 4095)) << "it is cut";
  auto packet = kPacket;
  packet.magic = 0x75D11D57;
  EXPECT_FALSE(is_whole(packet, 4096)) << "of metadata";
  packet = kPacket;
  packet.content_bits = 32776;
  EXPECT_FALSE(is_whole(packet, 4096)) << "it holds more than it has";
  packet = kPacket;
  packet.packet_bits = 32767;
  EXPECT_FALSE(is_whole(packet, 4096)) << "bytes are whole";
  packet.packet_bits = 632;  // 79 bytes
  packet.content_bits = 0;
  EXPECT_FALSE(is_whole(packet, 4096)) << "it is shorter than how it begins";
}

}  // namespace
}  // namespace cie
