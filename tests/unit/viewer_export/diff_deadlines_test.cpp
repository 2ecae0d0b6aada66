// What cie diff says of late instances.
#include "diff_texts.hpp"

#include <cstdint>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

using analysis::CallbackChange;
using analysis::Change;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

// What comes before the command that tells the rest.
TEST(DiffText, ComparesDeadlinesFirstWhereThereAreSome) {
  EXPECT_EQ(diff_text_of({kSame, with_deadline(2'000'000, 3, 0), with_deadline(2'000'000, 7, 1)}),
            "Late: 10 of 200 instances before, 1 of 200 after; 2 callbacks have a deadline\n"
            "No regression; better: 2 of 3 callbacks, beyond a tolerance of 5 %\n"
            "  isolation  3 of 3 callbacks had a thread of their own before, 2 of 3 after\n"
            "\n"
            "  deadline 2.000ms    late           p99               max\n"
            "  callback          old  new      old      new      old      new\n"
            "  n7_1 timer 20 ms    7    1  3.000ms  1.000ms  4.000ms  1.500ms\n"
            "  n3_0 timer 20 ms    3    0  3.000ms  1.000ms  4.000ms  1.500ms\n"
            "0 of 3 quantiles undecided; 2 counts that may differ by chance.\n"
            "  every change: cie diff old new --all\n");
}

TEST(DiffText, TellsWhatIsLateMoreOften) {
  auto change = with_deadline(2'000'000, 0, 9);
  change.late = analysis::Change::worse;
  change.quantities.clear();
  const auto text = diff_text_of({change});
  EXPECT_THAT(text, HasSubstr("Worse: 1 of 1 callback (1 late more often)\n"));
  EXPECT_THAT(text, HasSubstr("  is late more often: n0_9 timer 20 ms (0 -> 9)\n"));
  EXPECT_THAT(text, Not(HasSubstr("by chance")));
}

TEST(DiffText, MarksALongestRunOfWhichOnlyABoundIsKnown) {
  auto change = with_deadline(2'000'000, 7, 1);
  change.lateness_after->is_max_bound = true;  // 1.5 ms at least
  EXPECT_THAT(diff_text_of({change}), HasSubstr("4.000ms  >1.500ms\n"));
}

TEST(DiffText, HasAColumnOfDeadlinesThatDiffer) {
  const auto text = diff_text_of({with_deadline(2'000'000, 3, 0), with_deadline(500'000, 7, 1)});
  EXPECT_THAT(text, HasSubstr("  n7_1 timer 20 ms   500.0us    7    1"));
  EXPECT_THAT(text, HasSubstr("  n3_0 timer 20 ms   2.000ms    3    0"));
}

TEST(DiffText, ShowsTheFiveThatWereLateMostOftenAndSaysWhetherOthersWere) {
  std::vector<CallbackChange> changes;
  for (std::uint64_t i = 0; i < 7; ++i)
    changes.push_back(with_deadline(2'000'000, i, 0));
  const auto text = diff_text_of(changes);
  EXPECT_THAT(text, HasSubstr("n6_0"));
  EXPECT_THAT(text, HasSubstr("  n2_0 timer 20 ms    2    0"));
  EXPECT_THAT(text, Not(HasSubstr("n1_0")));
  EXPECT_THAT(text, HasSubstr("\n  ... 2 more callbacks\n"));
  changes[1].lateness_before->late = 0;
  EXPECT_THAT(diff_text_of(changes), HasSubstr("\n  ... 2 more callbacks, never late\n"));
}

TEST(DiffText, BreaksTheLineOfLateRunsWhereItIsTooLong) {
  EXPECT_THAT(
      diff_text_of({with_deadline(2'000'000, 3, 0)}, {.columns = 60}),
      StartsWith(
          "Late: 3 of 100 instances before, 0 of 100 after;\n  1 callback has a deadline\n"));
}

TEST(DiffText, SaysBeforeLateRunsThatRecordsDoNotDecide) {
  auto comparison = comparison_of({with_deadline(2'000'000, 3, 0)});
  comparison.after.losses = {{analysis::DefectKind::seq_gaps, 5}};
  EXPECT_THAT(diff_text_of(comparison),
              StartsWith("Undecided: no regression in what was recorded"));
}

TEST(DiffText, TellsBesideDeadlinesWhatIsUndecided) {
  auto change = with_deadline(2'000'000, 3, 0);
  change.quantities[0].change = Change::undecided;
  change.quantities.push_back(kSame.quantities[0]);
  EXPECT_THAT(diff_text_of({change}),
              testing::EndsWith("\n1 of 2 quantiles undecided; 1 count that may differ by chance.\n"
                                "  every change: cie diff old new --all\n"));
}

TEST(DiffText, RunsAreLateAgainstOneDeadlineOnly) {
  auto change = kSame;
  change.lateness_before =
      analysis::Lateness{.deadline = {1'000}, .late = 5, .instances = 10, .max = 1'500};
  change.lateness_after =
      analysis::Lateness{.deadline = {2'000}, .late = 1, .instances = 10, .max = 2'500};
  const auto text = diff_text_of({change});
  EXPECT_THAT(text, Not(HasSubstr("Late:")));
  EXPECT_THAT(
      text,
      HasSubstr("\n  deadlines  1 callback has another deadline than before: not compared\n"));
  change.lateness_after.reset();
  EXPECT_THAT(diff_text_of({change, kWorse}),
              HasSubstr("1 callback has another deadline than before"));
}

}  // namespace
}  // namespace cie::viewer_export
