// What observers are told besides instances: who woke whom, and on which host. When they are told.
#include <cie/analysis/analyzer.hpp>
#include <cie/analysis/report_rows.hpp>

#include "support/trace_text.hpp"

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

struct Told : Observer {
  void on_instance(const Instance& instance) override { instances.push_back(instance); }
  void on_waking(const Waking& waking) override { wakings.push_back(waking); }
  std::vector<Instance> instances;
  std::vector<Waking> wakings;
};

// One CPU of a host, on which threads follow one another.
class Kernel : public testing::Test {
 protected:
  Kernel() : analyzer_(AnalysisOptions{}, &told_) {}
  void push(std::int64_t time, const EventBody& body, std::uint32_t stream = 0) {
    analyzer_.consume(Event{
        .head = {.time = {time}, .stream = StreamIndex{stream}, .cpu = 0, .pid = pid_, .tid = pid_},
        .body = body});
  }
  void switch_to(std::int64_t time, std::int64_t prev, std::int64_t next) {
    SchedSwitch event;
    event.prev_tid = prev;
    event.prev_state = 1;
    event.next_tid = next;
    push(time, event);
  }

  std::optional<std::int64_t> pid_;
  Told told_;
  Analyzer analyzer_;
};

TEST_F(Kernel, TellsWhoWokeWhom) {
  push(0, StreamBegin{.domain = Domain::kernel, .host = "robot", .clock_uuid = {}, .path = {}});
  push(1, SchedWaking{.tid = 7, .prio = 120, .target_cpu = {}});  // nobody knows yet what runs
  switch_to(5, 0, 9);
  push(6, SchedWaking{.tid = 8, .prio = 19, .target_cpu = 3});
  push(7, SchedWakeup{.tid = 8, .prio = 19, .target_cpu = 3});  // the same wake-up
  switch_to(8, 9, 0);
  push(9, SchedWakeup{.tid = 9, .prio = 120, .target_cpu = {}});  // from an interrupt
  analyzer_.finish();
  ASSERT_EQ(told_.wakings.size(), 3U);
  EXPECT_EQ(told_.wakings[0].waker_tid, std::nullopt);
  EXPECT_EQ(told_.wakings[1].time.ns, 6);
  EXPECT_EQ(told_.wakings[1].tid, 8);
  EXPECT_EQ(told_.wakings[1].waker_tid, 9);
  EXPECT_EQ(told_.wakings[1].priority, 19);
  EXPECT_EQ(told_.wakings[1].target_cpu, 3);
  EXPECT_EQ(told_.wakings[2].tid, 9);
  EXPECT_EQ(told_.wakings[2].waker_tid, 0);
}

TEST_F(Kernel, TellsHostsApartWhoseProcessesHaveTheSamePid) {
  pid_ = 4001;
  for (const std::uint32_t stream : {0U, 1U}) {
    push(0,
         StreamBegin{.channel = stream,
                     .host = stream == 0 ? "left" : "right",
                     .clock_uuid = {},
                     .path = {}},
         stream);
    push(0, PacketBegin{}, stream);
  }
  for (const std::uint32_t stream : {0U, 1U}) {
    CallbackStart start;
    start.callback = CallbackId{1};
    push(10 + stream, start, stream);
    push(20 + stream, CallbackEnd{.callback = CallbackId{1}, .seq = 0, .status = {}}, stream);
  }
  for (const std::uint32_t stream : {0U, 1U}) {
    push(90, PacketEnd{}, stream);
    push(90, StreamEnd{}, stream);
  }
  const auto report = analyzer_.finish().report;
  std::map<HostIndex, std::string> hosts;
  for (const auto& process : report.processes)
    hosts[process.host_index] = process.host;
  ASSERT_EQ(told_.instances.size(), 2U);
  for (const auto& instance : told_.instances)
    EXPECT_EQ(hosts.at(instance.host), instance.start.ns == 10 ? "left" : "right");
  ASSERT_EQ(report.callbacks.size(), 2U);
  const ReportRows rows(report);
  EXPECT_NE(rows.process_of(report.callbacks[0]).host, rows.process_of(report.callbacks[1]).host);
  ASSERT_EQ(report.threads.size(), 2U);
  EXPECT_NE(rows.process_of(report.threads[0]).host, rows.process_of(report.threads[1]).host);
}

// One process, with events that follow from others, as from ROS 2's.
class Derived : public testing::Test {
 protected:
  Derived() : analyzer_(AnalysisOptions{}, &told_) {
    push(0, StreamBegin{.host = "robot", .clock_uuid = {}, .clock_offset_ns = 1000, .path = {}});
    push(0, PacketBegin{});
    derive(1, ClockSync{.monotonic_ns = 1, .realtime_ns = 1001});
    derive(1, CallbackInit{.callback = CallbackId{1},
                           .kind = {},
                           .logical_id = "/n@Subscription(/t)",
                           .source = {},
                           .symbol = {}});
  }
  void push(std::int64_t time, const EventBody& body, bool is_derived = false) {
    analyzer_.consume(
        Event{.head = {.time = {time}, .cpu = 0, .pid = 7, .tid = 7, .is_derived = is_derived},
              .body = body});
  }
  void derive(std::int64_t time, const EventBody& body) { push(time, body, true); }

  Told told_;
  Analyzer analyzer_;
};

TEST_F(Derived, InstancesDoNotWaitForTheirThread) {
  derive(10, CallbackStart{.callback = CallbackId{1}, .release_kind = {}});
  derive(12, CallbackEnd{.callback = CallbackId{1}, .seq = 0, .status = {}});
  ASSERT_EQ(told_.instances.size(), 1U);
  EXPECT_EQ(told_.instances[0].release_source, ReleaseSource::start);
}

// It may be a timer, unless it took a message; of ROS 2's events none tells how many periods.
TEST_F(Derived, WhatACallbackSkippedThatNobodyDescribedIsNotKnown) {
  derive(10, CallbackStart{.callback = CallbackId{1}, .release_kind = {}});
  derive(12, CallbackEnd{.callback = CallbackId{1}, .seq = 0, .status = {}});
  derive(20, CallbackStart{.callback = CallbackId{1},
                           .seq = 1,
                           .release_kind = {},
                           .source_timestamp_realtime_ns = 1019,
                           .writer_gid = 5});
  derive(22, CallbackEnd{.callback = CallbackId{1}, .seq = 1, .status = {}});
  derive(23, PublisherInit{.publisher = PublisherId{2}, .topic = "/t", .writer_gid = 5});
  ASSERT_EQ(told_.instances.size(), 2U);
  EXPECT_EQ(told_.instances[0].missed, std::nullopt);
  EXPECT_EQ(told_.instances[1].missed, 0U);
}

// Its starts tell how many periods, whoever describes it.
TEST(Instances, TellWhatATimerSkippedWhoseRegistrationWasNotSeen) {
  auto trace = test::trace_of(R"(
    callback plan timer period=10
    10 start plan release=9
    12 end plan
    40 start plan release=39 missed=2
    42 end plan)");
  trace.erase<CallbackInit>();
  Told told;
  test::analyze(trace, {}, &told);
  ASSERT_EQ(told.instances.size(), 2U);
  EXPECT_EQ(told.instances[0].missed, 0U);
  EXPECT_EQ(told.instances[1].missed, 2U);
}

TEST_F(Derived, InstancesOfAProcessWithOwnEventsWaitForTheirThread) {
  push(2, RunBegin{.tool_version = {},
                   .executor = {},
                   .boot_id = {},
                   .host = {},
                   .pid = 7,
                   .spec_sha256 = {},
                   .moment = RunMoment::announce});
  derive(8, ThreadWakeup{.callback = kNoCallback, .reason = {}});
  derive(10, CallbackStart{.callback = CallbackId{1}, .release_kind = {}});
  derive(12, CallbackEnd{.callback = CallbackId{1}, .seq = 0, .status = {}});
  EXPECT_TRUE(told_.instances.empty());
  push(13, ThreadInit{.tid = 7, .role = ThreadRole::callback, .name = {}});
  ASSERT_EQ(told_.instances.size(), 1U);
  EXPECT_EQ(told_.instances[0].release_source, ReleaseSource::wakeup);
  EXPECT_EQ(told_.instances[0].release->ns, 8);
}

TEST_F(Derived, InstancesWaitForTheWriterOfTheirMessage) {
  derive(10, CallbackStart{.callback = CallbackId{1},
                           .release_kind = {},
                           .source_timestamp_realtime_ns = 1009,
                           .writer_gid = 5});
  derive(12, CallbackEnd{.callback = CallbackId{1}, .seq = 0, .status = {}});
  EXPECT_TRUE(told_.instances.empty());
  derive(13, PublisherInit{.publisher = PublisherId{2}, .topic = "/t", .writer_gid = 5});
  ASSERT_EQ(told_.instances.size(), 1U);
  EXPECT_EQ(told_.instances[0].release_source, ReleaseSource::source_timestamp);
  EXPECT_EQ(told_.instances[0].release->ns, 9);
}

}  // namespace
}  // namespace cie::analysis
