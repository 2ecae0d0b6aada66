// What the spec has beyond the existing configurators: threads of DDS, time slices, the choice of a
// domain, the check of the machine.
#include <cie/tracepoints/scheduling_spec.hpp>

#include <string>
#include <string_view>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie {
namespace {

using testing::HasSubstr;

TEST(DdsThreads, AreFoundByTheirNames) {
  const auto spec = SchedulingSpec::parse(R"(
dds_threads:
  - {name: recvUC, policy: SCHED_FIFO, priority: 70}
  - {id: dq.user, policy: SCHED_FIFO, priority: 69}
  - {name: dq.*, policy: SCHED_OTHER, nice: 10}
non_ros_threads:
  - {name: dx.*, policy: SCHED_OTHER, nice: 1}
)",
                                          "spec.yaml");
  EXPECT_EQ(spec.find_thread("recvUC")->parameters.priority, 70U);
  EXPECT_EQ(spec.find_thread("dq.user")->parameters.priority, 69U) << "a whole name wins";
  EXPECT_EQ(spec.find_thread("dq.builtins")->parameters.nice, 10);
  EXPECT_EQ(spec.find_thread("dq"), nullptr);
  EXPECT_EQ(spec.find_thread("recv"), nullptr);
  EXPECT_EQ(spec.find_thread("dx.user"), nullptr) << "names of other threads are literal";
  EXPECT_EQ(spec.threads().size(), 4U);
}

TEST(Slice, IsOfSchedOther) {
  const auto spec = SchedulingSpec::parse(
      "callback_groups:\n"
      "  - {id: a, policy: SCHED_OTHER, nice: -5, slice: 100000}\n"
      "  - {id: b, policy: SCHED_OTHER}\n",
      "spec.yaml");
  EXPECT_EQ(spec.find_callback("a")->parameters.slice_ns, 100'000U);
  EXPECT_FALSE(spec.find_callback("b")->parameters.slice_ns);
}

std::string refused(const std::string& entry) {
  try {
    SchedulingSpec::parse("callback_groups:\n  - {id: a, " + entry + "}\n", "spec.yaml");
  } catch (const SpecError& error) {
    return error.what();
  }
  return {};
}

TEST(Clamps, AreOfEveryPolicyThatUsesThem) {
  const auto spec = SchedulingSpec::parse(
      "callback_groups:\n"
      "  - {id: a, policy: SCHED_OTHER, uclamp_min: 0, uclamp_max: 1024}\n"
      "  - {id: b, policy: SCHED_FIFO, priority: 3, uclamp_max: 1}\n",
      "spec.yaml");
  EXPECT_EQ(spec.find_callback("a")->parameters.util_min, 0U);
  EXPECT_EQ(spec.find_callback("a")->parameters.util_max, 1024U);
  EXPECT_EQ(spec.find_callback("b")->parameters.util_max, 1U);
  EXPECT_FALSE(spec.find_callback("b")->parameters.util_min);
}

TEST(Clamps, ThatDoNotFitAreErrors) {
  EXPECT_THAT(refused("policy: SCHED_OTHER, uclamp_max: 1025"), HasSubstr("uclamp_max"));
  EXPECT_THAT(refused("policy: SCHED_OTHER, uclamp_max: 0"), HasSubstr("uclamp_max"));
  EXPECT_THAT(refused("policy: SCHED_OTHER, uclamp_min: 5, uclamp_max: 4"), HasSubstr("exchange"));
  EXPECT_THAT(refused("uclamp_min: 5"), HasSubstr("without \"policy\""));
  EXPECT_THAT(refused("policy: SCHED_DEADLINE, runtime: 2000, deadline: 3000, period: 4000, "
                      "uclamp_min: 5"),
              HasSubstr("does not fit SCHED_DEADLINE"));
}

TEST(Cpuset, IsForDeadlineWithAffinity) {
  constexpr const char* kDeadline =
      "policy: SCHED_DEADLINE, runtime: 2000, deadline: 3000, period: 4000, ";
  const auto spec = SchedulingSpec::parse(std::string{"callback_groups:\n  - {id: a, "} +
                                              kDeadline + "affinity: [1], cpuset: exclusive}\n",
                                          "spec.yaml");
  EXPECT_TRUE(spec.find_callback("a")->parameters.has_exclusive_cpuset);
  EXPECT_THAT(refused(std::string{kDeadline} + "cpuset: exclusive"), HasSubstr("\"affinity\""));
  EXPECT_THAT(refused(std::string{kDeadline} + "affinity: [1], cpuset: shared"),
              HasSubstr("write exclusive"));
  EXPECT_THAT(refused("policy: SCHED_FIFO, priority: 1, affinity: [1], cpuset: exclusive"),
              HasSubstr("SCHED_DEADLINE"));
}

constexpr std::string_view kTwoDomains =
    "callback_groups:\n"
    "  - {id: a, domain_id: 0, policy: SCHED_OTHER, nice: 1}\n"
    "  - {id: a, domain_id: 7, policy: SCHED_OTHER, nice: 2}\n"
    "  - {id: b, policy: SCHED_OTHER, nice: 3}\n";

TEST(Domain, ChoosesItsEntries) {
  const auto seven = SchedulingSpec::parse(kTwoDomains, "spec.yaml", 7);
  EXPECT_EQ(seven.find_callback("a")->parameters.nice, 2);
  EXPECT_EQ(seven.find_callback("b")->parameters.nice, 3) << "an entry without one is for all";
  const auto eight = SchedulingSpec::parse(kTwoDomains, "spec.yaml", 8);
  EXPECT_EQ(eight.find_callback("a"), nullptr);
  EXPECT_EQ(seven.sha256(), eight.sha256());
}

TEST(Domain, NotChosenLeavesNoRoomForTwoAnswers) {
  EXPECT_THROW(SchedulingSpec::parse(kTwoDomains, "spec.yaml"), SpecError);
}

TEST(Domain, OfAnotherIsCheckedAllTheSame) {
  EXPECT_THROW(SchedulingSpec::parse("callback_groups:\n  - {id: a, domain_id: 1, nise: 1}\n",
                                     "spec.yaml", 0),
               SpecError);
}

constexpr std::string_view kLscpu =
    "Architecture:            x86_64\n"
    "Vendor ID:               GenuineIntel\n"
    "  Model name:            Intel(R) Xeon(R) CPU @ 2.10GHz\n"
    "    CPU family:          6\n"
    "    Thread(s) per core:  2\n"
    "    CPU max MHz:         2101.0000\n"
    "Model name:              another kind of core\n";

std::string mismatch(std::string_view fields) {
  const auto spec = SchedulingSpec::parse("hardware_info:\n" + std::string{fields}, "spec.yaml");
  try {
    check_hardware_info(spec, kLscpu);
  } catch (const SpecError& error) {
    return error.what();
  }
  return {};
}

TEST(HardwareInfo, IsWhatLscpuSays) {
  EXPECT_EQ(mismatch("  model_name: Intel(R) Xeon(R) CPU @ 2.10GHz\n"
                     "  cpu_family: 6\n"
                     "  threads_per_core: 2\n"
                     "  cpu_max_mhz: 2101.0\n"
                     "  frequency_boost: ~\n"),
            "");
}

TEST(HardwareInfo, ThatDiffersIsNamedWithWhatWasExpectedAndFound) {
  const std::string said = mismatch("  cpu_family: 6\n  threads_per_core: 1\n  stepping: 3\n");
  EXPECT_THAT(said, HasSubstr("spec.yaml:3: entry \"hardware_info\": \"threads_per_core\" should "
                              "be \"1\", this machine has \"2\""));
  EXPECT_THAT(said, HasSubstr("spec.yaml:4: entry \"hardware_info\": \"stepping\" should be \"3\", "
                              "lscpu reports no such field"));
  EXPECT_THAT(said, testing::Not(HasSubstr("cpu_family")));
}

TEST(HardwareInfo, OfThisMachineIsItsOwn) {
  check_hardware_info(SchedulingSpec::parse("callback_groups: []\n", "spec.yaml"));  // asks nothing
  const auto other = SchedulingSpec::parse("hardware_info: {model_name: abacus}\n", "spec.yaml");
  try {
    check_hardware_info(other);
    FAIL() << "this machine is no abacus";
  } catch (const SpecError& error) {
    EXPECT_THAT(error.what(), HasSubstr("abacus"));
    EXPECT_THAT(error.what(), testing::Not(HasSubstr("cannot be checked")));
  }
}

}  // namespace
}  // namespace cie
