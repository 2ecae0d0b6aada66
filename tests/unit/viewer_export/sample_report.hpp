// A report written by hand: two callbacks that share a thread, one that has its own, one
// unmeasured.
#pragma once

#include <cie/analysis/report.hpp>
#include <cie/analysis/verdict.hpp>

#include <cstdint>
#include <numeric>
#include <string>

namespace cie::test {

inline analysis::Summary summary(std::int64_t min, std::int64_t max, std::uint64_t count) {
  const auto middle = std::midpoint(min, max);
  const auto sum = static_cast<std::int64_t>(count) * middle;
  return {.count = count,
          .min = min,
          .max = max,
          .sum = sum,
          .mean = static_cast<double>(sum) / static_cast<double>(count),
          .p50 = middle,
          .p90 = max - 2,
          .p99 = max - 1,
          .p99_9 = max};
}

inline analysis::CallbackReport callback(std::string id, CallbackKind kind) {
  analysis::CallbackReport c;
  c.logical_id = std::move(id);
  c.node = "/a/plan";
  c.kind = kind;
  c.symbol = "app::plan";
  return c;
}

inline analysis::Report sample_report() {
  analysis::Report report;
  report.trace.paths = {"recordings/run 1"};
  report.trace.begin = analysis::Timestamp{983'000'000'000};
  report.trace.end = analysis::Timestamp{983'130'000'000};
  report.trace.events = 980;
  report.trace.streams = 4;
  report.trace.hosts = {"robot"};
  report.trace.lost_events = 0;
  report.trace.complete = true;
  report.defects = {{.kind = analysis::DefectKind::open_instances,
                     .severity = analysis::Severity::info,
                     .count = 2,
                     .advice = "the wall clock was set twice; times here do not depend on it"}};
  report.processes = {
      {.host = "robot", .pid = 4001, .name = "demo", .executor = "isolated", .complete = true}};
  report.hosts = {{.name = "robot", .recorded = *report.trace.end - *report.trace.begin}};

  auto timer = callback("/a/plan@Timer(20000000)", CallbackKind::timer);
  timer.period_ns = 20'000'000;
  timer.group = 1;
  timer.threads = {
      {.thread = analysis::ThreadIndex{0}, .tid = 4005, .name = "plan", .instances = 7}};
  timer.isolation = analysis::Isolation::isolated;
  timer.instances = 7;
  timer.missed_releases = 3;
  timer.release_source = analysis::ReleaseSource::exact;
  timer.response_time = summary(85'266, 289'415, 7);
  timer.start_latency = summary(7'185, 14'885, 7);
  timer.duration = summary(70'381, 281'813, 7);
  timer.inter_arrival = summary(20'000'000, 20'000'000, 6);
  timer.execution_time = summary(70'381, 281'813, 7);
  timer.preempted = summary(0, 0, 7);
  timer.blocked = summary(0, 0, 7);
  timer.wake_delay = summary(0, 0, 7);
  timer.wakeup_latency = summary(2'083, 8'108, 7);

  auto subscription = callback("/perception/lidar@Subscription(/sensing/lidar/top/points_raw)",
                               CallbackKind::subscription);
  subscription.source = "/sensing/lidar/top/points_raw";
  subscription.threads = {
      {.thread = analysis::ThreadIndex{1}, .tid = 4008, .name = "pool 0", .instances = 2},
      {.thread = analysis::ThreadIndex{2}, .tid = 4009, .name = "pool 1", .instances = 5}};
  subscription.isolation = analysis::Isolation::not_isolated;
  subscription.instances = 7;
  subscription.incomplete = 1;
  subscription.release_source = analysis::ReleaseSource::wakeup;
  subscription.response_time_lower = summary(1'000'000, 2'500'000, 7);
  subscription.duration = summary(900'000, 2'400'000, 7);

  report.callbacks = {timer, subscription,
                      callback("/a/plan@Service(/never called)", CallbackKind::service)};
  for (std::uint32_t i = 0; i < report.callbacks.size(); ++i)
    report.callbacks[i].index = analysis::CallbackIndex{i};

  analysis::ThreadReport own;
  own.tid = 4005;
  own.name = "plan";
  own.role = ThreadRole::callback;
  own.callbacks = {timer.logical_id};
  own.sched = analysis::ThreadSchedReport{.moment = SchedMoment::applied,
                                          .policy = 1,
                                          .policy_name = "SCHED_FIFO",
                                          .flags = 0,
                                          .nice = 0,
                                          .priority = 80,
                                          .runtime_ns = 0,
                                          .deadline_ns = 0,
                                          .period_ns = 0,
                                          .cpus = {0, 1, 3},
                                          .error = 0};
  own.busy_ns = 1'500'000;
  analysis::ThreadReport pool;
  pool.index = analysis::ThreadIndex{1};
  pool.tid = 4008;
  pool.callbacks = {subscription.logical_id, timer.logical_id};
  report.threads = {own, pool};

  analysis::ChainReport chain;
  chain.name = "braking";
  chain.process = analysis::ProcessIndex{};
  chain.hops = {timer.logical_id, subscription.logical_id};
  chain.instances = 6;
  chain.path_latency = summary(776'270, 1'008'309, 6);
  chain.hop_table = {{.from = timer.logical_id,
                      .to = subscription.logical_id,
                      .processing = summary(80'000, 90'000, 6),
                      .communication = summary(1'000, 3'000, 6)},
                     {.from = subscription.logical_id,
                      .to = std::nullopt,
                      .processing = summary(1'000'000, 2'000'000, 6),
                      .communication = std::nullopt}};
  report.chains = {chain};
  return report;
}

// The same with the second callback of the chain on another host.
inline analysis::Report sample_of_two_hosts() {
  auto report = sample_report();
  const analysis::ClockError error{.least = analysis::Duration{-3'000'000},
                                   .most = analysis::Duration{400'000}};
  report.chains[0].clock_error = error;
  report.chains[0].hop_table[0].clock_error = error;
  analysis::HostClockReport both{.first = "desk", .second = "robot"};
  both.messages_there = 6;
  both.messages_back = 9;
  both.fastest_there_ns = 3'000'000;
  both.fastest_back_ns = 400'000;
  both.ahead_ns = 1'300'000;
  both.error_ns = 1'700'000;
  analysis::HostClockReport one_way{.first = "desk", .second = "shed"};
  one_way.messages_there = 1;
  one_way.fastest_there_ns = -5;
  report.clocks = {both, one_way};
  return report;
}

inline analysis::VerdictReport sample_verdicts() {
  using analysis::Verdict;
  const analysis::Evidence first{
      .event = "callback_start",
      .time = analysis::Timestamp{983'005'016'596},
      .cpu = 0,
      .pid = 4001,
      .tid = 4008,
      .note = analysis::free_text("started /a/plan@Timer(20000000), instance 0"),
      .stream = 1,
      .file = "ust/channel0_1",
      .packet = 2};
  const analysis::Evidence second{.event = "callback_start",
                                  .time = analysis::Timestamp{983'005'187'272},
                                  .cpu = std::nullopt,
                                  .pid = 4001,
                                  .tid = 4008,
                                  .note = analysis::free_text("started /b@Timer(1), instance 0")};
  const analysis::Evidence missing{
      .event = "missing",
      .time = analysis::Timestamp{983'130'000'000},
      .cpu = std::nullopt,
      .pid = std::nullopt,
      .tid = std::nullopt,
      .note = analysis::free_text("no run_end: the process was interrupted")};
  const auto of = [](analysis::SubjectKind kind, std::uint32_t index) {
    return analysis::Subject{.kind = kind, .index = index, .process = analysis::ProcessIndex{}};
  };
  return {.verdict = Verdict::fail,
          .rules = {{.id = "T1",
                     .name = "trace-readable",
                     .verdict = Verdict::pass,
                     .subjects = {{.subject = "trace",
                                   .verdict = Verdict::pass,
                                   .checked = 980,
                                   .evidence = {}}}},
                    {.id = "T4",
                     .name = "run-complete",
                     .verdict = Verdict::inconclusive,
                     .subjects = {{.about = of(analysis::SubjectKind::process, 0),
                                   .subject = "process 4001",
                                   .verdict = Verdict::inconclusive,
                                   .checked = 0,
                                   .evidence = {missing}}}},
                    {.id = "M2",
                     .name = "one-callback-per-thread",
                     .verdict = Verdict::fail,
                     .subjects = {{.about = of(analysis::SubjectKind::thread, 0),
                                   .subject = "thread 4005",
                                   .verdict = Verdict::pass,
                                   .checked = 7,
                                   .evidence = {}},
                                  {.about = of(analysis::SubjectKind::thread, 1),
                                   .subject = "thread 4008",
                                   .verdict = Verdict::fail,
                                   .checked = 9,
                                   .evidence = {first, second}}}},
                    {.id = "M5",
                     .name = "mapping-survives-restart",
                     .verdict = Verdict::not_applicable,
                     .subjects = {}}}};
}

// The same, with the FAIL of thread 4008 suppressed, and an entry that names nothing.
inline analysis::VerdictReport suppressed_verdicts(bool is_expired) {
  auto verdicts = sample_verdicts();
  const analysis::Suppression entry{.rule = "M2",
                                    .subject = "thread *",
                                    .reason = "known <since> May",
                                    .expires = "2026-12-31",
                                    .place = "ok.yaml:2",
                                    .is_expired = is_expired};
  auto other = entry;
  other.rule = "M5";
  other.place = "ok.yaml:6";
  other.expires = "never";
  other.is_expired = false;
  verdicts.rules[2].subjects[1].suppression = entry;
  verdicts.suppressions = {
      .date = is_expired ? "2027-01-01" : "2026-12-31",
      .uses = {{.suppression = entry, .matched = 1, .counting = is_expired ? 1U : 0U},
               {.suppression = other}}};
  verdicts.verdict = analysis::overall_verdict(verdicts);
  return verdicts;
}

}  // namespace cie::test
