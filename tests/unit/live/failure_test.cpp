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

}  // namespace
}  // namespace cie::live
