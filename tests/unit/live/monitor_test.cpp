#include "monitor.hpp"

#include "snapshot_json.hpp"
#include "support/move_to_host.hpp"
#include "support/trace_text.hpp"
#include "support/two_hosts.hpp"

#include <map>
#include <string>
#include <utility>

#include <gtest/gtest.h>

namespace cie::live {
namespace {

using analysis::Analyzer;
using analysis::Verdict;

constexpr const char* kTwoCallbacks = R"(
  callback plan timer period=100 deadline=30
  callback drive subscription topic=/t
  100 start plan release=100
  120 end plan
  200 start plan release=200 missed=2
  240 end plan
  300 start plan release=300
  330 end plan
  400 release drive
  405 start drive release=400
  407 end drive)";

struct Watched {
  explicit Watched(const std::string& text, const SchedulingSpec* spec = nullptr)
      : analyzer({.spec = spec, .allow_crash = true, .is_live = true}, &monitor),
        trace(test::trace_of(text)) {}
  Snapshot until(std::int64_t time) {
    while (next < trace.events.size() && trace.events[next].head.time.ns <= time)
      analyzer.consume(trace.events[next++]);
    return monitor.describe(analyzer.look(), std::chrono::steady_clock::now());
  }
  const CallbackView& callback(const Snapshot& snapshot, const std::string& part) {
    for (const auto& view : snapshot.callbacks) {
      if (view.logical_id.find(part) != std::string::npos) return view;
    }
    throw std::out_of_range(part);
  }
  Monitor monitor;
  Analyzer analyzer;
  test::TextTrace trace;
  std::size_t next = 0;
};

TEST(Monitor, AccusesNobodyOfReleasesThatMayBeMissed) {
  const auto spec = SchedulingSpec::parse(
      "callback_groups:\n  - {id: /n@Timer(100), missed_releases_allowed: 2}\n", "app.yaml");
  Watched watched(R"(
    callback plan timer id=/n@Timer(100) period=100
    100 start plan release=100
    120 end plan
    200 start plan release=200 missed=2
    240 end plan)",
                  &spec);
  const auto snapshot = watched.until(350);
  EXPECT_EQ(watched.callback(snapshot, "Timer").total_missed, 2U);
  EXPECT_FALSE(watched.callback(snapshot, "Timer").is_missing_too_many);
}

TEST(Monitor, CountsLateInstancesAndMissedReleases) {
  Watched watched(kTwoCallbacks);
  const auto snapshot = watched.until(350);
  const auto& plan = watched.callback(snapshot, "plan");
  EXPECT_EQ(plan.deadline_ns, 30);
  EXPECT_EQ(plan.instances, 3U);
  EXPECT_EQ(plan.total_late, 1U);  // 40 > 30; 30 is in time
  EXPECT_EQ(plan.missed, 2U);
  EXPECT_EQ(plan.total_missed, 2U);
  EXPECT_TRUE(plan.is_missing_too_many) << "nobody allows any";
  const auto& drive = watched.callback(snapshot, "drive");
  EXPECT_FALSE(drive.late || drive.total_late) << "it has no deadline";
  EXPECT_FALSE(drive.missed) << "a subscription has no periods to miss";
  EXPECT_FALSE(drive.total_missed);
  ASSERT_TRUE(plan.response);
  EXPECT_EQ(plan.response->max, 40);
  EXPECT_EQ(plan.response->sum, 20 + 40 + 30);
  EXPECT_EQ(plan.response_sum_ns, 20 + 40 + 30);
  EXPECT_EQ(plan.counts.front(), 3U);
  EXPECT_EQ(plan.last_response_ns, 30);
  ASSERT_EQ(plan.recent.size(), 3U);
  EXPECT_TRUE(plan.recent[1].is_late);
  EXPECT_FALSE(plan.recent[2].is_late);
}

TEST(Monitor, RecentInstancesAreToldOnce) {
  Watched watched(kTwoCallbacks);
  EXPECT_EQ(watched.callback(watched.until(150), "plan").recent.size(), 1U);
  EXPECT_EQ(watched.callback(watched.until(250), "plan").recent.size(), 1U);
  EXPECT_TRUE(watched.callback(watched.until(260), "plan").recent.empty());
}

TEST(Monitor, TheSpecsDeadlineWins) {
  const auto spec = SchedulingSpec::parse(R"(
callback_groups:
  - id: plan
    response_deadline: 19
)",
                                          "spec.yaml");
  Watched watched(R"(
    callback plan timer id=plan period=100 deadline=30
    100 start plan release=100
    120 end plan)",
                  &spec);
  const auto snapshot = watched.until(130);
  const auto& plan = watched.callback(snapshot, "plan");
  EXPECT_EQ(plan.total_late, 1U);
  EXPECT_EQ(plan.deadline_ns, 19);
  EXPECT_TRUE(plan.is_deadline_of_spec);
}

TEST(Monitor, AnEntryByThePeriodGivesANamedTimerItsDeadline) {
  const auto spec = SchedulingSpec::parse(R"(
callback_groups:
  - id: /n@Timer(100)
    response_deadline: 19
)",
                                          "spec.yaml");
  Watched watched(R"(
    callback plan timer id=/n@Timer(plan) period=100
    100 start plan release=100
    120 end plan)",
                  &spec);
  EXPECT_EQ(watched.callback(watched.until(130), "plan").total_late, 1U);
}

TEST(Monitor, ADeadlineThatOnlyTheCallbackDeclaresIsNotTheSpecs) {
  Watched watched(kTwoCallbacks);
  const auto snapshot = watched.until(150);
  EXPECT_EQ(watched.callback(snapshot, "plan").deadline_ns, 30);
  EXPECT_FALSE(watched.callback(snapshot, "plan").is_deadline_of_spec);
}

TEST(Monitor, AViolationIsToldWhenItHappensAndOnlyThen) {
  Watched watched(kTwoCallbacks);
  const auto changes_of = [](const Snapshot& snapshot, const std::string& rule) {
    std::vector<VerdictChange> found;
    for (const auto& change : snapshot.changes) {
      if (change.rule == rule) found.push_back(change);
    }
    return found;
  };
  EXPECT_TRUE(changes_of(watched.until(150), "R3").empty());
  const auto changes = changes_of(watched.until(250), "R3");
  ASSERT_EQ(changes.size(), 1U);
  EXPECT_EQ(changes[0].to, Verdict::fail);
  EXPECT_NE(changes[0].subject.find("plan"), std::string::npos);
  const auto later = watched.until(340);
  EXPECT_TRUE(changes_of(later, "R3").empty());
  EXPECT_EQ(later.verdict, Verdict::fail);
  EXPECT_EQ(later.verdicts.front().verdict, Verdict::fail);
}

TEST(Monitor, SaysOfAViolationWhichCallbacksAndThreadsItIsAbout) {
  Watched watched(R"(
    callback plan timer period=100
    callback show subscription topic=/a
    10 start plan release=10
    20 end plan
    30 start show on=plan
    40 end show on=plan
    110 start plan on=show release=110
    120 end plan on=show seq=1)");
  std::string said;
  for (const auto& verdict : watched.until(150).verdicts) {
    if (verdict.rule == "M2" || verdict.rule == "M3")
      said += verdict.rule + ' ' + verdict.says + '\n';
  }
  EXPECT_NE(said.find(": 2 callbacks: plan, show\n"), std::string::npos) << said;
  EXPECT_NE(said.find("M3 callback plan: 2 threads: 1 on plan, 1 on show\n"), std::string::npos)
      << said;
}

TEST(Monitor, SaysHowTheSourceDoes) {
  Watched watched(kTwoCallbacks);
  Monitor fresh;
  Analyzer nothing({.is_live = true}, &fresh);
  EXPECT_EQ(fresh.describe(nothing.look(), {}).state, SourceState::waiting);
  EXPECT_EQ(watched.until(150).state, SourceState::streaming);
  EXPECT_EQ(watched.until(150).state, SourceState::silent);
}

TEST(Monitor, TheFirstRateCountsFromTheBegin) {
  const auto begun = std::chrono::steady_clock::now();
  Monitor monitor(begun);
  Analyzer analyzer({.is_live = true}, &monitor);
  const auto trace = test::trace_of(kTwoCallbacks);
  for (const auto& event : trace.events)
    analyzer.consume(event);
  const auto snapshot = monitor.describe(analyzer.look(), begun + std::chrono::seconds(2));
  EXPECT_GT(snapshot.events, 0U);
  EXPECT_DOUBLE_EQ(snapshot.events_per_second, static_cast<double>(snapshot.events) / 2);
}

TEST(Monitor, AnInstanceWithoutReleaseCountsWithItsLowerBound) {
  Watched watched(R"(
    callback plan subscription deadline=5
    100 start plan release=none
    110 end plan)");
  const auto snapshot = watched.until(200);
  const auto& plan = watched.callback(snapshot, "plan");
  EXPECT_FALSE(plan.is_exact);
  EXPECT_EQ(plan.last_response_ns, 10);
  EXPECT_EQ(plan.total_late, 1U);  // more than five is certain
}

TEST(Monitor, TotalsAreOfEveryInstanceWhetherItsReleaseIsKnownOrNot) {
  Watched watched(R"(
    callback plan subscription
    100 start plan release=100
    110 end plan
    200 start plan release=none
    240 end plan)");
  const auto snapshot = watched.until(300);
  const auto& plan = watched.callback(snapshot, "plan");
  ASSERT_TRUE(plan.total_response);
  EXPECT_EQ(plan.total_response->count, 2U);
  EXPECT_EQ(plan.total_response->max, 40);
  EXPECT_EQ(plan.response->max, 40) << "of the window, which is a part of all";
}

TEST(Monitor, PassesNoDeadlineWhereTheTotalsSayThatAnInstanceNeverEnded) {
  const auto spec = SchedulingSpec::parse(R"(
callback_groups:
  - id: plan
    response_deadline: 20
)",
                                          "spec.yaml");
  Watched watched(R"(
    callback plan subscription id=plan
    100 start plan release=100
    110 end plan
    200 start plan release=200
    300 finish plan)",
                  &spec);
  const auto verdict = [](const Snapshot& snapshot) {
    const auto found = std::ranges::find(snapshot.verdicts, "R3", &VerdictView::rule);
    return found != snapshot.verdicts.end() ? found->verdict : Verdict::pass;
  };
  EXPECT_EQ(verdict(watched.until(220)), Verdict::pass) << "it may have ended meanwhile";
  EXPECT_EQ(verdict(watched.until(1000)), Verdict::fail) << "2 started, 1 ended";
  EXPECT_EQ(verdict(watched.monitor.describe(watched.analyzer.finish(), {})), Verdict::fail);
}

constexpr const char* kHanging = R"(
    process app crash
    callback plan timer period=100 deadline=30
    callback other timer period=100
    100 start plan release=100
    120 end plan
    200 start plan release=200
    229 start other release=225
    231 end other
    260 start other release=260
    265 end other)";

TEST(Monitor, CountsAsLateWhatHasNotEndedByItsDeadlineAsItsProcessShows) {
  Watched watched(kHanging);
  const auto plan = [&watched](std::int64_t time) {
    return watched.callback(watched.until(time), "plan");
  };
  const auto in_time = plan(229);
  EXPECT_EQ(in_time.open_ns, 29);
  EXPECT_EQ(in_time.total_late, 0U);
  EXPECT_FALSE(in_time.is_open_long);
  const auto late = plan(231);
  EXPECT_EQ(late.open_ns, 31);
  EXPECT_EQ(late.open_late, 1U);
  EXPECT_TRUE(late.is_open_long && late.is_open_certain);
  EXPECT_EQ(late.late, 1U);
  EXPECT_EQ(late.total_late, 1U);
  EXPECT_EQ(late.total_instances, 1U) << "it has not ended";
  const auto later = watched.until(265);
  EXPECT_EQ(watched.callback(later, "plan").total_late, 1U) << "the same one";
  EXPECT_EQ(watched.callback(later, "other").open_ns, std::nullopt);
  EXPECT_EQ(later.verdict, Verdict::fail);
}

TEST(Monitor, CountsALateInstanceOnceWhetherItHasEndedOrNot) {
  Watched watched(R"(
    process app crash
    callback plan timer period=100 deadline=30
    callback other timer period=100
    200 start plan release=200
    231 start other release=225
    240 end plan
    245 end other)");
  for (const std::int64_t time : {231, 240, 245})
    EXPECT_EQ(watched.callback(watched.until(time), "plan").total_late, 1U) << time;
}

TEST(Monitor, SaysNotThatAnInstanceIsOpenWhoseEndMayBeMissing) {
  Watched watched(std::string(kHanging) + "\n240 discard user until=245 count=1");
  const auto snapshot = watched.until(265);
  const auto& plan = watched.callback(snapshot, "plan");
  EXPECT_TRUE(plan.is_open_long);
  EXPECT_FALSE(plan.is_open_certain);
  EXPECT_EQ(plan.total_late, 0U);
}

TEST(Monitor, WithoutADeadlineAnInstanceIsOpenForLongAfterASecond) {
  Watched watched(R"(
    process app crash
    callback plan subscription
    callback other timer period=100
    200 start plan release=200
    231 start other release=225
    245 end other
    1000000200 start other release=1000000200
    1000000201 end other)");
  EXPECT_FALSE(watched.callback(watched.until(1'000'000'200), "plan").is_open_long);
  const auto snapshot = watched.until(1'000'000'201);
  const auto& plan = watched.callback(snapshot, "plan");
  EXPECT_TRUE(plan.is_open_long && plan.is_open_certain);
  EXPECT_FALSE(plan.total_late);
}

TEST(Monitor, WhatEndedIsForgottenAfterAWhile) {
  Watched watched(kTwoCallbacks);
  Monitor& monitor = watched.monitor;
  const auto now = std::chrono::steady_clock::now();
  const auto end = watched.trace.events.back().head.time.ns;
  EXPECT_EQ(watched.until(end).callbacks.size(), 2U);
  const auto result = watched.analyzer.look();
  EXPECT_EQ(monitor.describe(result, now + std::chrono::seconds(30)).callbacks.size(), 2U);
  EXPECT_TRUE(monitor.describe(result, now + std::chrono::seconds(90)).callbacks.empty());
}

TEST(Monitor, WhatNeverRanIsForgottenAsLongAfterItsEndWasNoticed) {
  Watched watched(R"(
    callback plan timer period=100 deadline=30
    callback drive subscription topic=/t
    100 start plan release=100
    120 end plan)");
  Monitor& monitor = watched.monitor;
  const auto now = std::chrono::steady_clock::now();
  EXPECT_EQ(watched.until(119).callbacks.size(), 2U) << "it runs";
  const auto end = watched.trace.events.back().head.time.ns;
  EXPECT_EQ(watched.until(end).callbacks.size(), 2U) << "it has ended";
  const auto result = watched.analyzer.look();
  EXPECT_EQ(monitor.describe(result, now + std::chrono::seconds(59)).callbacks.size(), 2U);
  EXPECT_TRUE(monitor.describe(result, now + std::chrono::seconds(90)).callbacks.empty());
  EXPECT_TRUE(monitor.describe(result, now + std::chrono::seconds(91)).callbacks.empty());
}

TEST(Monitor, TheWindowBeginsWithTheFirstInstanceThoughASnapshotWasBeforeIt) {
  constexpr std::int64_t kBegin = 1'000'000'000'000;
  Watched watched(R"(
    callback plan timer period=100
    1000000000000 start plan release=1000000000000
    1000000000120 end plan)");
  const auto begun = std::chrono::steady_clock::now();
  EXPECT_EQ(watched.until(kBegin - 1).window_ns, 0);
  while (watched.next < watched.trace.events.size())
    watched.analyzer.consume(watched.trace.events[watched.next++]);
  const auto result = watched.analyzer.look();
  EXPECT_EQ(watched.monitor.describe(result, begun).window_ns, 120);
  EXPECT_EQ(watched.monitor.describe(result, begun + std::chrono::seconds(2)).window_ns,
            2'000'000'120);
}

TEST(Monitor, WindowsAreByTheClockOfEachHost) {
  constexpr const char* kTwoHosts = R"(
  process robot pid=100
  callback plan timer period=100
  process desk pid=200
  callback show timer period=100
  100 start plan release=100
  110 end plan
  120 start show release=120
  150 end show)";
  constexpr std::int64_t kHour = 3'600'000'000'000;
  for (const std::int64_t moved : {100, 200}) {  // whose clock is an hour ahead
    Watched watched(kTwoHosts);
    test::move_to_host(watched.trace, moved, {.name = "other", .monotonic = kHour, .realtime = 0});
    while (watched.next < watched.trace.events.size())
      watched.analyzer.consume(watched.trace.events[watched.next++]);
    const auto snapshot =
        watched.monitor.describe(watched.analyzer.look(), std::chrono::steady_clock::now());
    EXPECT_EQ(watched.callback(snapshot, "plan").instances, 1U) << moved;
    EXPECT_EQ(watched.callback(snapshot, "show").instances, 1U) << moved;
    EXPECT_EQ(watched.callback(snapshot, "plan").host, moved == 100 ? "other" : "robot");
    EXPECT_EQ(snapshot.time_ns, 150 + (moved == 200 ? kHour : 0)) << "of the host heard of last";
  }
}

TEST(Monitor, TellsHostsApartWhosePidsTidsAndIdsAreTheSame) {
  Monitor monitor;
  Analyzer analyzer({.allow_crash = true, .is_live = true}, &monitor);
  const auto trace = test::application_on_two_hosts();
  for (const auto& event : trace.events)
    analyzer.consume(event);
  const auto snapshot = monitor.describe(analyzer.look(), std::chrono::steady_clock::now());
  std::map<std::pair<std::string, std::string>, std::int64_t> last;
  for (const auto& callback : snapshot.callbacks) {
    if (callback.last_response_ns)
      last[{callback.host, callback.logical_id}] = *callback.last_response_ns;
  }
  EXPECT_EQ(last,
            (std::map<std::pair<std::string, std::string>, std::int64_t>{{{"robot", "plan"}, 2},
                                                                         {{"robot", "show"}, 3},
                                                                         {{"desk", "plan"}, 52},
                                                                         {{"desk", "show"}, 90}}));
}

TEST(Monitor, KnowsWhatNeverRan) {
  Watched watched(kTwoCallbacks);
  const auto early = watched.until(350);
  EXPECT_EQ(watched.callback(early, "plan").isolation, analysis::Isolation::isolated);
  const auto view = parse_snapshot(json_line(early, false));
  for (const auto& callback : view.callbacks) {
    const bool has_run = callback.logical_id == "plan";
    EXPECT_EQ(callback.isolation,
              has_run ? analysis::Isolation::isolated : analysis::Isolation::never_ran);
  }
}

}  // namespace
}  // namespace cie::live
