// What the recorder says of damaged stream files: packets written byte by byte here.
#include "ctf/stream_check.hpp"

#include <cie/tracepoints/recording_layout.hpp>

#include "support/temporary_directory.hpp"

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace cie::record {
namespace {

namespace fs = std::filesystem;

void put32(std::string& bytes, std::uint32_t value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}
void put64(std::string& bytes, std::uint64_t value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

// A packet of 4096 bytes, of which the first 100 are content.
std::string packet(std::uint64_t number, std::uint64_t discarded) {
  std::string bytes;
  put32(bytes, 0xC1FC1FC1);
  bytes.append(16, 'u');
  put32(bytes, 0);  // stream class
  put64(bytes, 0);  // stream instance
  put64(bytes, 10);
  put64(bytes, 20);
  put64(bytes, 100 * 8);
  put64(bytes, 4096 * 8);
  put64(bytes, number);
  put64(bytes, discarded);
  bytes.resize(4096);
  return bytes;
}

class StreamCheck : public ::testing::Test {
 protected:
  StreamCheck() {
    fs::create_directories(root_ / "trace/index");
    write("trace/metadata", "x");
    write("trace/index/c_0.idx", "not a stream");
    write("manifest.json", "not a stream");
  }

  void write(const std::string& name, const std::string& bytes) const {
    std::ofstream(root_ / name, std::ios::binary) << bytes;
  }

  StreamSummary check(const std::string& bytes) const {
    write("trace/c_0", bytes);
    const auto summaries = check_streams(root_);
    EXPECT_EQ(summaries.size(), 1U);
    return summaries.front();
  }

  const test::TemporaryDirectory directory_;
  const fs::path root_ = directory_.path();
};

TEST_F(StreamCheck, CountsPacketsAndWhatTheTracerDiscarded) {
  const StreamSummary summary = check(packet(0, 0) + packet(1, 7));
  EXPECT_EQ(summary.packets, 2U);
  EXPECT_EQ(summary.content_bytes, 200U);
  EXPECT_EQ(summary.discarded_events, 7U);
  EXPECT_EQ(summary.lost_packets, 0U);
  EXPECT_FALSE(summary.is_damaged);
}

TEST_F(StreamCheck, CountsHolesInThePacketNumbers) {
  EXPECT_EQ(check(packet(0, 0) + packet(3, 0) + packet(4, 0)).lost_packets, 2U);
}

TEST_F(StreamCheck, SeesAFileThatEndsWithinAPacket) {
  const std::string whole = packet(0, 0) + packet(1, 0);
  for (const std::size_t size : {1UL, 79UL, 80UL, 4095UL, 4097UL, 8191UL}) {
    EXPECT_TRUE(check(whole.substr(0, size)).is_damaged) << size;
  }
  EXPECT_FALSE(check(whole.substr(0, 4096)).is_damaged);
}

// Of one CPU's stream of hot events, from packets whose numbers are there.
StreamSummary hot_stream(const char* cpu, std::uint64_t begin, std::uint64_t end,
                         std::uint64_t lost_packets = 0) {
  StreamSummary stream{.file = std::string("trace/") + kEventChannel + '_' + cpu};
  stream.packets = 1;
  stream.lost_packets = lost_packets;
  stream.begin = begin;
  stream.end = end;
  return stream;
}

TEST(HeldTime, IsWhatEveryStreamHolds) {
  using std::chrono::nanoseconds;
  const auto held = held_by({hot_stream("0", 100, 900), hot_stream("1", 300, 950)});
  EXPECT_EQ(held.common, nanoseconds(900 - 300));
  EXPECT_EQ(held.overwritten, std::nullopt) << "a stream may begin late because its CPU was idle";
  EXPECT_EQ(held_by({}).common, nanoseconds(0));
}

TEST(HeldTime, IsShortOnlyWhereOlderPacketsWereOverwritten) {
  using std::chrono::nanoseconds;
  const auto held = held_by(
      {hot_stream("0", 100, 900, 3), hot_stream("1", 300, 950, 1), hot_stream("2", 800, 960)});
  EXPECT_EQ(held.overwritten, nanoseconds(950 - 300));
  auto state = hot_stream("0", 850, 900, 7);
  state.file = std::string("trace/") + kStateChannel + "_0";
  EXPECT_EQ(held_by({state}).overwritten, std::nullopt) << "descriptions have buffers of their own";
}

// Two packets of 4096 bytes each, up to 20; another stream goes on.
TEST_F(StreamCheck, SaysWhichFileHasReachedTheLimitOfItsSize) {
  const StreamSummary cut = check(packet(0, 0) + packet(1, 0));
  StreamSummary other = cut;
  other.size = 4096;
  other.end = 30;
  const auto marked = [&](std::uint64_t limit) {
    std::vector<StreamSummary> streams{cut, other};
    mark_cut_by_limit(streams, limit);
    EXPECT_FALSE(streams[1].is_cut_by_limit) << "it has room, or ends last";
    return streams[0];
  };
  EXPECT_FALSE(marked(3 * 4096).is_cut_by_limit) << "a third one fits";
  EXPECT_EQ(incompleteness_of(marked(3 * 4096)), "");
  EXPECT_NE(incompleteness_of(marked(3 * 4096 - 1)).find("File too large"), std::string::npos);
  other.end = 20;
  EXPECT_FALSE(marked(2 * 4096).is_cut_by_limit) << "nothing came after";
}

TEST_F(StreamCheck, SurvivesGarbage) {
  EXPECT_TRUE(check(std::string(5000, '\xff')).is_damaged);
  std::string endless = packet(0, 0);
  endless.replace(56, 8, std::string(8, '\0'));  // a packet of size 0
  EXPECT_TRUE(check(endless).is_damaged);
  EXPECT_FALSE(check("").is_damaged);
}

// A quiet channel has streams, too: of one that has none LTTng could make no buffers.
TEST_F(StreamCheck, NamesTheChannelsThatATraceLacks) {
  const auto lacking = [this] {
    std::string text;
    for (const auto& [trace, channel] : absent_channels(check_streams(root_), {"events", "state"}))
      text += trace.filename().string() + " lacks " + channel + '\n';
    return text;
  };
  EXPECT_EQ(lacking(), "") << "nothing at all is something else";
  write("trace/events_0", packet(0, 0));
  write("trace/events_1", packet(0, 0));
  EXPECT_EQ(lacking(), "trace lacks state\n");
  write("trace/state_1", packet(0, 0));
  EXPECT_EQ(lacking(), "");
  fs::create_directories(root_ / "other");
  write("other/metadata", "x");
  write("other/state_0", packet(0, 0));
  EXPECT_EQ(lacking(), "other lacks events\n");
}

TEST_F(StreamCheck, NamesEmptyMetadata) {
  EXPECT_TRUE(empty_metadata(root_).empty());
  write("trace/metadata", "");
  ASSERT_EQ(empty_metadata(root_).size(), 1U);
  EXPECT_EQ(empty_metadata(root_).front(), root_ / "trace/metadata");
}

}  // namespace
}  // namespace cie::record
