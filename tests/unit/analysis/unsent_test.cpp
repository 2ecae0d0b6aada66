// Messages that were not sent in time: publish_failed of the contract.
#include "support/trace_text.hpp"

#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

using testing::ElementsAre;
using testing::FieldsAre;

std::vector<UnsentMessages> unsent(std::string_view text, const AnalysisOptions& options = {}) {
  const auto result = test::analyze(test::trace_of(text), options);
  return result.report.processes.front().unsent.value_or(std::vector<UnsentMessages>{});
}

constexpr std::string_view kThree = R"(
  callback plan timer
  publisher scan topic=/scan
  publisher map topic=/map
  10 start plan
  11 publish scan on=plan
  12 unsent scan on=plan
  13 publish map on=plan
  14 publish scan on=plan
  15 unsent scan on=plan
  20 end plan)";

TEST(UnsentMessages, AreCountedByPublisher) {
  EXPECT_THAT(unsent(kThree), ElementsAre(FieldsAre("/node", "/scan", 2U)));
}

// A publication that was lost, too, follows from the totals of those beside it.
TEST(UnsentMessages, BetweenThoseThatAreToldAreCountedToo) {
  EXPECT_THAT(unsent(std::string(kThree) + "\n16 unsent scan on=plan total=5"),
              ElementsAre(FieldsAre("/node", "/scan", 5U)));
}

TEST(UnsentMessages, AreThoseOfTheWindow) {
  AnalysisOptions options;
  options.window = TimeWindow{.from = Timestamp{14}, .to = Timestamp{20}};
  EXPECT_THAT(unsent(kThree, options), ElementsAre(FieldsAre("/node", "/scan", 1U)));
}

TEST(UnsentMessages, OfWhomAllWereSentAreNone) {
  EXPECT_THAT(unsent("callback plan timer\n10 start plan\n20 end plan"), testing::IsEmpty());
}

}  // namespace
}  // namespace cie::analysis
