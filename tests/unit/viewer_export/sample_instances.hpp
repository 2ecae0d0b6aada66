// A hand-made application as observers see it: a timer publishes to two subscriptions, one of which
// queues a second sample; a pool thread overlaps; one instance never ends.
#pragma once

#include <cie/analysis/analyzer.hpp>
#include <cie/analysis/instance.hpp>

#include <string>
#include <string_view>
#include <utility>

namespace cie::test {

inline constexpr std::int64_t kPid = 4001;
inline constexpr std::uint64_t kWriter = 0xfedcba9876543210U;

inline constexpr std::string_view kTimer = "/plan@Timer(20000000)";
inline constexpr std::string_view kTrack = "/track@Subscription(/points)";
inline constexpr std::string_view kDrive = "/drive@Subscription(/points)";

inline analysis::Instance instance(std::string_view id, std::int64_t tid, std::uint64_t seq,
                                   std::int64_t release, std::int64_t start, std::int64_t end) {
  analysis::Instance i;
  i.logical_id = id;
  i.callback = analysis::CallbackIndex{id == kTimer ? 0U : id == kTrack ? 1U : 2U};
  i.pid = kPid;
  i.tid = tid;
  i.seq = seq;
  if (release >= 0) {
    i.release = analysis::Timestamp{release};
    i.release_source = analysis::ReleaseSource::exact;
  }
  i.start = {start};
  if (end >= 0) {
    i.end = analysis::Timestamp{end};
    i.status = CallbackStatus::ok;
  } else {
    i.state = analysis::InstanceState::open;
  }
  return i;
}

inline analysis::Instance taking(analysis::Instance i, std::int64_t source_timestamp) {
  i.writer_gid = kWriter;
  i.source_timestamp_realtime_ns = source_timestamp;
  return i;
}

inline analysis::Publication publication(std::int64_t time, std::int64_t tid, std::uint64_t seq,
                                         std::int64_t source_timestamp) {
  return {.time = {time},
          .pid = kPid,
          .tid = tid,
          .cpu = 1,
          .topic = "/points",
          .publisher_id = 3,
          .seq = seq,
          .writer_gid = kWriter,
          .source_timestamp_realtime_ns = source_timestamp};
}

// In order of completion, as the analysis tells it. Times in nanoseconds.
inline void feed_application(analysis::Observer& observer) {
  // Timer, instance 0, publishes as its last act: the message goes to both subscriptions.
  observer.on_publication(publication(1'400, 11, 0, 900'001));
  observer.on_instance(instance(kTimer, 11, 0, 1'000, 1'100, 1'400));
  observer.on_instance(taking(instance(kTrack, 12, 0, 1'450, 1'500, 2'600), 900'001));
  // Timer, instance 1, publishes as its first act. /track is released while it is busy.
  observer.on_publication(publication(2'100, 11, 1, 900'002));
  observer.on_instance(instance(kTimer, 11, 1, 2'000, 2'100, 2'300));
  observer.on_instance(taking(instance(kDrive, 13, 0, 1'460, 1'600, 2'700), 900'001));
  // Released at 2 150, between release and start of nobody else on this thread: 2 150 to 2 600.
  observer.on_instance(taking(instance(kTrack, 12, 1, 2'150, 2'600, 2'900), 900'002));
  // Two instances of a pool thread overlap without nesting (a damaged trace): neither is shortened.
  // The waits overlap too: 2 800 to 3 000 and 2 900 to 3 200.
  observer.on_instance(instance(kDrive, 14, 1, 2'800, 3'000, 3'400));
  observer.on_instance(instance(kDrive, 14, 2, 2'900, 3'200, 3'600));
  // Taken before it was published: the clocks disagree. No arrow, but counted.
  observer.on_publication(publication(5'000, 11, 2, 900'003));
  observer.on_instance(taking(instance(kTrack, 12, 2, 3'000, 3'100, 3'200), 900'003));
  // The message of an unseen publication has no arrow.
  observer.on_instance(taking(instance(kTrack, 12, 3, 3'300, 3'350, 3'360), 900'999));
  // An end before its start cannot be drawn.
  observer.on_instance(instance(kTrack, 12, 4, -1, 3'700, 3'600));
  // Never ended; its release is not known.
  observer.on_instance(instance(kTimer, 11, 3, -1, 6'000, -1));

  // CPU 1 runs the timer's thread, is preempted by /track's at once, then is idle.
  observer.on_sched_slice({.cpu = 1,
                           .tid = 11,
                           .comm = "plan",
                           .priority = 19,
                           .begin = {1'050},
                           .end = {1'500},
                           .end_state = 0x100});
  observer.on_sched_slice({.cpu = 1,
                           .tid = 12,
                           .comm = "track",
                           .priority = 120,
                           .begin = {1'500},
                           .end = {2'000},
                           .end_state = 1});
  observer.on_sched_slice({.cpu = 1,
                           .tid = 11,
                           .comm = "plan",
                           .priority = 19,
                           .begin = {2'050},
                           .end = {2'300},
                           .end_state = 0x402});
  // The timer's thread is woken by an interrupt, /track's by the timer's; of a third one nobody
  // knows by whom.
  observer.on_waking({.time = {1'020}, .tid = 11, .priority = 19, .cpu = 1, .waker_tid = 0});
  observer.on_waking(
      {.time = {1'420}, .tid = 12, .priority = 120, .cpu = 1, .waker_tid = 11, .target_cpu = 1});
  observer.on_waking({.time = {1'430}, .tid = 13, .priority = 120, .cpu = 1});
}

inline analysis::Report application_report() {
  analysis::Report report;
  report.trace.begin = analysis::Timestamp{900};
  report.trace.end = analysis::Timestamp{10'000};
  report.processes = {
      {.host = "robot", .pid = kPid, .name = "demo", .executor = "isolated", .complete = true}};
  const auto add = [&](std::int64_t tid, std::string name) {
    analysis::ThreadReport thread;
    thread.tid = tid;
    thread.name = std::move(name);
    report.threads.push_back(thread);
  };
  add(11, "plan thread of more than 15 letters");
  add(12, "track \"quoted\" \x1b[31m");
  add(13, "drive");
  add(14, "pool");
  return report;
}

// One violation with two pieces of evidence, one of them without a time, and one that is accepted.
inline analysis::AnalysisResult application_result() {
  analysis::AnalysisResult result;
  result.report = application_report();
  const analysis::Evidence late{
      .event = "callback_end",
      .time = analysis::Timestamp{2'600},
      .cpu = 1,
      .pid = kPid,
      .tid = 12,
      .note = analysis::free_text("response time 1150 > 1000 \x1b[31m\xff")};
  const analysis::Evidence timeless{.event = "callback_init",
                                    .time = {},
                                    .cpu = {},
                                    .pid = {},
                                    .tid = {},
                                    .note = analysis::free_text("no time")};
  analysis::SubjectVerdict violated{.subject = "callback " + std::string(kTrack),
                                    .verdict = analysis::Verdict::fail,
                                    .checked = 4,
                                    .evidence = {late, timeless}};
  auto accepted = violated;
  accepted.subject = "callback " + std::string(kDrive);
  accepted.evidence = {late};
  accepted.suppression = analysis::Suppression{.rule = "R3",
                                               .subject = "*",
                                               .reason = "known",
                                               .expires = "never",
                                               .place = "accepted.yaml:3"};
  auto undecided = violated;
  undecided.verdict = analysis::Verdict::inconclusive;
  result.verdicts.verdict = analysis::Verdict::fail;
  result.verdicts.rules = {{.id = "R3",
                            .name = "deadline",
                            .verdict = analysis::Verdict::fail,
                            .subjects = {violated, accepted}},
                           {.id = "R4",
                            .name = "budget",
                            .verdict = analysis::Verdict::inconclusive,
                            .subjects = {undecided}}};
  return result;
}

}  // namespace cie::test
