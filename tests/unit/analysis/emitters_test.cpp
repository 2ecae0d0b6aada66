// Who an event is of is remembered by its thread: what that names may change from event to event.
#include "support/trace_text.hpp"

#include <cstdint>
#include <map>
#include <string>

#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

TEST(Emitters, ReleaseOthersWhileTheyRun) {
  const auto result = test::analyze(test::trace_of(R"(
    callback plan timer id=plan
    callback left subscription id=left topic=/l
    callback right subscription id=right topic=/r
    publisher to_left topic=/l
    publisher to_right topic=/r
    10 start plan release=10
    11 publish to_left on=plan
    12 release left on=plan
    13 publish to_right on=plan
    14 release right on=plan
    15 publish to_left on=plan
    16 release left on=plan
    17 release left on=plan
    18 end plan
    20 start left from=to_left:0
    21 end left
    22 start left from=to_left:1
    23 end left
    24 start left
    25 end left
    26 start right from=to_right:0
    27 end right
    30 start plan release=20
    31 release right on=plan
    32 end plan
    34 start right
    35 end right)"));
  // What is counted is what callbacks and publishers say of themselves at the end.
  EXPECT_TRUE(result.report.defects.empty());
  EXPECT_TRUE(result.report.trace.complete);
  std::map<std::string, std::uint64_t> from_plan;
  for (const auto& edge : result.report.edges) {
    if (edge.from) from_plan[edge.topic] = edge.messages;
  }
  EXPECT_EQ(from_plan, (std::map<std::string, std::uint64_t>{{"/l", 2}, {"/r", 1}}));
}

}  // namespace
}  // namespace cie::analysis
