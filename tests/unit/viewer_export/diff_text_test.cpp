#include <cie/viewer_export/diff_writers.hpp>

#include <cstdint>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

using analysis::CallbackChange;
using analysis::Change;
using testing::HasSubstr;
using testing::StartsWith;

std::string diff_text_of(const std::vector<CallbackChange>& changes, const TextStyle& style = {}) {
  std::ostringstream out;
  write_diff_text(out, changes,
                  {.before = "old",
                   .after = "new",
                   .tolerance = 0.05,
                   .isolation_before = {.own_thread = 3, .ran = 3},
                   .isolation_after = {.own_thread = 2, .ran = 3}},
                  style);
  return out.str();
}

CallbackChange change_of(const std::string& id, const std::string& quantity, unsigned per_mille,
                         std::int64_t before, std::int64_t after) {
  const auto around = [](std::int64_t value) {
    return analysis::QuantileInterval{
        .lower = value - value / 10, .estimate = value, .upper = value + value / 10};
  };
  CallbackChange change;
  change.logical_id = id;
  change.is_before = true;
  change.is_after = true;
  change.quantities = {{.quantity = quantity,
                        .per_mille = per_mille,
                        .before = around(before),
                        .after = around(after),
                        .change = after > before   ? Change::worse
                                  : after < before ? Change::better
                                                   : Change::within}};
  return change;
}

const CallbackChange kBetter =
    change_of("/a/lidar@Subscription(/points)", "duration", 500, 2'000, 1'000);
const CallbackChange kSame = change_of("/a/map@Timer(1000)", "duration", 500, 2'000, 2'000);
const CallbackChange kWorse =
    change_of("/a/plan@Timer(20000000)", "response_time", 990, 1'000'000, 3'000'000);

TEST(DiffText, SaysFirstWhatBecameWorseAndBetterAndHowIsolationChanged) {
  auto worse = kWorse;
  worse.lost_isolation = true;
  EXPECT_EQ(
      diff_text_of({kBetter, kSame, worse}),
      "Worse: 1 of 3 callbacks; better: 1, beyond a tolerance of 5 %\n"
      "  isolation  3 of 3 callbacks had a thread of their own before, 2 of 3 after\n"
      "  worst      plan timer 20 ms: response time p99 +200.0 %, 1.000 ms -> 3.000 ms\n"
      "  best       lidar <- /points: duration p50 -50.0 %, 2.000 us -> 1.000 us\n"
      "  before     old\n"
      "  after      new\n"
      "\n"
      "  no longer has a thread of its own: plan timer 20 ms\n"
      "\n"
      "  callback          quantity             before     after    change         after lies in\n"
      "  plan timer 20 ms  response time p99  1.000 ms  3.000 ms  +200.0 %  2.700 ms .. 3.300 ms  "
      "worse\n"
      "  lidar <- /points  duration p50       2.000 us  1.000 us   -50.0 %    900 ns .. 1.100 us  "
      "better\n"
      "\n"
      "1 quantile within the tolerance; 0 undecided: too few instances to tell it from chance.\n"
      "Each statement is certain to 99.9 % if instances are independent of each other.\n");
}

TEST(DiffText, OfNoRegressionSaysWhatIsBetter) {
  EXPECT_THAT(diff_text_of({kBetter, kSame}),
              StartsWith("No regression; better: 1 of 2 callbacks, beyond a tolerance of 5 %\n"));
  EXPECT_THAT(diff_text_of({kSame}), StartsWith("No regression, beyond a tolerance of 5 %\n"));
}

TEST(DiffText, NamesWhatIsGoneAndNew) {
  auto gone = kSame;
  gone.is_after = false;
  auto added = kBetter;
  added.is_before = false;
  const auto text = diff_text_of({gone, added}, {.ids = true});
  EXPECT_THAT(text, HasSubstr("  is gone: /a/map@Timer(1000)\n"));
  EXPECT_THAT(text, HasSubstr("  is new: /a/lidar@Subscription(/points)\n"));
}

TEST(DiffText, CountsThoseThatRanAndHadAThreadOfTheirOwn) {
  using analysis::Isolation;
  std::vector<analysis::CallbackSample> samples(4);
  samples[0].isolation = Isolation::isolated;
  samples[1].isolation = Isolation::not_isolated;
  samples[2].isolation = Isolation::never_ran;
  samples[3].isolation.reset();
  EXPECT_EQ(isolation_count(samples), (IsolationCount{.own_thread = 1, .ran = 3, .unknown = 1}));
}

}  // namespace
}  // namespace cie::viewer_export
