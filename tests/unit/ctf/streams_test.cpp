// Many files become one sequence of events.
#include "ctf_trace.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <ctf/native_reader.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using testing::ElementsAre;

TEST(Streams, AreMergedByTimeAndEqualTimesByCpu) {
  TraceFolder folder;
  folder.write("metadata", metadata());
  folder.write("a", bytes_of(PacketText{.begin = 1, .end = 9, .ticks = {{2}, {5}, {7}}, .cpu = 1}));
  folder.write("b", bytes_of(PacketText{.begin = 1, .end = 9, .ticks = {{3}, {5}, {6}}, .cpu = 0}));
  const auto lines = read(folder);
  EXPECT_THAT(lines, ElementsAre("2 tick on 1", "3 tick on 0", "5 tick on 0", "5 tick on 1",
                                 "6 tick on 0", "7 tick on 1"));
  // The same under other names.
  TraceFolder renamed;
  renamed.write("metadata", metadata());
  renamed.write("z",
                bytes_of(PacketText{.begin = 1, .end = 9, .ticks = {{2}, {5}, {7}}, .cpu = 1}));
  renamed.write("0",
                bytes_of(PacketText{.begin = 1, .end = 9, .ticks = {{3}, {5}, {6}}, .cpu = 0}));
  EXPECT_EQ(read(renamed), lines);
}

TEST(Streams, RotationChunksAreOneStream) {
  TraceFolder folder;
  for (int chunk = 0; chunk < 3; ++chunk) {
    const auto name = "archive-" + std::to_string(2 - chunk);  // names say nothing about order
    const auto time = static_cast<std::uint64_t>(100 * chunk);
    folder.write(name + "/metadata", metadata());
    folder.write(name + "/channel_0",
                 bytes_of(PacketText{.begin = time,
                                     .end = time + 50,
                                     .ticks = {{time + 1}},
                                     .sequence = static_cast<std::uint64_t>(chunk),
                                     .discarded = static_cast<std::uint32_t>(chunk)}));
  }
  EXPECT_THAT(read(folder),
              ElementsAre("1 tick on 0", "50 lost 1 events until 150", "101 tick on 0",
                          "150 lost 1 events until 250", "201 tick on 0"));
  EXPECT_EQ(read_all(folder).front(), "0: stream of channel 0");
  EXPECT_EQ(read_all(folder).back(), "0: stream ends");
}

TEST(Streams, SnapshotsThatOverlapRepeatNothing) {
  TraceFolder folder;
  const auto packet = [](std::uint64_t number) {
    return PacketText{
        .begin = 10 * number, .end = 10 * number + 9, .ticks = {{10 * number}}, .sequence = number};
  };
  folder.write("1/metadata", metadata());
  folder.write("1/s", bytes_of({packet(1), packet(2), packet(3)}));
  folder.write("2/metadata", metadata());
  folder.write("2/s", bytes_of({packet(2), packet(3), packet(4)}));
  EXPECT_THAT(read(folder),
              ElementsAre("10 tick on 0", "20 tick on 0", "30 tick on 0", "40 tick on 0"));
}

// Two sessions, of which the first one had two chunks.
TEST(Streams, AreOfTheTraceOfTheirSession) {
  TraceFolder folder;
  const auto write = [&folder](const std::string& name, std::uint64_t time, std::uint8_t uuid) {
    folder.write(name + "/metadata", metadata(uuid));
    for (const std::uint32_t cpu : {0U, 1U}) {
      folder.write(name + "/channel_" + std::to_string(cpu),
                   bytes_of(PacketText{.begin = time,
                                       .end = time + 50,
                                       .ticks = {{time + 1}},
                                       .sequence = time / 100,
                                       .cpu = cpu,
                                       .uuid = uuid}));
    }
  };
  write("a/0", 0, 1);
  write("a/1", 100, 1);
  write("b", 200, 2);
  std::vector<std::uint32_t> traces;
  const std::vector<std::filesystem::path> paths{folder.path()};
  analysis::ctf::read_traces(paths, [&traces](const analysis::Event& event) {
    if (const auto* begin = std::get_if<analysis::StreamBegin>(&event.body))
      traces.push_back(begin->trace);
  });
  EXPECT_THAT(traces, ElementsAre(0, 0, 1, 1));
}

// LTTng gives the only packet of an idle CPU the begin of its last flush.
TEST(Streams, WithoutAnyEventAreToldAsIdle) {
  TraceFolder folder;
  folder.write("metadata", metadata());
  folder.write("0", bytes_of(PacketText{.begin = 1, .end = 90, .ticks = {{2}, {80}}, .cpu = 0}));
  folder.write("1", bytes_of({PacketText{.begin = 89, .end = 91, .sequence = 0, .cpu = 1},
                              PacketText{.begin = 91, .end = 92, .sequence = 1, .cpu = 1}}));
  folder.write(
      "2", bytes_of({PacketText{.begin = 1, .end = 5, .sequence = 0, .cpu = 2},
                     PacketText{.begin = 5, .end = 92, .ticks = {{6}}, .sequence = 1, .cpu = 2}}));
  const auto lines = read_all(folder);
  EXPECT_EQ(lines[0], "0: stream of channel 0");
  EXPECT_EQ(lines[1], "1: stream of channel 0, idle");
  EXPECT_EQ(lines[2], "2: stream of channel 0");
}

// It is no evidence of another boot.
TEST(Streams, OfWhichNoPacketCanBeFoundHaveTheClockOfTheirTrace) {
  const std::string boot = "11111111-2222-3333-4444-555555555555";
  TraceFolder folder;
  folder.write("metadata", metadata(1, "uuid = \"" + boot + "\"; offset = 100;"));
  folder.write("0", bytes_of(PacketText{.begin = 1, .end = 9, .ticks = {{2}}}));
  folder.write("notes.txt", "hello\n");
  folder.write("zeros", std::string(8192, '\0'));
  std::vector<std::string> clocks;
  const std::vector<std::filesystem::path> paths{folder.path()};
  analysis::ctf::read_traces(paths, [&clocks](const analysis::Event& event) {
    if (const auto* begin = std::get_if<analysis::StreamBegin>(&event.body))
      clocks.emplace_back(begin->clock_uuid);
  });
  EXPECT_THAT(clocks, ElementsAre(boot, boot, boot));
}

TEST(Streams, ThatHaveNoTimeInCommonWithMostOthersAreLeftOut) {
  TraceFolder folder;
  folder.write("metadata", metadata());
  const auto stream = [](std::uint64_t begin, std::uint64_t end, std::uint32_t cpu) {
    const auto middle = (begin + end) / 2;
    return bytes_of(
        {PacketText{.begin = begin, .end = middle, .ticks = {{begin}}, .cpu = cpu},
         PacketText{.begin = middle, .end = end, .ticks = {{end}}, .sequence = 1, .cpu = cpu}});
  };
  folder.write("0", stream(0, 100, 0));
  folder.write("1", stream(20, 90, 1));
  folder.write("2", stream(200, 300, 2));                                    // after the others
  folder.write("3", bytes_of(PacketText{.begin = 5, .end = 10, .cpu = 3}));  // idle, and cut
  folder.write("4", bytes_of(PacketText{.begin = 5, .end = 5, .cpu = 4}));   // idle, and flushed
  const auto lines = read_all(folder);
  EXPECT_THAT(
      std::vector(lines.begin(), lines.begin() + 5),
      ElementsAre("0: stream of channel 0", "1: stream of channel 0",
                  "2: stream of channel 0, left out", "3: stream of channel 0, idle, left out",
                  "4: stream of channel 0, idle"));
  // Nothing of them is lost to the reader.
  EXPECT_THAT(lines, testing::Contains("2: 300 tick on 2"));
  EXPECT_THAT(lines, testing::Not(testing::Contains(testing::HasSubstr("lost"))));
  folder.write("2", stream(90, 300, 2));
  folder.write("3", bytes_of(PacketText{.begin = 5, .end = 90, .cpu = 3}));
  EXPECT_EQ(read_all(folder)[2], "2: stream of channel 0");
}

TEST(Streams, ATraceNamedTwiceIsReadOnce) {
  TraceFolder folder;
  folder.write("metadata", metadata());
  folder.write("s", bytes_of(PacketText{.begin = 1, .end = 9, .ticks = {{2}}}));
  EXPECT_THAT(read({folder.path(), folder.path() / "."}), ElementsAre("2 tick on 0"));
}

TEST(Streams, ClocksOfOneBootAreOneWhateverOffsetEachTraceMeasured) {
  TraceFolder folder;
  const std::string boot = "uuid = \"11111111-2222-3333-4444-555555555555\"; ";
  folder.write("a/metadata", metadata(1, boot + "offset = 100;"));
  folder.write("a/s", bytes_of(PacketText{.begin = 1, .end = 9, .ticks = {{2}, {6}}}));
  folder.write("b/metadata", metadata(2, boot + "offset = 97;"));
  folder.write("b/s",
               bytes_of(PacketText{.begin = 1, .end = 9, .ticks = {{4}}, .cpu = 7, .uuid = 2}));
  EXPECT_THAT(read(folder), ElementsAre("2 tick on 0", "4 tick on 7", "6 tick on 0"));
}

TEST(Streams, ClocksOfDifferentBootsAreComparedByTheirOffsets) {
  TraceFolder folder;
  const auto boot = [](const char* digit, int offset) {
    return "uuid = \"1111111" + std::string(digit) +
           "-2222-3333-4444-555555555555\"; offset = " + std::to_string(offset) + ";";
  };
  folder.write("a/metadata", metadata(1, boot("1", 100)));
  folder.write("a/s", bytes_of(PacketText{.begin = 1, .end = 9, .ticks = {{2}, {6}}}));
  folder.write("b/metadata", metadata(2, boot("2", 50)));
  folder.write("b/s",
               bytes_of(PacketText{.begin = 51, .end = 59, .ticks = {{54}}, .cpu = 7, .uuid = 2}));
  EXPECT_THAT(read(folder), ElementsAre("2 tick on 0", "54 tick on 7", "6 tick on 0"));
}

// Two recordings whose traces have one uuid, as where the metadata of one was copied and edited, are no
// chunks of one: each has its own clock, which is told with its streams.
TEST(Streams, OfTracesWithOneUuidHaveTheirOwnClocks) {
  const auto boot = [](const char* digit) {
    return "uuid = \"1111111" + std::string(digit) + "-2222-3333-4444-555555555555\"; ";
  };
  const auto read_both = [](const std::string& first, const std::string& second) {
    TraceFolder folder;
    folder.write("a/metadata", metadata(1, first));
    folder.write("a/s", bytes_of(PacketText{.begin = 1, .end = 9, .ticks = {{2}, {6}}}));
    folder.write("b/metadata", metadata(1, second));
    folder.write("b/s", bytes_of(PacketText{.begin = 51, .end = 59, .ticks = {{54}}}));
    return std::pair(read(folder), read_all(folder));
  };
  const auto [by_boots, of_boots] =
      read_both(boot("1") + "offset = 100;", boot("2") + "offset = 50;");
  EXPECT_THAT(by_boots, ElementsAre("2 tick on 0", "54 tick on 0", "6 tick on 0"));
  EXPECT_THAT(of_boots, testing::Contains("1: stream of channel 1"));
  EXPECT_THAT(read_both("offset = 100;", "offset = 50;").first,
              ElementsAre("2 tick on 0", "54 tick on 0", "6 tick on 0"));
  const auto [one_clock, chunks] =
      read_both(boot("1") + "offset = 100;", boot("1") + "offset = 50;");
  EXPECT_THAT(one_clock, ElementsAre("2 tick on 0", "6 tick on 0", "54 tick on 0"))
      << "measured anew";
  EXPECT_THAT(chunks, testing::Not(testing::Contains("1: stream of channel 1")));
}

// A container with a clock of its own (a time namespace) tells the machine's boot.
TEST(Streams, ClocksOfOneBootThatAreFarApartAreOfTheirHosts) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const auto ticks = [](std::int64_t offset, const std::string& host) {
    TraceFolder folder;
    const std::string boot = "uuid = \"11111111-2222-3333-4444-555555555555\"; offset = ";
    const auto env = [](const std::string& name) {
      return "env { hostname = \"" + name + "\"; };\n";
    };
    folder.write("a/metadata", metadata(1, boot + std::to_string(2 * kSecond) + ";") + env("a"));
    folder.write("a/s", bytes_of(PacketText{.begin = 1, .end = 9, .ticks = {{2}, {6}}}));
    folder.write("b/metadata", metadata(2, boot + std::to_string(offset) + ";") + env(host));
    folder.write("b/s",
                 bytes_of(PacketText{.begin = 1, .end = 9, .ticks = {{4}}, .cpu = 7, .uuid = 2}));
    return read(folder);
  };
  const auto one_clock = ElementsAre("2 tick on 0", "4 tick on 7", "6 tick on 0");
  EXPECT_THAT(ticks(2 * kSecond + kSecond - 1, "b"), one_clock) << "measured badly";
  EXPECT_THAT(ticks(3 * kSecond, "b"), ElementsAre("2 tick on 0", "6 tick on 0", "4 tick on 7"));
  EXPECT_THAT(ticks(kSecond, "b"), ElementsAre("4 tick on 7", "2 tick on 0", "6 tick on 0"));
  EXPECT_THAT(ticks(kSecond, "a"), one_clock) << "its wall clock was set in between";
}

// "epoch + 100" by LTTng, "epoch + offset" by perf: which of 4 (perf's), 2 and 6 comes when?
std::vector<std::string> read_beside_perf(const std::string& host, const std::string& description,
                                          std::int64_t offset) {
  TraceFolder folder;
  folder.write("b/metadata",
               metadata(1, "uuid = \"11111111-2222-3333-4444-555555555555\"; offset = 100;") +
                   "env { hostname = \"h\"; tracer_name = \"lttng-ust\"; };\n");
  folder.write("b/s", bytes_of(PacketText{.begin = 1, .end = 9, .ticks = {{2}, {6}}}));
  folder.write("a/metadata",
               metadata(2, "uuid = \"22222222-2222-3333-4444-555555555555\"; description = \"" +
                               description + "\"; offset = " + std::to_string(offset) + ";") +
                   "env { host = \"" + host + "\"; tracer_name = \"perf\"; };\n");
  folder.write("a/s",
               bytes_of(PacketText{.begin = 1, .end = 9, .ticks = {{4}}, .cpu = 7, .uuid = 2}));
  return read(folder);
}

TEST(Streams, PerfsMonotonicClockIsThatOfLttngOnTheSameHostAndBoot) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const auto same = ElementsAre("2 tick on 0", "4 tick on 7", "6 tick on 0");
  const auto by_offset = ElementsAre("2 tick on 0", "6 tick on 0", "4 tick on 7");
  EXPECT_THAT(read_beside_perf("h", "monotonic", 100 + 2300), same);
  EXPECT_THAT(read_beside_perf("h", "monotonic", 100 + kSecond - 1), same);
  EXPECT_THAT(read_beside_perf("h", "monotonic", 100 + kSecond), by_offset) << "another boot";
  EXPECT_THAT(read_beside_perf("other", "monotonic", 100 + 2300), by_offset);
  EXPECT_THAT(read_beside_perf("h", "boottime", 100 + 2300), by_offset);
}

TEST(Streams, PacketsLargerThanThePieceInMemoryAreReadWhole) {
  TraceFolder folder;
  PacketText packet{.begin = 0, .end = 3'000'000, .ticks = {}};
  for (std::uint64_t i = 0; i < 400'000; ++i)  // 2.4 MB
    packet.ticks.push_back({.time = i, .value = static_cast<std::uint8_t>(i)});
  folder.write("metadata", metadata());
  folder.write("s", bytes_of(packet));
  const auto lines = read(folder);
  ASSERT_EQ(lines.size(), 400'000U);
  EXPECT_EQ(lines.back(), "399999 tick on 0");
}

TEST(Streams, AnEventLargerThanThePieceInMemoryIsReadWhole) {
  TraceFolder folder;
  folder.write("metadata", metadata());
  folder.write("s", bytes_of(PacketText{.begin = 0,
                                        .end = 10,
                                        .ticks = {{1}},
                                        .tail = std::string("\x02\x05\0\0\0", 5) +
                                                std::string(5'000'000, 'x') + '\0'}));
  EXPECT_THAT(read(folder), ElementsAre("1 tick on 0", "5 text on 0"));
}

// Of a kernel's trace that are three events of four.
TEST(Streams, EventsThatMeanNothingAreOnlyCountedForWhoWantsThat) {
  using namespace std::string_literals;
  const TraceFolder folder;
  folder.write("metadata", metadata() +
                               "event { id = 3; stream_id = 0; name = \"sched_process_exit\";"
                               " fields := struct { u32 tid; }; };\n");
  const std::string rest = "\3\6\0\0\0\1\0\0\0"s + "\2\7\0\0\0words\0"s + "\1\10\0\0\0\1"s;
  folder.write("channel",
               bytes_of(PacketText{.begin = 1, .end = 9, .ticks = {{2}, {5}}, .tail = rest}) +
                   bytes_of(PacketText{.begin = 9, .end = 20, .ticks = {{11}}, .sequence = 1}));
  EXPECT_THAT(read(folder), ElementsAre("2 tick on 0", "5 tick on 0", "6 other", "7 text on 0",
                                        "8 tick on 0", "11 tick on 0"));
  EXPECT_THAT(read_counting(folder), ElementsAre("6 other", "9 4 others on 0", "20  on 0"));
}

TEST(Streams, BytesReadAreCountedForWhoLooks) {
  const TraceFolder folder;
  folder.write("metadata", metadata());
  const auto good = bytes_of(PacketText{.begin = 100, .end = 200, .ticks = {{110, 1}}});
  const auto next = bytes_of(
      PacketText{.begin = 200, .end = 300, .ticks = {{210, 1}}, .sequence = 1, .padding = 100});
  folder.write("channel_0", good + next);
  folder.write("channel_1",
               bytes_of(PacketText{.begin = 100, .end = 200, .cpu = 1, .instance = 1}) + "rubbish");
  analysis::Progress progress;
  const std::vector<std::filesystem::path> traces{folder.path()};
  analysis::ctf::read_traces(traces, [](const analysis::Event&) {}, {.progress = &progress});
  const auto bytes = std::filesystem::file_size(folder.path() / "channel_0") +
                     std::filesystem::file_size(folder.path() / "channel_1");
  EXPECT_EQ(progress.total, bytes);
  EXPECT_EQ(progress.done, bytes);
}

}  // namespace
}  // namespace cie::test
