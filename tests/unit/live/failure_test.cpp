#include "failure.hpp"

#include <gtest/gtest.h>

namespace cie::live {
namespace {

using analysis::Verdict;

TEST(Failure, OfTheRecorderLeavesNothingThatPasses) {
  Snapshot snapshot;
  snapshot.verdict = Verdict::pass;
  note_failure(snapshot, "the consumer daemon ended");
  EXPECT_EQ(snapshot.verdict, Verdict::inconclusive);
  EXPECT_EQ(snapshot.message, "the consumer daemon ended");
  EXPECT_FALSE(snapshot.lost_events) << "nobody counted them";
  ASSERT_EQ(snapshot.verdicts.size(), 1U);
  EXPECT_EQ(snapshot.verdicts[0].rule, "T2");
  EXPECT_EQ(snapshot.verdicts[0].says, "trace: the consumer daemon ended");
}

TEST(Failure, OfTheRecorderHidesNoViolation) {
  Snapshot snapshot;
  snapshot.verdict = Verdict::fail;
  VerdictView violated;
  violated.rule = "M2";
  VerdictView undecided = violated;
  undecided.verdict = Verdict::inconclusive;
  snapshot.verdicts = {violated, undecided};
  note_failure(snapshot, "it failed");
  EXPECT_EQ(snapshot.verdict, Verdict::fail);
  ASSERT_EQ(snapshot.verdicts.size(), 3U);
  EXPECT_EQ(snapshot.verdicts[0].verdict, Verdict::fail);
  EXPECT_EQ(snapshot.verdicts[1].rule, "T2");
}

VerdictView lossy() {
  VerdictView view;
  view.rule = "T2";
  view.subject = "trace";
  view.verdict = Verdict::inconclusive;
  view.since_ns = 40;
  view.note = "discarded_events: 5 events lost";
  view.says = "trace: 5 events lost";
  return view;
}

TEST(Failure, OfTheRecorderIsOneVerdictWithLossesThatWereCounted) {
  Snapshot snapshot;
  snapshot.time_ns = 90;
  snapshot.verdict = Verdict::inconclusive;
  VerdictView other;
  other.rule = "T4";
  other.verdict = Verdict::inconclusive;
  snapshot.verdicts = {other, lossy()};
  note_failure(snapshot, "it failed");
  ASSERT_EQ(snapshot.verdicts.size(), 2U);
  EXPECT_EQ(snapshot.verdicts[0].rule, "T2");
  EXPECT_EQ(snapshot.verdicts[0].note, "it failed; discarded_events: 5 events lost");
  EXPECT_EQ(snapshot.verdicts[0].says, "trace: it failed; 5 events lost");
  EXPECT_EQ(snapshot.verdicts[0].since_ns, 40);
  EXPECT_EQ(snapshot.verdicts[1].rule, "T4");
}

TEST(Failure, OfTheRecorderTakesNoViolationOfNoLossAway) {
  Snapshot snapshot;
  snapshot.verdict = Verdict::fail;
  snapshot.verdicts = {lossy()};
  snapshot.verdicts[0].verdict = Verdict::fail;
  note_failure(snapshot, "it failed");
  EXPECT_EQ(snapshot.verdict, Verdict::fail);
  ASSERT_EQ(snapshot.verdicts.size(), 1U);
  EXPECT_EQ(snapshot.verdicts[0].verdict, Verdict::fail);
  EXPECT_EQ(snapshot.verdicts[0].says, "trace: it failed; 5 events lost");
}

}  // namespace
}  // namespace cie::live
