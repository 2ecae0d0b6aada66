// Numbers and totals of a process prove what it did between two sessions. What has none may have
// happened then.
#include "support/verdicts.hpp"

#include <algorithm>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;

TEST(SessionGap, IsDoubtedWhereNoNumberTellsOfIt) {
  const auto judged = [](const std::string& process, bool has_gap, bool is_lossless = false) {
    auto trace = trace_of("    process app " + process + R"(
    callback fusion subscription topic=/a
    5 release fusion
    10 start fusion
    12 end fusion
    20 release fusion
    22 start fusion
    24 end fusion)");
    const auto next = std::ranges::find(trace.events, Timestamp{20},
                                        [](const Event& event) { return event.head.time; });
    const EventHead head{.time = Timestamp{19}, .stream = {}, .cpu = {}, .pid = {}, .tid = {}};
    const SessionGap gap{.begin = Timestamp{13}, .end = Timestamp{19}};
    if (has_gap) trace.events.insert(next, {.head = head, .body = gap});
    AnalysisOptions options;
    options.require_lossless = is_lossless;
    return analyze(trace, options).verdicts;
  };
  const auto verdict_on = [](const VerdictReport& report, std::string_view rule) {
    return std::ranges::find(report.rules, rule, &RuleVerdict::id)->verdict;
  };
  const auto whole = judged("", false);
  const auto cut = judged("", true);
  for (std::size_t i = 0; i < whole.rules.size(); ++i)
    EXPECT_EQ(cut.rules[i].verdict, whole.rules[i].verdict) << cut.rules[i].id;
  EXPECT_EQ(verdict_on(judged("attached crash", true), "T3"), Verdict::pass);
  EXPECT_EQ(verdict_on(judged("attached crash", false), "M2"), Verdict::pass);
  EXPECT_EQ(verdict_on(judged("attached crash", true), "M2"), Verdict::inconclusive)
      << "another callback may have come and gone on that thread";
  EXPECT_EQ(verdict_on(judged("attached crash", false), "Q1"), Verdict::pass);
  EXPECT_EQ(verdict_on(judged("attached crash", true), "Q1"), Verdict::inconclusive);
  EXPECT_EQ(verdict_on(judged("", false, true), "T2"), Verdict::pass);
  EXPECT_EQ(verdict_on(judged("", true, true), "T2"), Verdict::inconclusive)
      << "nothing need have happened then";
}

}  // namespace
}  // namespace cie::test
