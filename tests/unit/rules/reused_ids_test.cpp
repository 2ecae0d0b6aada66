// Tids and pids are given anew. Where the end of who had one and the beginning of the next are lost, the
// two are not told apart, and nothing that follows from their being one fails.
#include "support/verdicts.hpp"

#include <string>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;

constexpr auto kOfPlan = [](const auto& event, const EventHead&) {
  return to_number(event.callback) == 1;
};

// fusion's thread ends at 14 and plan's, which gets its tid, begins at 18.
TextTrace of_reused_tid(const std::string& process, const std::string& more = "") {
  return trace_of(process + R"(
    callback fusion pooled
    callback plan pooled
    thread former callback of=fusion tid=101
    thread latter callback of=plan tid=101
    -90 begin former
    10 start fusion on=former
    12 end fusion on=former
    14 finish former
    18 begin latter
    30 start plan on=latter
    32 end plan on=latter
    34 finish latter)" +
                  more);
}

void erase_end_and_beginning(TextTrace& trace) {
  trace.erase<ThreadFini>(
      [](const ThreadFini&, const EventHead& head) { return head.time.ns == 14; });
  trace.erase<ThreadInit>(kOfPlan);
}

void expect(Verdict expected, const TextTrace& trace) {
  const Verified verified(trace);
  for (const auto* rule : {"M2", "M6"})
    EXPECT_EQ(verified.of(rule, "thread 101"), expected)
        << rule << ' ' << verified.evidence(rule, "thread 101");
}

TEST(ReusedTid, IsNoThreadOfTwoCallbacksWhereEndAndBeginningAreLost) {
  auto trace = of_reused_tid("process app");
  expect(Verdict::pass, trace);
  erase_end_and_beginning(trace);
  expect(Verdict::inconclusive, trace);
  trace.erase<CallbackInit>(kOfPlan);
  expect(Verdict::inconclusive, trace);
}

TEST(ReusedTid, IsNotOfTheCallbackThatTheThreadBeforeWasAnnouncedFor) {
  auto trace = of_reused_tid("process app");
  erase_end_and_beginning(trace);
  const auto is_of_fusion = [](const auto& event, const EventHead&) {
    return to_number(event.callback) == 0;
  };
  trace.erase<CallbackStart>(is_of_fusion);
  trace.erase<CallbackEnd>(is_of_fusion);
  EXPECT_EQ(Verified(trace).of("M6", "thread 101"), Verdict::inconclusive);
}

TEST(ReusedTid, OfAProcessWithoutTotalsMayHaveBeenGivenWhereTheTracerLostEvents) {
  auto lossy = of_reused_tid("process app crash", "\n14 discard user until=18 count=2");
  erase_end_and_beginning(lossy);
  expect(Verdict::inconclusive, lossy);
  auto later = of_reused_tid("process app crash", "\n40 discard user until=41 count=2");
  erase_end_and_beginning(later);
  expect(Verdict::fail, later);
}

}  // namespace
}  // namespace cie::test
