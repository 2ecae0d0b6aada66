#include "save_trigger.hpp"

#include <string>

#include <gtest/gtest.h>

namespace cie::live {
namespace {

using analysis::Verdict;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr SaveTrigger::Clock::time_point kStart{};

Snapshot with_change(const std::string& rule, const std::string& subject,
                     Verdict to = Verdict::fail) {
  Snapshot snapshot;
  snapshot.changes.push_back({.time_ns = 1,
                              .rule = rule,
                              .name = "a-rule",
                              .subject = subject,
                              .from = Verdict::pass,
                              .to = to,
                              .note = ""});
  return snapshot;
}

Snapshot with_late(const std::string& logical_id, std::uint64_t late, bool is_of_spec = true) {
  Snapshot snapshot;
  snapshot.callbacks.resize(1);
  snapshot.callbacks[0].logical_id = logical_id;
  snapshot.callbacks[0].index = 4;
  snapshot.callbacks[0].total_late = late;
  snapshot.callbacks[0].deadline_ns = 5'000'000;
  snapshot.callbacks[0].is_deadline_of_spec = is_of_spec;
  return snapshot;
}

TEST(SaveTrigger, TellsAViolationOnce) {
  SaveTrigger trigger({});
  EXPECT_FALSE(trigger.take(kStart, false));
  trigger.see(with_change("M2", "thread 7"));
  EXPECT_EQ(trigger.take(kStart, false), "M2 a-rule: thread 7");
  EXPECT_FALSE(trigger.take(kStart, false)) << "it was taken";
  trigger.see(with_change("M2", "thread 7", Verdict::pass));
  trigger.see(with_change("M2", "thread 7"));
  EXPECT_FALSE(trigger.take(kStart + seconds(3600), false)) << "it was told before";
  trigger.see(with_change("M2", "thread 8"));
  EXPECT_EQ(trigger.take(kStart + seconds(3600), false), "M2 a-rule: thread 8");
}

TEST(SaveTrigger, WhatIsNoViolationIsNoReason) {
  SaveTrigger trigger({});
  trigger.see(with_change("M2", "thread 7", Verdict::inconclusive));
  trigger.see(with_change("M2", "thread 7", Verdict::pass));
  EXPECT_FALSE(trigger.take(kStart, false));
}

TEST(SaveTrigger, WhatComesTooEarlyIsToldTogetherLater) {
  SaveTrigger trigger({.most = 10, .least_interval = milliseconds(2000)});
  trigger.see(with_change("M2", "thread 1"));
  EXPECT_TRUE(trigger.take(kStart, false));
  trigger.see(with_change("M2", "thread 2"));
  trigger.see(with_change("M3", "callback 3"));
  trigger.see(with_change("S1", "thread 4"));
  EXPECT_FALSE(trigger.take(kStart + milliseconds(1999), false));
  EXPECT_EQ(trigger.take(kStart + milliseconds(2000), false),
            "M2 a-rule: thread 2; also M3; also S1");
}

TEST(SaveTrigger, AtTheEndNothingIsTooEarly) {
  SaveTrigger trigger({.most = 10, .least_interval = seconds(1000)});
  trigger.see(with_change("M2", "thread 1"));
  EXPECT_TRUE(trigger.take(kStart, false));
  trigger.see(with_change("M2", "thread 2"));
  EXPECT_TRUE(trigger.take(kStart, true));
}

TEST(SaveTrigger, BeyondTheMostReasonsAreOnlyCounted) {
  SaveTrigger trigger({.most = 2, .least_interval = milliseconds(0)});
  for (int i = 0; i < 5; ++i) {
    trigger.see(with_change("M2", "thread " + std::to_string(i)));
    EXPECT_EQ(trigger.take(kStart, false).has_value(), i < 2) << i;
  }
  EXPECT_EQ(trigger.left_out(), 3U);
}

TEST(SaveTrigger, EachMissOfADeadlineOfTheSpecIsAReason) {
  SaveTrigger trigger({.most = 10, .least_interval = milliseconds(0)});
  trigger.see(with_late("/plan@Timer(1)", 0));
  EXPECT_FALSE(trigger.take(kStart, false));
  trigger.see(with_late("/plan@Timer(1)", 1));
  EXPECT_EQ(trigger.take(kStart, false),
            "/plan@Timer(1) missed its deadline of 5.000 ms, 1 times so far");
  trigger.see(with_late("/plan@Timer(1)", 1));
  EXPECT_FALSE(trigger.take(kStart, false)) << "no new one";
  trigger.see(with_late("/plan@Timer(1)", 3));
  EXPECT_EQ(trigger.take(kStart, false),
            "/plan@Timer(1) missed its deadline of 5.000 ms, 3 times so far");
  trigger.see(with_change("R3", "callback /plan@Timer(1)"));
  EXPECT_FALSE(trigger.take(kStart, false)) << "the same, as a verdict";
}

TEST(SaveTrigger, DeadlinesThatTheApplicationDeclaresAreTheFlightRecordersOwn) {
  SaveTrigger trigger({.most = 10, .least_interval = milliseconds(0)});
  trigger.see(with_late("/drive@Timer(2)", 1, false));
  EXPECT_FALSE(trigger.take(kStart, false));
}

// The flight recorder sees it when it ends, which it may never do.
TEST(SaveTrigger, AnInstanceThatHasNotEndedByAnyDeadlineIsAReason) {
  for (const bool is_of_spec : {false, true}) {
    SaveTrigger trigger({.most = 10, .least_interval = milliseconds(0)});
    auto snapshot = with_late("/drive@Timer(2)", 1, is_of_spec);
    snapshot.callbacks[0].open_ns = 6'000'000;
    snapshot.callbacks[0].open_late = 1;
    trigger.see(snapshot);
    EXPECT_EQ(
        trigger.take(kStart, false),
        "/drive@Timer(2) missed its deadline of 5.000 ms, by an instance that has not ended for "
        "6.000 ms");
    trigger.see(snapshot);
    EXPECT_FALSE(trigger.take(kStart, false)) << "it was told";
    trigger.see(with_late("/drive@Timer(2)", 1, is_of_spec));
    EXPECT_FALSE(trigger.take(kStart, false)) << "it has ended";
  }
}

}  // namespace
}  // namespace cie::live
