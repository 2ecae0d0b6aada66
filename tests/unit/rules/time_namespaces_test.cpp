// A process in a time namespace has another CLOCK_MONOTONIC than the machine's, which its events go by.
#include "support/verdicts.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using ::testing::HasSubstr;

// The kernel has its thread on CPU 1 long before it was read back, by the clocks that are not one.
std::string bound_to_cpu_0(const std::string& ahead) {
  return "process app ahead=" + ahead +
         "\ncallback fusion\n-100 initial fusion cpus=0\n-90 applied fusion cpus=0\n"
         "10 start fusion\n12 end fusion\n20 audit fusion cpus=0\n15 switch 1 idle fusion";
}

TEST(TimeNamespace, MakesTheKernelsEventsNoEvidence) {
  EXPECT_EQ(Verified(bound_to_cpu_0("0")).of("S4", "thread 101"), Verdict::fail);
  const Verified apart(bound_to_cpu_0("1000"));
  EXPECT_EQ(apart.of("S4", "thread 101"), Verdict::pass) << apart.evidence("S4", "thread 101");
  EXPECT_EQ(apart.of("S3", "thread 101"), Verdict::pass);
  EXPECT_EQ(apart["T6"], Verdict::inconclusive);
  EXPECT_THAT(
      apart.evidence("T6", "trace"),
      HasSubstr("process 100 is in a time namespace, where CLOCK_MONOTONIC is 1000 ns ahead of the "
                "machine's: the kernel's events tell nothing of it"));
}

TEST(TimeNamespace, OfTheOnlyProcessConcernsNoRule) {
  const Verified alone(
      "process app ahead=1000\ncallback fusion timer period=10\n10 start fusion release=9\n"
      "12 end fusion\n20 start fusion release=19\n22 end fusion");
  EXPECT_EQ(alone["T6"], Verdict::pass);
  EXPECT_EQ(alone.result.verdicts.verdict, Verdict::pass);
}

std::string two_processes(const std::string& ahead) {
  return "process one pid=100 ahead=" + ahead +
         "\ncallback a\nprocess two pid=200\ncallback b id=/b@Timer(10) timer period=10\n"
         "10 start a\n12 end a\n20 start b release=19\n22 end b";
}

// Their events share streams, whose times go back and forth.
TEST(TimeNamespace, BesideAnotherProcessDecidesNothing) {
  const auto regressing = "\n21 regress previous=1021";
  EXPECT_EQ(Verified(two_processes("0") + regressing)["T6"], Verdict::fail);
  const Verified apart(two_processes("1000") + regressing);
  EXPECT_EQ(apart["T6"], Verdict::inconclusive);
  for (const auto& rule : apart.result.verdicts.rules) {
    if (rule.id.starts_with("T") && rule.id != "T6") continue;  // by numbers and totals
    for (const auto& subject : rule.subjects)
      EXPECT_EQ(subject.verdict, Verdict::inconclusive) << rule.id << ' ' << subject.subject;
  }
}

TEST(TimeNamespace, OfAProcessThatDoesNotTellItIsTheManifests) {
  RecordingManifest manifest;
  manifest.host = "robot";
  manifest.exit = RecordedExit{.code = 0, .signal = std::nullopt};
  manifest.processes = {
      {.pid = 100, .name = "a", .start_ns = std::nullopt, .monotonic_offset_ns = -1000}};
  const Verified apart(trace_of(two_processes("0")),
                       std::vector<Recording>{{.name = "run1", .manifest = manifest}});
  EXPECT_EQ(apart["T6"], Verdict::inconclusive);
  EXPECT_THAT(apart.evidence("T6", "trace"), HasSubstr("1000 ns behind the machine's"));
}

}  // namespace
}  // namespace cie::test
