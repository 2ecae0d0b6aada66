// Reading on a second thread changes nothing that the consumer sees.
#include <cie/analysis/analyzer.hpp>

#include "ctf_trace.hpp"

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <ctf/read_ahead.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vocabulary/event_batch.hpp>

namespace cie::test {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

// Two streams of many packets: far more events than the reader may be ahead.
void write_long_trace(const TraceFolder& folder) {
  folder.write("metadata", metadata());
  for (std::uint32_t cpu = 0; cpu < 2; ++cpu) {
    std::vector<PacketText> packets;
    for (std::uint64_t number = 0; number < 40; ++number) {
      PacketText packet{.begin = number * 1000,
                        .end = number * 1000 + 999,
                        .sequence = number,
                        .cpu = cpu,
                        .instance = cpu};
      for (std::uint64_t i = 0; i < 100; ++i)
        packet.ticks.push_back({.time = number * 1000 + i * (7 + cpu)});
      packets.push_back(packet);
    }
    folder.write("s" + std::to_string(cpu), bytes_of(packets));
  }
}

TEST(ReadAhead, GivesTheSameEvents) {
  TraceFolder folder;
  write_long_trace(folder);
  // A stream that is damaged: its reason is a text of the reader's own.
  folder.write("s2", bytes_of(PacketText{.begin = 5, .end = 9, .ticks = {{6}}, .instance = 2}) +
                         std::string(100, 'x'));
  const auto expected = read_all(folder);
  ASSERT_GT(expected.size(), 8000U);
  EXPECT_EQ(read_all_ahead(folder), expected);
}

TEST(ReadAhead, PassesOnWhyNothingCanBeRead) {
  TraceFolder folder;
  folder.write("metadata", "nonsense");
  EXPECT_THAT([&] { read_all_ahead(folder); },
              ThrowsMessage<analysis::UnreadableTrace>(HasSubstr("metadata")));
}

TEST(ReadAhead, EndsWithAConsumerThatFails) {
  TraceFolder folder;
  write_long_trace(folder);
  const std::vector<std::filesystem::path> paths{folder.path()};
  int seen = 0;
  const auto fail_late = [&seen](const analysis::Event&) {
    if (++seen == 700) throw std::runtime_error("no space left");
  };
  EXPECT_THAT([&] { analysis::ctf::read_ahead(paths, fail_late); },
              ThrowsMessage<std::runtime_error>("no space left"));
  EXPECT_EQ(seen, 700);
}

TEST(EventBatch, KeepsWhatEventsView) {
  analysis::EventBatch batch(2);
  {
    const std::string comm = "a thread that runs no more";
    const std::vector<std::uint32_t> cpus{1, 3};
    analysis::Event event{};
    event.head.time = {17};
    event.body = analysis::SchedSwitch{.prev_comm = comm, .next_comm = {}};
    batch.keep(batch.add() = event);
    event.body = analysis::ThreadSched{.tid = 4, .moment = std::nullopt, .cpus = cpus};
    batch.keep(batch.add() = event);
  }
  EXPECT_TRUE(batch.is_full());
  ASSERT_EQ(batch.events().size(), 2U);
  EXPECT_EQ(batch.events()[0].head.time.ns, 17);
  const auto& switched = std::get<analysis::SchedSwitch>(batch.events()[0].body);
  EXPECT_EQ(switched.prev_comm, "a thread that runs no more");
  EXPECT_EQ(switched.next_comm, "");
  EXPECT_THAT(std::get<analysis::ThreadSched>(batch.events()[1].body).cpus,
              testing::ElementsAre(1, 3));
  batch.clear();
  EXPECT_TRUE(batch.events().empty());
}

}  // namespace
}  // namespace cie::test
