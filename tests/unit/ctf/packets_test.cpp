// What is lost or damaged in a stream is told where it happened; the rest is read.
#include <cie/analysis/analyzer.hpp>

#include "ctf_trace.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using analysis::UnreadableTrace;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

constexpr std::size_t kHeader = 80;  // bytes before a packet's events

std::vector<PacketText> three() {
  return {{.begin = 100, .end = 190, .ticks = {{110}, {120}}, .sequence = 0},
          {.begin = 200, .end = 290, .ticks = {{210}}, .sequence = 1, .padding = 32},
          {.begin = 300, .end = 390, .ticks = {{310}}, .sequence = 2}};
}

std::vector<std::string> lines_of(const std::string& stream) {
  TraceFolder folder;
  folder.write("metadata", metadata());
  folder.write("stream", stream);
  return read(folder);
}

std::string error_of(const TraceFolder& folder) {
  try {
    read(folder);
  } catch (const UnreadableTrace& error) {
    return error.what();
  }
  return "none";
}

TEST(Packets, AreReadInOrderWithTheirBounds) {
  TraceFolder folder;
  folder.write("metadata", metadata());
  folder.write("stream", bytes_of(three()));
  EXPECT_THAT(
      read_all(folder),
      ElementsAre("0: stream of channel 0", "0: 100 packet", "0: 110 tick on 0", "0: 120 tick on 0",
                  "0: 190 packet ends", "0: 200 packet", "0: 210 tick on 0", "0: 290 packet ends",
                  "0: 300 packet", "0: 310 tick on 0", "0: 390 packet ends", "0: stream ends"));
}

TEST(Packets, OutsideTheWindowAreNotLookedAt) {
  auto bytes = bytes_of(three());
  bytes[kHeader] = '\x77';  // no such event
  TraceFolder folder;
  folder.write("metadata", metadata());
  folder.write("stream", bytes);
  using analysis::Timestamp;
  using analysis::TimeWindow;
  EXPECT_THAT(read(folder, TimeWindow{.from = Timestamp{191}, .to = Timestamp{299}}),
              ElementsAre("210 tick on 0"));
  // A packet that reaches into it is read whole.
  EXPECT_THAT(read(folder, TimeWindow{.from = Timestamp{290}, .to = Timestamp{300}}),
              ElementsAre("210 tick on 0", "310 tick on 0"));
  EXPECT_THAT(read(folder, TimeWindow{.from = Timestamp{190}, .to = Timestamp{210}}),
              ElementsAre(StartsWith("damaged"), "210 tick on 0"));
}

TEST(Packets, TimesOf32BitsWrap) {
  const auto lines = lines_of(bytes_of(PacketText{
      .begin = 0x1'ffff'fff0, .end = 0x2'0000'0100, .ticks = {{0xffff'fff8}, {8}, {8}}}));
  EXPECT_THAT(lines,
              ElementsAre("8589934584 tick on 0", "8589934600 tick on 0", "8589934600 tick on 0"));
}

TEST(Packets, DiscardedEventsAreCountedFromTheFirstPacketOn) {
  auto packets = three();
  packets[0].discarded = 2;
  packets[1].discarded = 2;
  packets[2].discarded = 7;
  EXPECT_THAT(lines_of(bytes_of(packets)),
              ElementsAre("100 lost 2 events until 190", "110 tick on 0", "120 tick on 0",
                          "210 tick on 0", "290 lost 5 events until 390", "310 tick on 0"));
}

// LTTng discards what a packet has no room for. Events of 6 bytes, a header of 5 of them: at 1128 the
// packet's last kilobyte is still free, at 1129 it is not.
TEST(Packets, EventsAreDiscardedWhenThePacketHasNoRoomForThem) {
  PacketText packet{.begin = 1000, .end = 2000, .discarded = 1};
  constexpr std::size_t kTicks = 300;
  for (std::uint64_t i = 0; i < kTicks; ++i)
    packet.ticks.push_back({.time = 1000 + i});
  static_assert((kTicks - 1'024 / 6 - 1) == 129);
  EXPECT_EQ(lines_of(bytes_of(packet)).front(), "1000 lost 1 events until 2000, after 1128");
  packet.padding = 2000;
  EXPECT_EQ(lines_of(bytes_of(packet)).front(), "1000 lost 1 events until 2000")
      << "it has room in the end";
}

// A full packet ends where the next one begins. One that was flushed ends before, and until the next
// one finds a free buffer events are discarded that it counts.
TEST(Packets, EventsAreDiscardedBetweenAFlushedPacketAndTheNext) {
  PacketText packet{.begin = 1000, .end = 2000, .sequence = 1, .discarded = 1};
  for (std::uint64_t i = 0; i < 300; ++i)
    packet.ticks.push_back({.time = 1000 + i});
  const auto lost_before = [&packet](std::uint64_t end) {
    const PacketText former{.begin = 100, .end = end, .ticks = {{110}}};
    return lines_of(bytes_of({former, packet})).at(1);
  };
  EXPECT_EQ(lost_before(1000), "1000 lost 1 events until 2000, after 1128");
  EXPECT_EQ(lost_before(999), "999 lost 1 events until 2000");
}

TEST(Packets, DiscardedCounterWraps) {
  auto packets = three();
  packets[0].discarded = 0xffff'ffff;
  packets[1].discarded = 1;
  packets[2].discarded = 1;
  const auto lines = lines_of(bytes_of(packets));
  EXPECT_EQ(lines.at(3), "190 lost 2 events until 290");
}

TEST(Packets, ADiscardedCountBelowTheOneBeforeIsNoWrap) {
  auto packets = three();
  packets[0].discarded = 5;
  packets[1].discarded = 3;
  packets[2].discarded = 6;
  EXPECT_THAT(lines_of(bytes_of(packets)),
              ElementsAre("100 lost 5 events until 190", "110 tick on 0", "120 tick on 0",
                          "210 tick on 0", "290 lost 1 events until 390", "310 tick on 0"));
}

TEST(Packets, MissingNumbersAreLostPackets) {
  auto packets = three();
  packets[2].sequence = 4;
  EXPECT_THAT(lines_of(bytes_of(packets)),
              ElementsAre("110 tick on 0", "120 tick on 0", "210 tick on 0",
                          "290 lost 2 packets until 300", "310 tick on 0"));
}

TEST(Packets, ADamagedHeaderCostsOnePacket) {
  auto bytes = bytes_of(three());
  const auto second = bytes_of(three()[0]).size();
  auto damaged = bytes;
  damaged[second] = static_cast<char>(damaged[second] ^ 0x40);  // its magic number
  EXPECT_THAT(
      lines_of(damaged),
      ElementsAre("110 tick on 0", "120 tick on 0",
                  StartsWith("damaged at byte " + std::to_string(second) + ": "), "310 tick on 0"));
}

// Everything else of it says that it is one of this trace: it is read, and that is told.
TEST(Packets, APacketOfAnotherUuidIsRead) {
  auto packets = three();
  packets[1].uuid = 7;
  const auto second = bytes_of(packets[0]).size();
  EXPECT_THAT(lines_of(bytes_of(packets)),
              ElementsAre("110 tick on 0", "120 tick on 0",
                          StartsWith("foreign at byte " + std::to_string(second) + ": "),
                          "210 tick on 0", "310 tick on 0"));
  packets[2].uuid = 7;
  EXPECT_THAT(lines_of(bytes_of(packets)),
              ElementsAre("110 tick on 0", "120 tick on 0", StartsWith("foreign"), "210 tick on 0",
                          StartsWith("foreign"), "310 tick on 0"));
}

// The metadata are another recording's.
TEST(Packets, OfOneOtherUuidAreReadAndThatIsToldOnce) {
  auto packets = three();
  for (auto& packet : packets)
    packet.uuid = 7;
  EXPECT_THAT(lines_of(bytes_of(packets)), ElementsAre("foreign", "110 tick on 0", "120 tick on 0",
                                                       "210 tick on 0", "310 tick on 0"));
  EXPECT_THAT(lines_of(bytes_of(packets[0])),
              ElementsAre("foreign", "110 tick on 0", "120 tick on 0"));
}

// What no packet follows may be anything.
TEST(Packets, OfAnotherUuidBeforeGarbageAreDamage) {
  auto packets = three();
  packets[1].uuid = 7;
  EXPECT_THAT(lines_of(bytes_of(packets[0]) + bytes_of(packets[1]) + std::string(100, 'x')),
              ElementsAre("110 tick on 0", "120 tick on 0", StartsWith("damaged")));
}

// LTTng has a stream for each CPU; other tracers may have their own ways.
TEST(Packets, OfAnotherCpuThanTheirStreamAreDamageWhereLttngWroteThem) {
  auto packets = three();
  packets[1].cpu = 0x4000001;
  TraceFolder folder;
  folder.write("stream", bytes_of(packets));
  folder.write("metadata", metadata() + R"(env { tracer_name = "lttng-ust"; };)");
  const auto lines = read(folder);
  ASSERT_EQ(lines.size(), 4U);
  EXPECT_THAT(lines[2], HasSubstr("a packet of CPU 67108865 in a stream of CPU 0"));
  EXPECT_THAT(lines[3], StartsWith("310"));
  folder.write("metadata", metadata() + R"(env { tracer_name = "other"; };)");
  EXPECT_THAT(read(folder), ElementsAre("110 tick on 0", "120 tick on 0", "210 tick on 67108865",
                                        "310 tick on 0"));
}

TEST(Packets, ABeginBehindTheEndCostsOnePacket) {
  auto packets = three();
  packets[1].begin = packets[1].end + 1;
  const auto lines = lines_of(bytes_of(packets));
  ASSERT_EQ(lines.size(), 4U);
  EXPECT_THAT(lines[2], HasSubstr("a packet ends before it begins"));
  EXPECT_EQ(lines[3], "310 tick on 0");
  packets[1].end = 0;  // as a crash leaves it
  EXPECT_THAT(lines_of(bytes_of(packets)), Not(Contains(StartsWith("damaged"))));
}

TEST(Packets, SizesThatContradictEachOtherCostOnePacket) {
  const auto bytes = bytes_of(three());
  const auto second = bytes_of(three()[0]).size();
  constexpr std::size_t kContentAt = 48;
  constexpr std::size_t kPacketAt = 56;
  for (const auto& [at, reason] : {std::pair(kContentAt + 5, "contradict"),
                                   std::pair(kPacketAt + 5, "the file ends within a packet"),
                                   std::pair(kPacketAt, "contradict")}) {
    auto damaged = bytes;
    damaged[second + at] = static_cast<char>(damaged[second + at] ^ 1);
    const auto lines = lines_of(damaged);
    ASSERT_EQ(lines.size(), 4U) << at;
    EXPECT_THAT(lines[2], HasSubstr(reason));
    EXPECT_EQ(lines[3], "310 tick on 0");
  }
}

TEST(Packets, OneUndecodableEventCostsItsWholePacket) {
  auto packets = three();
  packets[1].tail = "\x09";  // no event has this id
  EXPECT_THAT(lines_of(bytes_of(packets)), ElementsAre("110 tick on 0", "120 tick on 0",
                                                       HasSubstr("an event"), "310 tick on 0"));
  packets[1].tail = std::string("\x02\x20\x01\0\0", 5) + "text without its end";
  packets[1].padding = 0;
  EXPECT_THAT(lines_of(bytes_of(packets)),
              ElementsAre("110 tick on 0", "120 tick on 0",
                          HasSubstr("beyond the packet's content (event text)"), "310 tick on 0"));
}

// The next packet's bytes lie behind it: they are none of its own.
TEST(Packets, AnEventThatTheirContentCutsCostsThatPacketOnly) {
  const std::string event("\x01\x20\x01\0\0\x07", 6);
  for (std::size_t size = 1; size <= event.size(); ++size) {
    auto packets = three();
    packets[0].tail = event.substr(0, size);
    const auto lines = lines_of(bytes_of(packets));
    if (size == event.size()) {
      EXPECT_THAT(lines, Contains("288 tick on 0")) << "it is whole";
    } else {
      EXPECT_THAT(lines, ElementsAre(HasSubstr("beyond the packet's content"), "210 tick on 0",
                                     "310 tick on 0"))
          << size;
    }
  }
}

// The first ones of a packet that lies in the window whole are found as it is looked at.
TEST(Packets, EventsAreReadOnceAndInTheirOrderHoweverManyThereAre) {
  for (const std::uint64_t count : {1U, 255U, 256U, 257U, 1'000U}) {
    std::vector<PacketText> packets(2);
    std::vector<std::string> expected;
    for (std::uint64_t i = 0; i < packets.size(); ++i) {
      packets[i] = {.begin = 1'000 * i, .end = 1'000 * i + 999, .sequence = i};
      for (std::uint64_t tick = 0; tick < count; ++tick) {
        packets[i].ticks.push_back({.time = 1'000 * i + tick});
        expected.push_back(std::to_string(1'000 * i + tick) + " tick on 0");
      }
    }
    EXPECT_EQ(lines_of(bytes_of(packets)), expected) << count;
  }
}

// Whose class is of no vocabulary: it is read when the first event of it comes.
TEST(Packets, AnEventOfAMalformedClassCostsItsPacket) {
  auto metadata_of = metadata();
  const std::string sound = "string s;";
  metadata_of.replace(metadata_of.find(sound), sound.size(), "unknown s;");
  auto bytes = bytes_of(three());
  TraceFolder folder;
  folder.write("metadata", metadata_of);
  folder.write("stream", bytes);
  EXPECT_EQ(read(folder), lines_of(bytes)) << "no event is of it";
  bytes[kHeader] = '\2';
  folder.write("stream", bytes);
  EXPECT_THAT(read(folder),
              ElementsAre(AllOf(StartsWith("damaged"),
                                HasSubstr("its class in the metadata is malformed (event text)")),
                          "210 tick on 0", "310 tick on 0"));
}

TEST(Packets, WholePacketsBeforeACutAreUsedWhereverItIs) {
  const auto packets = three();
  const auto bytes = bytes_of(packets);
  const auto first = bytes_of(packets[0]).size();
  const auto second = first + bytes_of(packets[1]).size();
  for (std::size_t size = first; size < bytes.size(); ++size) {
    const auto lines = lines_of(bytes.substr(0, size));
    const std::size_t whole = size < second ? 2 : 3;
    ASSERT_EQ(lines.size(), whole + (size == first || size == second ? 0 : 1)) << size;
    if (lines.size() > whole) {
      EXPECT_THAT(lines.back(), StartsWith("damaged at byte ")) << size;
    }
  }
}

TEST(Packets, GarbageBetweenPacketsIsSteppedOver) {
  const auto packets = three();
  const auto lines = lines_of(bytes_of(packets[0]) + std::string(777, '\xc1') +
                              bytes_of(packets[1]) + bytes_of(packets[2]));
  EXPECT_THAT(lines, ElementsAre("110 tick on 0", "120 tick on 0", StartsWith("damaged"),
                                 "210 tick on 0", "310 tick on 0"));
}

TEST(Packets, BytesCutOutOfAPacketCostThatPacketOnly) {
  auto bytes = bytes_of(three());
  const auto first = bytes_of(three()[0]).size();
  bytes.erase(first + kHeader + 2, 20);
  const auto lines = lines_of(bytes);
  EXPECT_EQ(lines.front(), "110 tick on 0");
  EXPECT_EQ(lines.back(), "310 tick on 0");
  EXPECT_THAT(lines, testing::Contains(StartsWith("damaged")));
}

TEST(Packets, APacketThatComesTwiceIsReadOnce) {
  const auto packets = three();
  const auto lines = lines_of(bytes_of({packets[0], packets[1], packets[1], packets[2]}));
  EXPECT_THAT(lines, ElementsAre("110 tick on 0", "120 tick on 0", "210 tick on 0",
                                 HasSubstr("there before"), "310 tick on 0"));
}

// A tracer that counts nothing, or a number that was damaged: time says what is new.
TEST(Packets, OfOneNumberAreReadWhereTimeGoesOn) {
  auto packets = three();
  for (auto& packet : packets)
    packet.sequence = 5;
  EXPECT_THAT(lines_of(bytes_of(packets)),
              ElementsAre("110 tick on 0", "120 tick on 0", "210 tick on 0", "310 tick on 0"));
  packets[1].sequence = 3;
  EXPECT_THAT(lines_of(bytes_of(packets)),
              ElementsAre("110 tick on 0", "120 tick on 0", "210 tick on 0",
                          "290 lost 1 packets until 300", "310 tick on 0"));
  packets[1].sequence = 5;
  packets[1].begin = packets[1].end = 150;  // within the packet before
  EXPECT_THAT(lines_of(bytes_of(packets)), ElementsAre("110 tick on 0", "120 tick on 0",
                                                       HasSubstr("there before"), "310 tick on 0"));
}

constexpr std::uint64_t kTebibyte = std::uint64_t{1} << 40U;

// Reading it through takes hours.
TEST(Packets, AHoleIsSteppedOverAndTold) {
  const auto packets = three();
  TraceFolder folder;
  folder.write("metadata", metadata());
  folder.write("stream", bytes_of(packets[0]));
  const auto first = bytes_of(packets[0]).size();
  folder.grow("stream", kTebibyte);
  const auto hole = StartsWith("damaged at byte " + std::to_string(first) + ": no packet begins");
  EXPECT_THAT(read(folder), ElementsAre("110 tick on 0", "120 tick on 0", hole));
  folder.append("stream", bytes_of(packets[1]));
  folder.grow("stream", 2 * kTebibyte);
  EXPECT_THAT(read(folder), ElementsAre("110 tick on 0", "120 tick on 0", hole, "210 tick on 0",
                                        StartsWith("damaged at byte ")));
  folder.write("stream", "");
  folder.grow("stream", kTebibyte);
  EXPECT_THAT(error_of(folder), HasSubstr("stream at byte 0: no packet begins here"));
}

// A header that claims the hole behind it: zeros are events of this trace.
TEST(Packets, AHoleWithinAPacketIsNotReadAsEvents) {
  auto text = metadata();
  text.replace(text.find("id = 1; stream_id"), 6, "id = 0");
  auto packets = three();
  for (auto& packet : packets)
    packet.ticks.clear();
  auto bytes = bytes_of(packets[0]);
  for (const std::size_t at : {std::size_t{48}, std::size_t{56}}) {  // content and packet size
    for (unsigned i = 0; i < 8; ++i)
      bytes[at + i] = static_cast<char>(kTebibyte * 8 >> 8 * i & 0xff);
  }
  TraceFolder folder;
  folder.write("metadata", text);
  folder.write("stream", bytes);
  folder.grow("stream", kTebibyte);
  folder.append("stream", bytes_of(packets[1]));
  EXPECT_THAT(read_all(folder), testing::AllOf(testing::Contains(HasSubstr("never written")),
                                               testing::Contains("0: 200 packet"),
                                               testing::Not(testing::Contains(HasSubstr("tick")))));
}

TEST(Packets, TimeThatRunsBackwardsIsTold) {
  auto packets = three();
  packets[1].begin = 150;
  EXPECT_THAT(lines_of(bytes_of(packets)),
              ElementsAre("110 tick on 0", "120 tick on 0", "150 after 190", "210 tick on 0",
                          "310 tick on 0"));
}

TEST(Packets, WithoutAnyGoodOneTheTraceIsUnreadable) {
  TraceFolder folder;
  folder.write("metadata", metadata());
  EXPECT_EQ(error_of(folder), "none");  // nothing was recorded
  folder.write("stream", "");
  EXPECT_EQ(error_of(folder), "none");
  folder.write("stream", std::string(1000, '\0'));
  EXPECT_THAT(error_of(folder), HasSubstr("stream at byte 0: no packet begins here"));
  folder.write("stream", bytes_of(three()[0]).substr(0, 90));
  EXPECT_THAT(error_of(folder), HasSubstr("the file ends within a packet (90 of 92 bytes)"));
}

TEST(Packets, OneBadStreamAmongGoodOnesIsDamage) {
  TraceFolder folder;
  folder.write("metadata", metadata());
  folder.write("good", bytes_of(three()[0]));
  folder.write("bad", std::string(1000, 'x'));
  EXPECT_THAT(read(folder),
              ElementsAre(StartsWith("damaged at byte 0"), "110 tick on 0", "120 tick on 0"));
}

// Most traces are not ours, and have no manifest to be compared with.
TEST(Packets, AnErrorSpeaksOfAManifestOnlyWhereThereIsOne) {
  for (const auto& [file, bytes] :
       {std::pair("trace/stream", "garbage"), std::pair("trace/metadata", "garbage")}) {
    TraceFolder folder;
    folder.write("trace/metadata", metadata());
    folder.write("trace/stream", bytes_of(three()));
    folder.write(file, bytes);
    EXPECT_THAT(error_of(folder),
                testing::AllOf(testing::Not(HasSubstr("manifest")),
                               testing::Not(HasSubstr("cie record")), HasSubstr("copied whole")));
    folder.write("manifest.json", "{}");
    EXPECT_THAT(error_of(folder), HasSubstr("compare its files with the recording's manifest"));
  }
}

TEST(Packets, MetadataThatCannotBeReadNamesItsFile) {
  TraceFolder folder;
  folder.write("trace/metadata", "");
  EXPECT_THAT(error_of(folder), HasSubstr("trace: its metadata: it is empty"));
  folder.write("trace/metadata", "trace { major = 1;\nbyte_order = ?; };");
  EXPECT_THAT(error_of(folder), HasSubstr("trace: its metadata: line 2: "));
}

}  // namespace
}  // namespace cie::test
