// The first audit of an attached process's thread stands for what was applied. Its number tells nothing
// of whether others came before, so what the tracer lost before is what counts (law L2).
#include "support/verdicts.hpp"

#include <algorithm>
#include <string>
#include <variant>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;

constexpr const char* kSpec =
    "callback_groups:\n  - {id: fusion, policy: SCHED_FIFO, priority: 10}\n";

constexpr const char* kChanged = R"(
  process app attached
  callback fusion next=3
  -5 begin fusion
  1 audit fusion policy=fifo priority=10 n=4
  10 start fusion
  12 end fusion
  20 audit fusion policy=fifo priority=12 n=5
  30 audit fusion policy=fifo priority=12 n=6)";

TextTrace without_first_audit(const std::string& text) {
  auto trace = trace_of(text);
  trace.erase<ThreadSched>([](const ThreadSched& e, const EventHead&) { return e.n == 4; });
  return trace;
}

TEST(LostFirstAudit, LeavesOpenWhatTheThreadRanAs) {
  const Verified whole(kChanged, kSpec);
  ASSERT_EQ(whole["S1"], Verdict::pass);
  ASSERT_EQ(whole["S3"], Verdict::fail);
  const auto loss = std::string(kChanged) + "\n0 discard user until=2 count=1";
  const Verified lossy(without_first_audit(loss), kSpec);
  EXPECT_EQ(lossy["S1"], Verdict::inconclusive);
  EXPECT_EQ(lossy["S3"], Verdict::inconclusive);
}

// A process announces all that there is again, as for a second session.
TEST(LostFirstAudit, MayHaveFollowedAnAnnouncementThatWasLostToo) {
  // The thread's own, or all of it.
  const auto announced_at_25 = [](const std::string& loss, bool is_begin_lost) {
    auto lossy = without_first_audit(std::string(kChanged) + "\n24 reload\n" + loss);
    if (is_begin_lost) {
      lossy.erase<RunBegin>(
          [](const RunBegin&, const EventHead& head) { return head.time.ns < 24; });
    }
    for (auto& event : lossy.events)
      if (std::holds_alternative<ThreadInit>(event.body)) event.head.time = Timestamp{25};
    std::ranges::stable_sort(lossy.events, {}, [](const Event& e) { return e.head.time; });
    return Verified(lossy, kSpec);
  };
  for (const auto is_begin_lost : {false, true}) {
    const auto lossy = announced_at_25("-6 discard user until=2 count=2", is_begin_lost);
    EXPECT_EQ(lossy["S1"], Verdict::inconclusive) << is_begin_lost;
    EXPECT_EQ(lossy["S3"], Verdict::inconclusive) << is_begin_lost;
  }
  EXPECT_EQ(announced_at_25("26 discard user until=27 count=1", false)["S1"], Verdict::fail)
      << "an audit was there by then";
}

// What was applied since tells nothing of before.
TEST(LostFirstAudit, LeavesOpenWhetherTheThreadWasChangedBeforeAnythingWasApplied) {
  const auto applied = std::string(kChanged) + R"(
    22 applied fusion policy=fifo priority=12 n=6
    30 audit fusion policy=fifo priority=12 n=7)";
  auto whole = trace_of(applied);
  const auto is_former = [](const ThreadSched& e, const EventHead& head) {
    return e.n == 6 && head.time.ns == 30;
  };
  whole.erase<ThreadSched>(is_former);
  ASSERT_EQ(Verified(whole)["S3"], Verdict::fail);
  auto lossy = without_first_audit(applied + "\n0 discard user until=2 count=1");
  lossy.erase<ThreadSched>(is_former);
  EXPECT_EQ(Verified(lossy)["S3"], Verdict::inconclusive);
}

// It ran outside the mask that was lost, which is not judged by a later one.
TEST(LostFirstAudit, LeavesOpenWhereTheThreadWasAllowedToRun) {
  const std::string outside = R"(
    process app attached
    callback fusion next=3 cpu=1
    -5 begin fusion
    1 audit fusion cpus=1 n=4
    10 start fusion cpu=0
    12 end fusion cpu=0
    20 audit fusion cpus=1 n=5
    30 start fusion
    32 end fusion)";
  const auto loss = "\n0 discard user until=2 count=1";
  ASSERT_EQ(Verified(outside)["S4"], Verdict::fail);
  EXPECT_EQ(Verified(without_first_audit(outside + loss))["S4"], Verdict::inconclusive);
  const auto again = "\n40 start fusion cpu=0\n42 end fusion cpu=0";
  EXPECT_EQ(Verified(without_first_audit(outside + again + loss))["S4"], Verdict::fail);
}

// Another process had the callback before, on a thread with priority 10.
TEST(LostFirstAudit, LeavesOpenWhetherTheParametersSurvivedARestart) {
  const std::string restarted = R"(
    process first pid=200 until=500
    callback a id=/n@Timer timer
    101 initial a
    102 applied a policy=fifo priority=10
    110 start a
    112 end a
    process second pid=300 from=600 attached
    callback b id=/n@Timer timer next=3
    601 begin b
    602 audit b policy=fifo priority=10 n=4
    610 start b
    612 end b
    620 audit b policy=fifo priority=12 n=5)";
  ASSERT_EQ(Verified(restarted)["M5"], Verdict::pass);
  EXPECT_EQ(Verified(without_first_audit(restarted))["M5"], Verdict::fail);
  const auto loss = restarted + "\n601 discard user until=603 count=1";
  EXPECT_EQ(Verified(without_first_audit(loss))["M5"], Verdict::inconclusive);
}

}  // namespace
}  // namespace cie::test
