// A node destroys its timer and makes another one of the same period: no event of ROS 2 tells that the first one
// is gone, so which of the two an entry of a spec means is not known.
#include "ros2_text.hpp"
#include "support/verdicts.hpp"

#include <optional>
#include <string>
#include <string_view>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using analysis::Verdict;
using testing::HasSubstr;

// The first one ran for 2, the second one for 10.
constexpr const char* kRenewed = R"(
    0 rcl_init context_handle=0x1
    1 rcl_node_init node_handle=0x10 node_name=n namespace=/
    2 rcl_timer_init timer_handle=0x20 period=5
    3 rclcpp_timer_callback_added timer_handle=0x20 callback=0x30
    4 rclcpp_timer_link_node timer_handle=0x20 node_handle=0x10
    10 callback_start callback=0x30
    12 callback_end callback=0x30
    15 rcl_timer_init timer_handle=0x21 period=5
    16 rclcpp_timer_callback_added timer_handle=0x21 callback=0x31
    17 rclcpp_timer_link_node timer_handle=0x21 node_handle=0x10
    20 callback_start callback=0x31
    30 callback_end callback=0x31
)";
constexpr const char* kFirstRunsAgain = R"(
    40 callback_start callback=0x30
    42 callback_end callback=0x30
)";

std::string spec_of(const std::string& entries) { return "callback_groups:\n" + entries; }

// Empty: the rule does not judge the second one.
std::optional<Verdict> of_second(const Ros2Result& result, std::string_view rule) {
  for (const auto& each : result.analysis.verdicts.rules) {
    if (each.id != rule) continue;
    for (const auto& subject : each.subjects) {
      if (subject.name() == "callback /n@Timer(5)#2") return subject.verdict;
    }
  }
  return std::nullopt;
}

TEST(Ros2RenewedCallbacks, TheEntryOfTheFormerMayBeTheirs) {
  const auto spec = spec_of("  - {id: \"/n@Timer(5)\", response_deadline: 4}\n");
  const auto result = analyze_ros2(kRenewed, -1, spec);
  EXPECT_EQ(of_second(result, "R3"), Verdict::inconclusive);
  EXPECT_THAT(result.evidence("R3"), HasSubstr("spec.yaml:2 names /n@Timer(5), which was not seen "
                                               "since this one was made"));
  EXPECT_EQ(of_second(result, "R4"), std::nullopt) << "no entry asks for that";
}

TEST(Ros2RenewedCallbacks, TheEntryOfOneThatRunsOnIsNotTheirs) {
  const auto spec = spec_of("  - {id: \"/n@Timer(5)\", response_deadline: 4}\n");
  const auto result = analyze_ros2(std::string(kRenewed) + kFirstRunsAgain, -1, spec);
  EXPECT_EQ(of_second(result, "R3"), std::nullopt);
}

TEST(Ros2RenewedCallbacks, AnEntryOfTheirOwnIsTheirs) {
  const auto spec = spec_of(
      "  - {id: \"/n@Timer(5)\", response_deadline: 1000}\n"
      "  - {id: \"/n@Timer(5)#2\", response_deadline: 4}\n");
  EXPECT_EQ(of_second(analyze_ros2(kRenewed, -1, spec), "R3"), Verdict::fail);
}

TEST(Ros2RenewedCallbacks, NeitherIsTheNodesEntryTheirsForCertain) {
  const auto spec = spec_of(
      "  - {id: \"/n@Timer(5)\", response_deadline: 1000}\n"
      "  - {id: \"/n/*\", response_deadline: 4}\n");
  EXPECT_EQ(of_second(analyze_ros2(kRenewed, -1, spec), "R3"), Verdict::inconclusive);
  const auto both = analyze_ros2(std::string(kRenewed) + kFirstRunsAgain, -1, spec);
  EXPECT_EQ(of_second(both, "R3"), Verdict::fail);
}

TEST(Ros2RenewedCallbacks, WhetherTheSpecAsksForParametersIsUnknown) {
  const auto spec = spec_of("  - {id: \"/n@Timer(5)\", policy: SCHED_FIFO, priority: 20}\n");
  for (const auto* rule : {"S1", "S2"})
    EXPECT_EQ(of_second(analyze_ros2(kRenewed, -1, spec), rule), Verdict::inconclusive) << rule;
}

}  // namespace
}  // namespace cie::test
