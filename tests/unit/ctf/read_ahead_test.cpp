// Reading on a second thread changes nothing that the consumer sees.
#include <cie/analysis/analyzer.hpp>

#include "ctf_trace.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <ctf/read_ahead.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vocabulary/event_batch.hpp>
#include <vocabulary/ros2/event_translator.hpp>
#include <vocabulary/vocabulary.hpp>

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

// Packets that fit into memory are held whole and read once, in pieces otherwise: among events of fixed
// layout are some whose size only they tell, and more of them than there is room to note.
TEST(ReadAhead, EventsAreThoseOfPacketsThatAreHeldWhole) {
  constexpr std::uint64_t kEvents = 40'000;  // of a packet: more bytes than a piece
  constexpr std::uint64_t kPackets = 3;
  TraceFolder folder;
  folder.write("metadata", metadata());
  std::vector<std::string> expected;
  std::array<std::string, 2> streams;
  for (std::uint64_t number = 0; number < kPackets; ++number) {
    std::array<std::string, 2> events;
    const auto begin = number * 2 * kEvents;
    for (std::uint64_t i = 0; i < kEvents; ++i) {
      for (std::uint32_t cpu = 0; cpu < 2; ++cpu) {
        const auto time = begin + 2 * i + cpu;
        const bool is_text = i % 5'000 == 77 || i % 5'000 == 78;
        expected.push_back(std::to_string(time) + (is_text ? " text on " : " tick on ") +
                           std::to_string(cpu));
        events[cpu] += static_cast<char>(is_text ? 2 : 1);
        for (unsigned byte = 0; byte < 4; ++byte)
          events[cpu] += static_cast<char>(time >> 8 * byte & 0xff);
        events[cpu] += is_text ? std::string("abc\0", 4) : "v";
      }
    }
    for (std::uint32_t cpu = 0; cpu < 2; ++cpu) {
      streams[cpu] += bytes_of(PacketText{.begin = begin,
                                          .end = begin + 2 * kEvents - 1,
                                          .sequence = number,
                                          .cpu = cpu,
                                          .instance = cpu,
                                          .tail = events[cpu]});
    }
  }
  for (std::uint32_t cpu = 0; cpu < 2; ++cpu)
    folder.write("s" + std::to_string(cpu), streams[cpu]);
  EXPECT_TRUE(read(folder) == expected);
  const auto all = read_all(folder);
  EXPECT_EQ(all.size(), 2 * (kPackets * (kEvents + 2) + 2));  // with begins and ends
  EXPECT_TRUE(read_all_ahead(folder) == all);
}

// Between any two events it looks for all packets that it can look for.
template <typename Consume>
void read_while_scanning(const TraceFolder& folder, const Consume& consume) {
  const std::vector<std::filesystem::path> paths{folder.path()};
  analysis::ctf::TraceReader reader(paths);
  analysis::EventBatch batch(1);
  reader.read(batch, [&](analysis::EventBatch& filled) -> analysis::EventBatch& {
    while (reader.scan_ahead()) {
    }
    filled.each(consume);
    filled.clear();
    return filled;
  });
}

TEST(ScanAhead, ChangesNothingThatIsRead) {
  constexpr std::uint64_t kMany = 20'000;  // more bytes than are in memory at a time
  TraceFolder folder;
  folder.write("metadata", metadata());
  for (std::uint32_t cpu = 0; cpu < 2; ++cpu) {
    std::string bytes;
    std::uint64_t time = cpu;
    for (std::uint64_t number = 0; number < 6; ++number) {
      PacketText packet{.begin = time, .sequence = number, .cpu = cpu, .instance = cpu};
      for (std::uint64_t i = 0; i < (number % 2 == 0 ? kMany : 3); ++i)
        packet.ticks.push_back({.time = time += 5, .value = static_cast<std::uint8_t>(i)});
      packet.end = time;
      if (number == 3) packet.tail = "\x07";  // an event of no class
      bytes += bytes_of(packet);
      if (number == 2) folder.write("first" + std::to_string(cpu), std::exchange(bytes, ""));
    }
    folder.write("second" + std::to_string(cpu), bytes);
  }
  const auto expected = read_all(folder);
  ASSERT_GT(expected.size(), 6 * kMany);
  std::size_t next = 0;
  int damaged = 0;
  read_while_scanning(folder, [&](const analysis::Event& event) {
    ASSERT_LT(next, expected.size());
    const auto& line = expected[next++];
    if (std::holds_alternative<analysis::OtherEvent>(event.body)) {
      EXPECT_THAT(line, HasSubstr(" " + std::to_string(event.head.time.ns) + " tick on"));
    }
    if (std::holds_alternative<analysis::DamagedPacket>(event.body)) ++damaged;
  });
  EXPECT_EQ(next, expected.size());
  EXPECT_EQ(damaged, 2);
}

// Elements of a field are in memory that packets of a stream share.
TEST(ScanAhead, LeavesTheElementsOfFields) {
  TraceFolder folder;
  folder.write("metadata", metadata() +
                               "event { id = 3; stream_id = 0; name = \"cie:thread_sched\";"
                               " fields := struct { u8 n; u32 cpus[n]; u8 tid; u8 policy; u8 flags;"
                               " u8 nice; u8 priority; u8 runtime_ns; u8 deadline_ns;"
                               " u8 period_ns; u8 error; }; };\n");
  const std::string others(9, '\0');
  std::string bytes;
  for (std::uint32_t number = 0; number < 3; ++number) {
    PacketText packet{.begin = number * 10U, .end = number * 10U + 9, .sequence = number};
    for (std::uint32_t i = 1; i <= 3; ++i) {
      const auto cpu = static_cast<char>(number * 3 + i);
      packet.tail += {'\x03', static_cast<char>(packet.begin + i), 0, 0, 0, '\x01', cpu, 0, 0, 0};
      packet.tail += others;
    }
    bytes += bytes_of(packet);
  }
  folder.write("s", bytes);
  std::vector<std::uint32_t> cpus;
  read_while_scanning(folder, [&cpus](const analysis::Event& event) {
    const auto* audit = std::get_if<analysis::ThreadSched>(&event.body);
    if (audit != nullptr) cpus.insert(cpus.end(), audit->cpus.begin(), audit->cpus.end());
  });
  EXPECT_THAT(cpus, testing::ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 9));
}

TEST(ReadAhead, PassesOnWhyNothingCanBeRead) {
  TraceFolder folder;
  folder.write("metadata", "nonsense");
  EXPECT_THAT([&] { read_all_ahead(folder); },
              ThrowsMessage<analysis::UnreadableTrace>(HasSubstr("metadata")));
  folder.write("metadata", metadata());
  folder.write("s0", std::string(100, 'x'));
  EXPECT_THAT([&] { read_all_ahead(folder); },
              ThrowsMessage<analysis::UnreadableTrace>(HasSubstr("cannot read any packet")));
}

TEST(ReadAhead, EndsWithAConsumerThatFails) {
  TraceFolder folder;
  write_long_trace(folder);
  const std::vector<std::filesystem::path> paths{folder.path()};
  int seen = 0;
  const auto fail_late = [&seen](const analysis::Event&) {
    if (++seen == 700) throw std::runtime_error("no space left");
  };
  analysis::ctf::TraceReader reader(paths);
  const auto consume = [&](const analysis::EventBatch& batch) { batch.each(fail_late); };
  EXPECT_THAT([&] { analysis::ctf::read_ahead(reader, consume); },
              ThrowsMessage<std::runtime_error>("no space left"));
  EXPECT_EQ(seen, 700);
}

TEST(EventBatch, KeepsWhatEventsView) {
  analysis::EventBatch batch(2);
  {
    const std::string name = "a process that runs no more";
    const std::vector<std::uint32_t> cpus{1, 3};
    analysis::Event event{};
    event.head.time = {17};
    event.body = analysis::ProcessName{.name = name};
    batch.keep(batch.add() = event);
    event.body = analysis::ThreadSched{.tid = 4, .moment = std::nullopt, .cpus = cpus};
    batch.keep(batch.add() = event);
  }
  EXPECT_TRUE(batch.is_full());
  ASSERT_EQ(batch.events().size(), 2U);
  EXPECT_EQ(batch.events()[0].head.time.ns, 17);
  EXPECT_EQ(std::get<analysis::ProcessName>(batch.events()[0].body).name,
            "a process that runs no more");
  const auto kept = std::get<analysis::ThreadSched>(batch.events()[1].body).cpus;
  EXPECT_THAT(std::vector(kept.begin(), kept.end()), testing::ElementsAre(1, 3));
  batch.clear();
  EXPECT_TRUE(batch.events().empty());
}

TEST(EventBatch, SaysWhichEventsFollow) {
  constexpr std::int64_t kEvents = 20;
  analysis::EventBatch batch(kEvents);
  for (std::int64_t time = 0; time < kEvents; ++time) {
    auto& event = batch.add();
    event = {};
    event.head.time = {time};
    batch.keep(event);
  }
  using Times = std::set<std::int64_t>;
  std::int64_t now = 0;
  struct Hints {
    const std::int64_t& now;
    Times& all_far;
    Times& all_near;
    Times& all_next;

    void far(const analysis::Event& event) const { note(event, all_far, nullptr); }
    void near(const analysis::Event& event) const { note(event, all_near, &all_far); }
    void next(const analysis::Event& event) const { note(event, all_next, &all_near); }

   private:
    // Once, before its turn, and not before it was told of the time before.
    void note(const analysis::Event& event, Times& told, const Times* before) const {
      const auto time = event.head.time.ns;
      EXPECT_GT(time, now);
      EXPECT_TRUE(told.insert(time).second) << time;
      const bool is_early = time < 9;  // which follow at once
      if (before != nullptr && !is_early) {
        EXPECT_TRUE(before->contains(time)) << time;
      }
    }
  };
  Times far;
  Times near;
  Times next;
  batch.each(Hints{now, far, near, next},
             [&](const analysis::Event& event) { EXPECT_EQ(event.head.time.ns, now++); });
  EXPECT_EQ(now, kEvents);
  EXPECT_EQ(far.size(), 11U);
  EXPECT_EQ(near.size(), 14U);
  EXPECT_EQ(next.size(), 17U);
}

TEST(TaskName, IsACopyOfWhatTheKernelHasRoomFor) {
  const auto copied = [](std::string name) {
    const analysis::TaskName task = std::string_view(name);
    name.assign(name.size(), '?');
    return std::string(std::string_view(task));
  };
  EXPECT_EQ(copied(""), "");
  EXPECT_EQ(copied("kworker/1:2"), "kworker/1:2");
  EXPECT_EQ(copied("sixteen letters."), "sixteen letters.");
  EXPECT_EQ(copied("more than any kernel writes"), "more than any ke");
}

TEST(EventBatch, GivesEachEventToItsTranslatorOnce) {
  analysis::EventBatch batch(4);
  const auto add = [&batch](std::int64_t time) -> analysis::Event& {
    auto& event = batch.add();
    event = {.head = {.time = {time}, .cpu = {}, .pid = {}, .tid = {}}, .body = {}};
    return event;
  };
  const auto times = [](std::span<const analysis::Event> events) {
    std::vector<std::int64_t> all;
    for (const auto& event : events)
      all.push_back(event.head.time.ns);
    return all;
  };
  add(1);
  add(2);
  auto& third = add(3);
  EXPECT_EQ(times(batch.take_new_before(third)), (std::vector<std::int64_t>{1, 2}));
  EXPECT_TRUE(batch.take_new().empty());
  auto& fourth = add(4);
  EXPECT_TRUE(batch.take_new_before(fourth).empty());
  batch.clear();
  add(5);
  EXPECT_EQ(times(batch.take_new()), (std::vector<std::int64_t>{5}));
}

// What a process says of itself in the same batch counts for the event after it, not the one before.
TEST(EventTranslator, HeedsWhatComesBeforeAnEvent) {
  const auto& started = *analysis::find_translation("ros2:callback_start");
  analysis::EventTranslator translator;
  analysis::EventBatch batch(3);
  std::array<analysis::Field, analysis::kMaxSlots> fields{};
  fields[0].kind = analysis::Field::Kind::integer;
  fields[0].number = 0x30;
  const auto add = [&batch]() -> analysis::Event& {
    auto& event = batch.add();
    event.head = {.time = {1}, .cpu = 0, .pid = 10, .tid = 10};
    return event;
  };
  translator.translate(add(), started, analysis::Payload(fields.data()), batch);
  auto& own = add();
  own.body.emplace<analysis::RunBegin>();
  batch.keep(own);
  translator.translate(add(), started, analysis::Payload(fields.data()), batch);
  std::vector<bool> starts;
  batch.each([&starts](const analysis::Event& event) {
    if (std::holds_alternative<analysis::CallbackStart>(event.body)) {
      starts.push_back(event.head.is_derived);
    } else if (std::holds_alternative<analysis::RunBegin>(event.body)) {
      starts.push_back(false);
    }
  });
  EXPECT_EQ(starts, (std::vector<bool>{true, false}));
}

// Whoever reads files only counts them.
TEST(EventTranslator, SaysWhichEventsTellNothing) {
  const auto& wait = *analysis::find_translation("ros2:rclcpp_executor_wait_for_work");
  const auto& ready = *analysis::find_translation("ros2:rclcpp_executor_get_next_ready");
  analysis::EventTranslator translator;
  analysis::EventBatch batch(8);
  std::array<analysis::Field, analysis::kMaxSlots> fields{};
  fields[0].kind = analysis::Field::Kind::integer;
  fields[0].number = -1;  // the timeout
  const auto tells = [&](const analysis::Translation& translation) {
    auto& event = batch.add();
    event.head = {.time = {1}, .cpu = 0, .pid = 10, .tid = 10};
    return translator.translate(event, translation, analysis::Payload(fields.data()), batch);
  };
  EXPECT_TRUE(tells(wait));   // the clocks, with the host's first event
  EXPECT_TRUE(tells(ready));  // the end of the wait
  EXPECT_FALSE(tells(ready));
  EXPECT_FALSE(tells(wait));
  EXPECT_FALSE(tells(wait));
  EXPECT_TRUE(tells(ready));
  std::size_t wakeups = 0;
  batch.each([&wakeups](const analysis::Event& event) {
    if (std::holds_alternative<analysis::ThreadWakeup>(event.body)) ++wakeups;
  });
  EXPECT_EQ(wakeups, 2);
}

TEST(EventBatch, GivesWhatFollowsRightAfterItsCause) {
  analysis::EventBatch batch(3);
  for (const std::int64_t time : {1, 2, 3}) {
    auto& event = batch.add();
    event = {.head = {.time = {time}, .cpu = {}, .pid = {}, .tid = {}},
             .body = analysis::OtherEvent{}};
    batch.keep(event);
  }
  const auto derive = [&batch](const analysis::Event* cause, std::int64_t time) {
    const std::string name = "node " + std::to_string(time);
    batch.derive(cause, {.time = {time}, .cpu = {}, .pid = {}, .tid = {}},
                 analysis::NodeInit{.node = {}, .name = name});
  };
  derive(&batch.events()[0], 10);
  derive(&batch.events()[2], 30);
  derive(&batch.events()[2], 31);
  derive(nullptr, 40);
  std::vector<std::string> consumed;
  batch.each([&consumed](const analysis::Event& event) {
    const auto* node = std::get_if<analysis::NodeInit>(&event.body);
    EXPECT_EQ(event.head.is_derived, node != nullptr);
    consumed.push_back(node != nullptr ? std::string(node->name)
                                       : std::to_string(event.head.time.ns));
  });
  EXPECT_THAT(consumed,
              testing::ElementsAre("1", "node 10", "2", "3", "node 30", "node 31", "node 40"));
}

// What follows from the first comes after what followed before; that from the second takes its place.
TEST(EventBatch, PutsWhatFollowsAloneInThePlaceOfItsCause) {
  analysis::EventBatch batch(2);
  for (int round = 0; round < 2; ++round) {  // a place is of the trace again when it is used again
    for (const std::int64_t time : {1, 2}) {
      auto& event = batch.add();
      EXPECT_FALSE(event.head.is_derived || event.head.stands_for_cause);
      event.head.time = {time};
      event.body = analysis::OtherEvent{};
      batch.keep(event);
    }
    const auto* first = &batch.events()[0];
    const auto* second = &batch.events()[1];
    batch.derive(first, first->head, analysis::NodeInit{});
    batch.derive_instead<analysis::CallbackStart>(first, first->head).seq = 1;
    auto& instead = batch.derive_instead<analysis::CallbackStart>(second, second->head);
    EXPECT_EQ(std::pair(instead.seq, instead.writer_gid),
              std::pair(std::uint64_t{0}, std::uint64_t{0}));
    instead.seq = 2;
    instead.writer_gid = 7;
    batch.derive(second, second->head, analysis::NodeInit{});
    std::string consumed;
    std::size_t of_the_trace = 0;
    batch.each([&](const analysis::Event& event) {
      const auto* start = std::get_if<analysis::CallbackStart>(&event.body);
      consumed += start != nullptr ? std::to_string(start->seq) : event.head.is_derived ? "n" : "o";
      if (!event.head.is_derived || event.head.stands_for_cause) ++of_the_trace;
    });
    EXPECT_EQ(consumed, "on12n");
    EXPECT_EQ(of_the_trace, 2U);
    batch.clear();
  }
}

// As many values as a trace says, and a batch of such events would take gigabytes.
TEST(EventBatch, IsFullOfFewEventsThatAreLarge) {
  const std::vector<analysis::FieldValue> fields(analysis::EventBatch::kMostShown /
                                                 sizeof(analysis::FieldValue) / 2);
  analysis::EventBatch batch(8);
  for (int i = 0; i < 3; ++i) {
    EXPECT_FALSE(batch.is_full());
    auto& event = batch.add();
    event.body = analysis::OtherEvent{.name = "large", .fields = fields};
    batch.keep(event);
  }
  EXPECT_TRUE(batch.is_full());
  batch.clear();
  EXPECT_FALSE(batch.is_full());
}

}  // namespace
}  // namespace cie::test
