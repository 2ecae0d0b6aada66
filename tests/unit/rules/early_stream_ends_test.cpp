// A stream of applications that ends before the others of its trace was cut: what was registered or read back since
// is not known, and what fails without it is undecided.
#include "support/verdicts.hpp"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using testing::HasSubstr;

constexpr StreamIndex kUserStream{0};
constexpr std::int64_t kEnd = 100'000'000;

// Two callbacks on one thread, the second one from 50 ms on, in a process whose totals are missing.
constexpr auto kShared = R"(
  process app crash
  group both
  callback fusion group=both
  callback plan group=both pooled
  10000000 start fusion
  12000000 end fusion
  50000000 start plan on=fusion
  52000000 end plan on=fusion
  99000000 start plan on=fusion
  99500000 end plan on=fusion)";

// As if the machine had more CPUs: streams without events that end then.
TextTrace with_streams(const std::string& text, const std::vector<std::int64_t>& ends,
                       std::string_view path = {}) {
  auto trace = trace_of(text);
  auto& events = trace.events;
  const auto begin = *std::ranges::find_if(events, [](const Event& event) {
    return event.head.stream == kUserStream && std::holds_alternative<StreamBegin>(event.body);
  });
  for (auto& event : events) {
    if (auto* stream = std::get_if<StreamBegin>(&event.body)) {
      if (!path.empty()) stream->path = path;
    }
    const bool is_end = std::holds_alternative<PacketEnd>(event.body) ||
                        std::holds_alternative<StreamEnd>(event.body);
    if (event.head.stream == kUserStream && is_end) event.head.time.ns = kEnd;
  }
  std::uint32_t index = 20;
  for (const auto end : ends) {
    const StreamIndex stream{index++};
    const auto add = [&](Timestamp time, const EventBody& body) {
      events.push_back({.head = {.time = time, .stream = stream, .cpu = {}, .pid = {}, .tid = {}},
                        .body = body});
    };
    add(begin.head.time, begin.body);
    add(begin.head.time, PacketBegin{});
    add({end}, PacketEnd{});
    add({end}, StreamEnd{});
  }
  std::ranges::stable_sort(events, {}, [](const Event& event) { return event.head.time; });
  return trace;
}

TEST(EarlyStreamEnd, LeavesUndecidedWhatFailsByLaterEvents) {
  const auto m2 = [](const std::vector<std::int64_t>& ends) {
    return Verified(with_streams(kShared, ends)).of("M2", "thread 101");
  };
  EXPECT_EQ(m2({kEnd, kEnd, kEnd}), Verdict::fail);
  EXPECT_EQ(m2({kEnd, kEnd, 30'000'000}), Verdict::inconclusive);
  EXPECT_EQ(m2({kEnd, kEnd, 60'000'000}), Verdict::fail) << "both had started by then";
  EXPECT_EQ(m2({kEnd, kEnd, kEnd - 10'000'000}), Verdict::fail) << "they end as one";
  EXPECT_EQ(m2({30'000'000}), Verdict::fail) << "each at its own last event: no tracer's";
  EXPECT_THAT(
      Verified(with_streams(kShared, {kEnd, kEnd, 30'000'000})).evidence("M2", "thread 101"),
      HasSubstr("ends here, before the others"));
}

// LTTng flushes the buffer of an idle CPU in a packet that lasts no time.
TEST(EarlyStreamEnd, OfAPacketWithoutEventsOrLengthEndsNothing) {
  auto trace = with_streams(kShared, {kEnd, kEnd, 30'000'000});
  for (auto& event : trace.events) {
    const bool is_begin = std::holds_alternative<PacketBegin>(event.body);
    if (event.head.stream == StreamIndex{22} && is_begin) event.head.time.ns = 30'000'000;
  }
  std::ranges::stable_sort(trace.events, {}, [](const Event& event) { return event.head.time; });
  EXPECT_EQ(Verified(trace).of("M2", "thread 101"), Verdict::fail);
}

// The first thread is still there when the second one runs the callback; that it had not ended, and its tid was not
// somebody else's since, is not known.
TEST(EarlyStreamEnd, LeavesUndecidedWhatFailsByALaterSignOfLife) {
  constexpr auto kMoved = R"(
  process app crash
  thread t1 pool tid=301
  thread t2 pool tid=302
  callback fusion pooled
  10000000 start fusion on=t1
  12000000 end fusion on=t1
  50000000 begin t2
  51000000 start fusion on=t2
  52000000 end fusion on=t2
  90000000 finish t1)";
  const auto m3 = [&](std::int64_t end) {
    return Verified(with_streams(kMoved, {kEnd, kEnd, end})).of("M3", "callback fusion");
  };
  EXPECT_EQ(m3(kEnd), Verdict::fail);
  EXPECT_EQ(m3(30'000'000), Verdict::inconclusive);
}

// Its tracers end all as one, so whatever is early was cut: one of two, or each at its own time.
TEST(EarlyStreamEnd, OfLttngIsOneWhateverTheOthersDo) {
  const auto m2 = [](const std::vector<std::int64_t>& ends) {
    auto trace = with_streams(kShared, ends);
    for (auto& event : trace.events) {
      if (auto* stream = std::get_if<StreamBegin>(&event.body))
        stream->writer = PacketWriter::lttng;
    }
    return Verified(trace).of("M2", "thread 101");
  };
  EXPECT_EQ(m2({30'000'000}), Verdict::inconclusive);
  EXPECT_EQ(m2({30'000'000, 45'000'000, 70'000'000}), Verdict::inconclusive);
  EXPECT_EQ(m2({kEnd}), Verdict::fail);
}

// The first session recorded all of it, the second one was cut.
TEST(EarlyStreamEnd, OfTheLastSessionCountsToo) {
  auto trace = with_streams(kShared, {kEnd, kEnd, 30'000'000});
  const auto add = [&trace](std::int64_t time, const EventBody& body) {
    trace.events.push_back(
        {.head = {.time = {time}, .stream = StreamIndex{40}, .cpu = {}, .pid = {}, .tid = {}},
         .body = body});
  };
  auto other = std::get<StreamBegin>(std::ranges::find_if(trace.events, [](const Event& event) {
                                       return event.head.stream == kUserStream &&
                                              std::holds_alternative<StreamBegin>(event.body);
                                     })->body);
  other.trace = 7;
  other.channel = 7;
  add(0, other);
  add(0, PacketBegin{});
  add(15'000'000, PacketEnd{});
  add(15'000'000, StreamEnd{});
  for (auto& event : trace.events) {  // of a process: in the session that ends first
    const bool is_of_user = event.head.pid && event.head.stream == kUserStream;
    if (is_of_user && event.head.time.ns < 15'000'000) event.head.stream = StreamIndex{40};
  }
  // The second one has the process announce what there is.
  auto announced = *std::ranges::find_if(trace.events, [](const Event& event) {
    return std::holds_alternative<RunBegin>(event.body);
  });
  announced.head.time.ns = 16'000'000;
  announced.head.stream = kUserStream;
  std::get<RunBegin>(announced.body).moment = RunMoment::announce;
  trace.events.push_back(announced);
  std::ranges::stable_sort(trace.events, {}, [](const Event& event) { return event.head.time; });
  EXPECT_EQ(Verified(trace).of("M2", "thread 101"), Verdict::inconclusive);
}

// As `babeltrace2 --end T -o ctf` writes it: a stream ends with its last packet.
TEST(EarlyStreamEnd, SaysNothingInACopy) {
  auto trace = with_streams(kShared, {kEnd, kEnd, 30'000'000});
  for (auto& event : trace.events) {
    if (auto* stream = std::get_if<StreamBegin>(&event.body)) stream->writer = PacketWriter::copier;
  }
  EXPECT_EQ(Verified(trace).of("M2", "thread 101"), Verdict::fail);
}

// There LTTng ends a stream with its last packet, and a CPU may have been quiet.
TEST(EarlyStreamEnd, SaysNothingInAChunk) {
  const auto m2 = [](std::string_view path, const std::vector<Recording>& recordings = {}) {
    return Verified(with_streams(kShared, {kEnd, kEnd, 30'000'000}, path), recordings)
        .of("M2", "thread 101");
  };
  constexpr auto kOfLttng =
      "run/archives/20261129T042623+0000-20261129T042624-0500-3/ust/uid/0/64-bit/events_0";
  EXPECT_EQ(m2(kOfLttng), Verdict::fail);
  EXPECT_EQ(m2("run/archives/20261129T042623+0000-20261129T042624-0500/events_0"),
            Verdict::inconclusive);
  const auto chunk = [](const std::vector<std::string>& problems) {
    RecordingManifest manifest;
    manifest.chunk = 3;
    manifest.problems = problems;
    return std::vector<Recording>{{.name = "run/third/", .manifest = manifest}};
  };
  EXPECT_EQ(m2("run/third/events_0", chunk({})), Verdict::fail);
  const auto here = std::filesystem::current_path().string();
  EXPECT_EQ(m2(here + "/run/third/events_0", chunk({})), Verdict::fail);
  EXPECT_EQ(m2("run/fourth/events_0", chunk({})), Verdict::inconclusive);
  EXPECT_EQ(m2("run/third/events_0", chunk({"the consumer daemon ended"})), Verdict::inconclusive);
}

TEST(EarlyStreamEnd, LeavesUndecidedWhatALaterReadBackMayExplain) {
  constexpr auto kWrong = R"(
  process app crash
  callback fusion
  -100 initial fusion policy=other
  -90 applied fusion policy=fifo priority=70 cpus=0
  10000000 start fusion
  12000000 end fusion
  99000000 start fusion
  99500000 end fusion)";
  constexpr auto kSpec =
      "callback_groups:\n  - {id: fusion, policy: SCHED_FIFO, priority: 80, affinity: [0]}\n";
  const auto s1 = [&](std::int64_t end) {
    return Verified(with_streams(kWrong, {kEnd, kEnd, end}), kSpec).of("S1", "callback fusion");
  };
  EXPECT_EQ(s1(kEnd), Verdict::fail);
  EXPECT_EQ(s1(30'000'000), Verdict::inconclusive);
}

// Whatever streams were cut: `run_end` and `thread_fini` count what they would hold.
TEST(EarlyStreamEnd, TakesNothingThatTotalsProve) {
  auto text = std::string(kShared);
  text.erase(text.find(" crash"), 6);
  EXPECT_EQ(Verified(with_streams(text, {kEnd, kEnd, 30'000'000})).of("M2", "thread 101"),
            Verdict::fail);
}

}  // namespace
}  // namespace cie::test
