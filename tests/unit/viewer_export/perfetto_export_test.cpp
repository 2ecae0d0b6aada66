// What the file holds, read back field by field. That Perfetto understands it the same way is
// checked by tests/browser/perfetto.
#include <cie/viewer_export/perfetto_export.hpp>

#include "perfetto_file.hpp"
#include "sample_instances.hpp"

#include <cstdint>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <zlib.h>

namespace cie::viewer_export {
namespace {

using test::decode;

std::string exported(const PerfettoOptions& options, PerfettoCounts* counts = nullptr,
                     std::optional<std::int64_t> clock_offset_ns = {}) {
  PerfettoExport perfetto(options);
  test::feed_application(perfetto);
  std::ostringstream out;
  auto analyzed = test::application_result();
  analyzed.report.trace.clock_offset_ns = clock_offset_ns;
  const auto result = perfetto.write(out, analyzed);
  if (counts != nullptr) {
    *counts = result;
  }
  return out.str();
}

TEST(Perfetto, CountsWhatItDraws) {
  PerfettoCounts counts;
  exported({}, &counts);
  EXPECT_EQ(counts.callback_slices, 10U) << "eleven instances, one of which ends before its start";
  EXPECT_EQ(counts.waits, 9U) << "all but the open one, whose release is not known";
  EXPECT_EQ(counts.publications, 3U);
  EXPECT_EQ(counts.flows, 3U);
  EXPECT_EQ(counts.backward_flows, 1U);
  EXPECT_EQ(counts.sched_slices, 3U);
  EXPECT_EQ(counts.wakings, 2U) << "of the third nobody knows by whom";
  EXPECT_EQ(counts.response_values, 9U) << "all but the open one";
  // Of /track, released and started: up at 1 450, down at 1 500, 2 150 and 2 600, 3 000 and 3 100,
  // 3 300 and 3 350. Of /drive, whose message one instance took: 1 460 and 1 600.
  EXPECT_EQ(counts.queue_changes, 10U);
  EXPECT_EQ(counts.violations, 3U);
  EXPECT_EQ(counts.skipped, 1U);
}

TEST(Perfetto, StartsWithClocksSystemAndDescriptors) {
  const auto file = decode(exported({}, nullptr, 5'000));
  ASSERT_GE(file.kinds.size(), 9U);
  EXPECT_EQ(file.kinds[0], 6) << "the clock snapshot";
  EXPECT_EQ(file.kinds[1], 45) << "the system, which gives task states their letters";
  for (std::size_t i = 2; i < 7; ++i) {
    EXPECT_EQ(file.kinds[i], 60) << "a process and four threads";
  }
  EXPECT_EQ(file.kinds[7], 12) << "the names";
  // One timeline: Perfetto takes kernel events as BOOTTIME, so everything is written as that.
  EXPECT_EQ(file.primary_clock, 6U);
  EXPECT_EQ(file.clocks.at(6), 900U);
  EXPECT_EQ(file.clocks.at(3), 900U);
  EXPECT_EQ(file.clocks.at(1), 5'900U);
}

TEST(Perfetto, NamesThreadsAsTheReportDoes) {
  const auto file = decode(exported({}));
  EXPECT_EQ(file.process_names.at(4001), "demo");
  for (const auto& thread : test::application_report().threads) {
    EXPECT_EQ(file.thread_names.at(static_cast<std::uint64_t>(thread.tid)), thread.name);
  }
}

TEST(Perfetto, CallsCallbacksByShortNamesAndKeepsTheirIds) {
  PerfettoExport perfetto({});
  test::feed_application(perfetto);
  auto analyzed = test::application_result();
  analyzed.report.callbacks.resize(3);
  analyzed.report.callbacks[0].logical_id = "/plan@Timer(20000000)";
  analyzed.report.callbacks[1].logical_id = "/track@Subscription(/points)";
  analyzed.report.callbacks[2].logical_id = "/drive@Subscription(/points)";
  std::ostringstream out;
  perfetto.write(out, analyzed);
  const auto file = decode(out.str());
  std::set<std::string> names;
  for (const auto& [number, name] : file.names)
    names.insert(name);
  EXPECT_TRUE(names.contains("plan timer 20 ms"));
  EXPECT_TRUE(names.contains("track ← /points"));
  std::set<std::string> tracks;
  for (const auto& [uuid, name] : file.tracks)
    tracks.insert(name);
  EXPECT_TRUE(tracks.contains("response time drive ← /points"));
  EXPECT_NE(out.str().find("/plan@Timer(20000000)"), std::string::npos) << "as an argument";
}

TEST(Perfetto, EveryPairOfPublicationAndSubscriberHasAFlowOfItsOwn) {
  const auto file = decode(exported({}));
  std::vector<std::vector<std::uint64_t>> leaving;
  std::map<std::uint64_t, std::uint64_t> arriving;  // flow id, time
  for (const auto& event : file.events) {
    if (event.type == 3 && event.name != 0) {  // the violations' names are not interned
      leaving.push_back(event.flows);
    }
    for (const auto flow : event.ending_flows) {
      EXPECT_TRUE(arriving.emplace(flow, event.time).second) << "two slices end flow " << flow;
    }
  }
  ASSERT_EQ(leaving.size(), 3U);
  ASSERT_EQ(leaving[0].size(), 2U) << "/track and /drive took the first message";
  EXPECT_NE(leaving[0][0], leaving[0][1]);
  EXPECT_EQ((std::set{arriving.at(leaving[0][0]), arriving.at(leaving[0][1])}),
            (std::set<std::uint64_t>{1'500, 1'600}));
  ASSERT_EQ(leaving[1].size(), 1U);
  EXPECT_EQ(arriving.at(leaving[1][0]), 2'600U);
  EXPECT_TRUE(leaving[2].empty()) << "taken before it was published";
  EXPECT_EQ(arriving.size(), 3U);
}

TEST(Perfetto, SlicesOfOneTrackNest) {
  const auto file = decode(exported({}));
  struct Track {
    std::vector<std::uint64_t> ends;
    std::uint64_t begin = 0;
  };
  // In the file each begin is followed by its end, unless it is open.
  std::map<std::uint64_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>> slices;
  int open = 0;
  for (std::size_t i = 0; i < file.events.size(); ++i) {
    if (file.events[i].type == 1) {
      const bool is_ended = i + 1 < file.events.size() && file.events[i + 1].type == 2 &&
                            file.events[i + 1].track == file.events[i].track;
      open += is_ended ? 0 : 1;
      slices[file.events[i].track].emplace_back(file.events[i].time,
                                                is_ended ? file.events[i + 1].time : UINT64_MAX);
    }
  }
  EXPECT_EQ(open, 1) << "an end is never made up";
  for (const auto& [track, of_track] : slices) {
    for (const auto& a : of_track) {
      for (const auto& b : of_track) {
        const bool is_crossing = a.first < b.first && b.first < a.second && a.second < b.second;
        EXPECT_FALSE(is_crossing) << "track " << track << ": " << a.first << " and " << b.first;
      }
    }
  }
}

TEST(Perfetto, EndsWhatADeadProcessLeftOpenWhereTheNextBegins) {
  PerfettoExport perfetto({});
  perfetto.on_instance(test::instance(test::kTimer, 11, 0, -1, 100, -1));
  auto next = test::instance(test::kTimer, 11, 0, -1, 500, 600);
  next.process = analysis::ProcessIndex{1};
  perfetto.on_instance(next);
  std::ostringstream out;
  perfetto.write(out, {});
  std::string told;
  for (const auto& event : decode(out.str()).events)
    told += (event.type == 1 ? "begin " : "end ") + std::to_string(event.time) + " ";
  EXPECT_EQ(told, "begin 100 end 500 begin 500 end 600 ");
}

TEST(Perfetto, KernelSlicesBecomeSwitchesWithoutGaps) {
  // idle > 11 at 1 050, 11 > 12 at 1 500, 12 > idle at 2 000, idle > 11 at 2 050, 11 > idle at 2
  // 300.
  EXPECT_EQ(decode(exported({})).switches, 5);
  EXPECT_EQ(decode(exported({})).wakings, 2);
}

TEST(Perfetto, DrawsNoIdleCpuWhereNoEventTellsWhatRan) {
  const auto drawn = [](std::optional<analysis::Timestamp> unknown_until) {
    PerfettoExport perfetto({});
    perfetto.on_sched_slice({.cpu = 1, .tid = 11, .comm = "a", .begin = {100}, .end = {200}});
    perfetto.on_sched_slice({.cpu = 1,
                             .tid = 11,
                             .comm = "a",
                             .begin = {300},
                             .end = {400},
                             .unknown_until = unknown_until});
    std::ostringstream out;
    perfetto.write(out, {});
    return out.str();
  };
  const auto is_told = [](const std::string& text) {
    return text.find("not recorded") != std::string::npos;
  };
  EXPECT_FALSE(is_told(drawn(std::nullopt)));
  EXPECT_FALSE(is_told(drawn(analysis::Timestamp{200}))) << "idle since";
  EXPECT_TRUE(is_told(drawn(analysis::Timestamp{300})));
  EXPECT_EQ(decode(drawn(analysis::Timestamp{300})).switches, 4);
  EXPECT_TRUE(is_told(drawn(analysis::Timestamp{250})));
  EXPECT_EQ(decode(drawn(analysis::Timestamp{250})).switches, 5) << "idle from 250 on";
}

TEST(Perfetto, GivesEachHostAMachineOfItsOwn) {
  EXPECT_EQ(decode(exported({})).machines, (std::set<std::uint64_t>{0}));
  PerfettoExport perfetto({});
  for (const std::uint32_t host : {0U, 1U}) {
    auto i = test::instance(test::kTimer, 11, 0, 10, 20, 30);
    i.host = analysis::HostIndex{host};
    i.callback = analysis::CallbackIndex{host};
    perfetto.on_instance(i);
  }
  std::ostringstream out;
  const auto counts = perfetto.write(out, {});
  EXPECT_EQ(counts.callback_slices, 2U);
  const auto file = decode(out.str());
  EXPECT_EQ(file.machines, (std::set<std::uint64_t>{0, 1}));
  std::set<std::uint64_t> tracks;
  for (const auto& event : file.events) {
    if (event.type == 1 && event.time == 20) tracks.insert(event.track);
  }
  EXPECT_EQ(tracks.size(), 2U) << "one pid and tid, two threads";
}

TEST(Perfetto, IsTheSameFromMemoryAndFromDisk) {
  EXPECT_EQ(exported({.records_in_memory = 1}), exported({.records_in_memory = 1'000}));
}

TEST(Perfetto, CompressedIsTheSameTrace) {
  const auto plain = exported({});
  const auto packed = exported({.gzip = true});
  std::string unpacked(plain.size() + 1, '\0');
  z_stream z{};
  ASSERT_EQ(inflateInit2(&z, MAX_WBITS + 16), Z_OK);
  std::string input = packed;
  z.next_in = reinterpret_cast<Bytef*>(input.data());
  z.avail_in = static_cast<uInt>(input.size());
  z.next_out = reinterpret_cast<Bytef*>(unpacked.data());
  z.avail_out = static_cast<uInt>(unpacked.size());
  EXPECT_EQ(inflate(&z, Z_FINISH), Z_STREAM_END);
  unpacked.resize(z.total_out);
  inflateEnd(&z);
  EXPECT_EQ(unpacked, plain);
}

TEST(Perfetto, SurvivesHostileValues) {
  PerfettoExport perfetto({});
  constexpr auto kMin = std::numeric_limits<std::int64_t>::min();
  constexpr auto kMax = std::numeric_limits<std::int64_t>::max();
  for (const auto id : {kMin, std::int64_t{-1}, std::int64_t{0}, kMax}) {
    auto i = test::instance("bad \xFF name", id, 0, kMax, kMax - 1, kMax);
    i.pid = id;
    i.release = analysis::Timestamp{kMin};
    perfetto.on_instance(i);
    i.start.ns = kMin;
    perfetto.on_instance(i);
    perfetto.on_publication({.time = {id}, .pid = id, .tid = id, .cpu = {}, .topic = "\xFF"});
    perfetto.on_sched_slice({.cpu = static_cast<std::int32_t>(id),
                             .tid = id,
                             .comm = {},
                             .begin = {id},
                             .end = {kMax}});
  }
  std::ostringstream out;
  const auto counts = perfetto.write(out, {});
  EXPECT_EQ(counts.callback_slices, 4U);
  EXPECT_EQ(counts.sched_slices, 0U);
  const auto file = decode(out.str());
  EXPECT_EQ(file.names.at(1), "bad \xEF\xBF\xBD name");
  EXPECT_TRUE(file.thread_names.empty()) << "none of these is a thread of Linux";
}

// What is drawn of the curve "queue depth" of /drive.
std::map<std::int64_t, std::int64_t> queue_of_drive(const std::vector<analysis::Instance>& taken,
                                                    std::size_t records_in_memory) {
  PerfettoExport perfetto({.records_in_memory = records_in_memory});
  for (const auto& i : taken)
    perfetto.on_instance(i);
  std::ostringstream out;
  const auto counts = perfetto.write(out, {});
  const auto file = decode(out.str());
  std::map<std::int64_t, std::int64_t> curve;
  for (const auto& event : file.events) {
    if (event.type != 4) continue;
    EXPECT_EQ(file.tracks.at(event.track), "queue depth " + std::string(test::kDrive));
    EXPECT_TRUE(curve.emplace(static_cast<std::int64_t>(event.time), event.value).second);
  }
  EXPECT_EQ(curve.size(), counts.queue_changes);
  return curve;
}

// The same by counting at every time at which a message arrives or is taken.
std::map<std::int64_t, std::int64_t> counted_queue(const std::vector<analysis::Instance>& taken) {
  std::map<std::int64_t, std::int64_t> changes;
  for (const auto& i : taken) {
    ++changes[i.release->ns];
    --changes[i.start.ns];
  }
  std::map<std::int64_t, std::int64_t> curve;
  std::int64_t depth = 0;
  for (const auto& [time, change] : changes) {
    depth += change;
    if (change != 0) curve[time] = depth;
  }
  return curve;
}

TEST(Perfetto, DrawsQueuesOfAnyDepthAndOrder) {
  const auto take = [](std::int64_t tid, std::int64_t release, std::int64_t start,
                       std::int64_t end) {
    return test::taking(test::instance(test::kDrive, tid, 0, release, start, end), release);
  };
  std::vector<analysis::Instance> in_order;
  std::vector<analysis::Instance> crossing;  // two threads; the later message is taken first
  std::vector<analysis::Instance> pile;      // all arrive before the first is taken
  for (std::int64_t k = 0; k < 50; ++k) {
    // Queues of up to four, emptied now and then, the first of them taken as the fifth one arrives.
    const auto start = 500 * (k / 5) + 400 + 10 * (k % 5);
    in_order.push_back(take(13, 100 * k, start, start + 5));
    crossing.push_back(take(13, 100 * k + 50, 100 * k + 60, 100 * k + 70));
    crossing.push_back(take(14, 100 * k + 20, 100 * k + 65, 100 * k + 75));
    pile.push_back(take(13, k, 1'000 + 10 * k, 1'005 + 10 * k));
  }
  for (const auto& taken : {in_order, crossing, pile}) {
    const auto expected = counted_queue(taken);
    ASSERT_GT(expected.size(), 20U);
    for (const std::size_t in_memory : {1U, 3U, 1'000U})
      EXPECT_EQ(queue_of_drive(taken, in_memory), expected) << in_memory;
  }
}

TEST(Perfetto, DrawsTheResponseTimeWhereTheInstanceEnds) {
  const auto file = decode(exported({}));
  std::map<std::uint64_t, std::int64_t> track_responses;
  for (const auto& event : file.events) {
    if (event.type != 2 || event.more_track == 0) continue;
    if (file.tracks.at(event.more_track) == "response time " + std::string(test::kTrack)) {
      track_responses[event.time] = event.more_value;
    }
  }
  EXPECT_EQ(track_responses, (std::map<std::uint64_t, std::int64_t>{
                                 {2'600, 1'150}, {2'900, 750}, {3'200, 200}, {3'360, 60}}));
}

TEST(Perfetto, NamesWaitsByWhatTheyBeginWith) {
  PerfettoExport perfetto({});
  std::uint64_t seq = 0;
  using analysis::ReleaseSource;
  for (const auto source : {ReleaseSource::exact, ReleaseSource::wakeup,
                            ReleaseSource::source_timestamp, ReleaseSource::start}) {
    const auto begin = static_cast<std::int64_t>(100 * seq);
    auto instance = test::instance(test::kDrive, 13, seq++, begin, begin + 10, begin + 20);
    instance.release_source = source;
    if (source == ReleaseSource::start) instance.release = instance.start;
    perfetto.on_instance(instance);
  }
  std::ostringstream out;
  EXPECT_EQ(perfetto.write(out, {}).waits, 3U);
  const auto file = decode(out.str());
  std::map<std::uint64_t, std::string> begun;
  for (const auto& event : file.events) {
    if (event.type != 1) continue;
    const auto name = file.tracks.find(event.track);
    if (name != file.tracks.end() && name->second.ends_with("to start"))
      begun[event.time] = name->second;
  }
  EXPECT_EQ(begun, (std::map<std::uint64_t, std::string>{{0, "release to start"},
                                                         {100, "wake-up to start"},
                                                         {200, "source timestamp to start"}}));
}

TEST(Perfetto, LimitsTheTracksOfAPileOfWaits) {
  PerfettoExport perfetto({});
  for (int k = 0; k < 100; ++k) {  // all released at once, started one after the other
    perfetto.on_instance(test::instance(test::kDrive, 13, static_cast<std::uint64_t>(k), 10,
                                        1'000 + 10 * k, 1'005 + 10 * k));
  }
  std::ostringstream out;
  const auto counts = perfetto.write(out, {});
  EXPECT_EQ(counts.callback_slices, 100U);
  EXPECT_EQ(counts.waits, 64U);
  EXPECT_EQ(counts.skipped, 36U);
}

}  // namespace
}  // namespace cie::viewer_export
