// The kernel trace that the recorder writes, read back by babeltrace2 and by our reader.
#include "kernel/ctf_stream.hpp"

#include <cie/analysis/event.hpp>

#include "ctf/stream_check.hpp"
#include "kernel/kernel_events.hpp"
#include "kernel_pages.hpp"
#include "support/temporary_directory.hpp"
#include "system/error.hpp"

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <ctf/native_reader.hpp>
#include <gtest/gtest.h>

namespace cie::record {
namespace {

namespace fs = std::filesystem;

const TraceClock kClock{.uuid = "5a17c0de-0b07-4b1d-9abc-0123456789ab",
                        .offset_ns = 1'700'000'000'000'000'000};

class KernelTrace : public ::testing::Test {
 protected:
  KernelTrace() {
    std::ofstream(root_ / "metadata") << kernel_metadata(uuid_, kClock, "bpf");
    encoder_.learn(kernel_event_classes().front(), test::switch_format());
  }

  CtfStream stream(std::uint32_t cpu, std::uint64_t begin) const {
    return CtfStream(opened_, uuid_, cpu, begin);
  }

  void add(CtfStream& stream, std::uint64_t time, std::int32_t prev, std::int32_t next) {
    auto bytes =
        test::PageText(time)
            .long_record(0, test::bytes_of(test::SwitchRecord{.prev_comm = "prev",
                                                              .prev_pid = prev,
                                                              .prev_prio = 120,
                                                              .prev_state = 1,
                                                              .next_comm = "next",
                                                              .next_pid = next,
                                                              .next_prio = next == 0 ? 120 : 79}))
            .bytes();
    RingBufferPage page;
    page.load(bytes);
    std::string event;
    ASSERT_TRUE(encoder_.encode(page.next().value(), event));
    stream.add(time, event);
  }

  // One line per event, packet and loss.
  std::vector<std::string> read() const {
    using namespace analysis;
    std::vector<std::string> lines;
    const std::vector<fs::path> traces{root_};
    ctf::read_traces(traces, [&lines](const Event& event) {
      const std::string at = std::to_string(event.head.time.ns) + ' ';
      std::visit(
          Overloaded{[&](const SchedSwitch& e) {
                       lines.push_back(
                           at + "cpu " + std::to_string(event.head.cpu.value_or(-1)) + ' ' +
                           std::string(e.prev_comm) + ' ' + std::to_string(e.prev_tid) + " prio " +
                           std::to_string(e.prev_prio) + " state " + std::to_string(e.prev_state) +
                           " -> " + std::string(e.next_comm) + ' ' + std::to_string(e.next_tid) +
                           " prio " + std::to_string(e.next_prio));
                     },
                     [&](const Discarded& e) {
                       lines.push_back(std::to_string(e.begin.ns) + ".." +
                                       std::to_string(e.end.ns) + " lost " +
                                       std::to_string(e.count.value_or(0)));
                     },
                     [&](const DamagedPacket& e) { lines.push_back(std::string(e.reason)); },
                     [&](const PacketBegin&) { lines.push_back(at + "packet"); },
                     [&](const PacketEnd&) { lines.push_back(at + "ends"); }, [](const auto&) {}},
          event.body);
    });
    return lines;
  }

  std::string babeltrace2() const {
    const std::string command = "babeltrace2 --clock-seconds '" + root_.string() + "' 2>&1";
    const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
    std::string text;
    char part[4096];
    while (pipe && fgets(part, sizeof part, pipe.get()) != nullptr)
      text += part;
    return text;
  }

  const test::TemporaryDirectory directory_;
  const fs::path root_ = directory_.path();
  const Directory opened_ = Directory::open(root_);
  TraceUuid uuid_ = random_uuid();
  KernelEventEncoder encoder_;
};

using Lines = std::vector<std::string>;

TEST_F(KernelTrace, IsReadAsItWasWrittenInTheKernelsScaleOfPriorities) {
  CtfStream cpu = stream(3, 100);
  add(cpu, 110, 0, 42);
  add(cpu, 120, 42, 0);
  cpu.finish(150, 0);
  EXPECT_EQ(read(), (Lines{"100 packet", "110 cpu 3 prev 0 prio 120 state 1 -> next 42 prio 79",
                           "120 cpu 3 prev 42 prio 120 state 1 -> next 0 prio 120", "150 ends"}));
}

TEST_F(KernelTrace, SaysWhenceTheKernelsEventsCame) {
  EXPECT_NE(kernel_metadata(uuid_, kClock, "bpf").find("recorded_by = \"cie-record, from bpf\";"),
            std::string::npos);
}

TEST_F(KernelTrace, IsReadByBabeltrace2OnTheClockOfItsMetadata) {
  CtfStream cpu = stream(1, 100);
  add(cpu, 1'000'000'110, 7, 42);
  cpu.finish(1'000'000'150, 0);
  const std::string text = babeltrace2();
  EXPECT_NE(text.find("[1700000001.000000110]"), std::string::npos) << text;
  EXPECT_NE(text.find("sched_switch: { cpu_id = 1 }, { prev_comm = \"prev\", prev_tid = 7, "
                      "prev_prio = 20, prev_state = 1, next_comm = \"next\", next_tid = 42, "
                      "next_prio = -21 }"),
            std::string::npos)
      << text;
}

TEST_F(KernelTrace, PacketsFollowOneAnotherWithoutAGapOfTime) {
  CtfStream cpu = stream(0, 100);
  add(cpu, 110, 1, 2);
  cpu.flush();
  cpu.flush();  // nothing new: no packet
  add(cpu, 130, 2, 1);
  cpu.finish(200, 0);
  const Lines lines = read();
  ASSERT_EQ(lines.size(), 6U);
  EXPECT_EQ(lines[0], "100 packet");
  EXPECT_EQ(lines[2], "110 ends");
  EXPECT_EQ(lines[3], "110 packet");
  EXPECT_EQ(lines[5], "200 ends");
}

TEST_F(KernelTrace, SaysWhereEventsWereLostAndHowMany) {
  CtfStream cpu = stream(0, 100);
  add(cpu, 110, 1, 2);
  cpu.lose(170, 5);
  add(cpu, 170, 3, 4);
  cpu.finish(200, 7);
  Lines losses;
  for (const std::string& line : read()) {
    if (line.find("lost") != std::string::npos) losses.push_back(line);
  }
  EXPECT_EQ(losses, (Lines{"110..170 lost 5", "170..200 lost 2"}));
  const auto streams = check_streams(root_.parent_path() / root_.filename());
  ASSERT_EQ(streams.size(), 1U);
  EXPECT_EQ(streams.front().discarded_events, 7U);
  EXPECT_EQ(streams.front().lost_packets, 0U);
  EXPECT_FALSE(streams.front().is_damaged);
}

TEST_F(KernelTrace, BeginsANewPacketWhenOneIsFull) {
  CtfStream cpu = stream(0, 0);
  constexpr std::size_t kEvents = 5000;
  for (std::size_t i = 0; i < kEvents; ++i) {
    add(cpu, 10 + i, 1, 1);
  }
  cpu.finish(10 + kEvents, 0);
  EXPECT_EQ(cpu.events(), kEvents);
  std::size_t packets = 0;
  std::size_t events = 0;
  for (const std::string& line : read()) {
    if (line.ends_with("packet")) ++packets;
    if (line.find("cpu") != std::string::npos) ++events;
  }
  EXPECT_EQ(events, kEvents);
  EXPECT_GT(packets, 1U);
}

TEST_F(KernelTrace, ACpuThatDidNothingHasNoFile) {
  CtfStream cpu = stream(0, 100);
  cpu.flush();
  cpu.finish(200, 0);
  EXPECT_FALSE(fs::exists(root_ / "sched_0"));
}

TEST_F(KernelTrace, SaysWhenAFileCannotBeWritten) {
  CtfStream cpu = stream(0, 100);
  fs::remove_all(root_);
  EXPECT_THROW(cpu.lose(110, 1), std::system_error);
}

constexpr const char* kLttngClock =
    "clock {\n\tname = \"monotonic\";\n\tuuid = \"cafe\";\n\tdescription = \"Monotonic Clock\";\n"
    "\tfreq = 1000000000; /* Frequency, in Hz */\n"
    "\t/* clock value offset from Epoch is: offset * (1/freq) */\n\toffset = 1795169;\n};\n";

TEST(ReadClock, FindsOffsetAndUuidInTextAndInPackets) {
  TraceClock clock;
  ASSERT_TRUE(read_clock(std::string("/* CTF 1.8 */\n") + kLttngClock, clock));
  EXPECT_EQ(clock.uuid, "cafe");
  EXPECT_EQ(clock.offset_ns, 1'795'169U);

  // Two packets, cut in the middle of the number, each with padding at its end.
  const std::string text = kLttngClock;
  const std::size_t cut = text.find("95169");
  std::string bytes;
  for (const std::string& part : {text.substr(0, cut), text.substr(cut)}) {
    const auto put = [&bytes](std::uint32_t value) {
      bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
    };
    put(0x75D11D57);
    bytes.append(16, 'u');
    put(0);
    put(static_cast<std::uint32_t>((37 + part.size()) * 8));
    put(static_cast<std::uint32_t>((37 + part.size() + 10) * 8));
    bytes.append(5, '\1');
    bytes += part + std::string(10, '\0');
  }
  clock = {};
  ASSERT_TRUE(read_clock(bytes, clock));
  EXPECT_EQ(clock.offset_ns, 1'795'169U);
}

TEST(ReadClock, KnowsWhenThereIsNone) {
  TraceClock clock = kClock;
  for (const char* text : {"", "trace {};", "clock {", "clock { offset = x; uuid = \"a\"; };",
                           "clock { offset_s = 5; uuid = \"a\"; };", "\x57\x1d\xd1\x75"}) {
    EXPECT_FALSE(read_clock(text, clock)) << text;
  }
  EXPECT_EQ(clock.uuid, kClock.uuid);
}

}  // namespace
}  // namespace cie::record
