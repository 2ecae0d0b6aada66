#include <cie/tracepoints/scheduling_spec.hpp>
#include <cie/tracepoints/sha256.hpp>

#include "spec_error.hpp"

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

using Cpus = std::vector<std::uint32_t>;

SchedulingSpec parse(std::string_view text) { return SchedulingSpec::parse(text, "spec.yaml"); }

TEST(PolicyName, IsTheKernelsNameBothWays) {
  for (const auto policy : {Policy::other, Policy::fifo, Policy::round_robin, Policy::batch,
                            Policy::idle, Policy::deadline}) {
    EXPECT_EQ(policy_from_name(policy_name(policy)), policy);
  }
  EXPECT_EQ(policy_name(Policy::round_robin), "SCHED_RR");
  EXPECT_EQ(policy_name(Policy{4}), "");
  EXPECT_EQ(policy_from_name("FIFO"), std::nullopt);
}

TEST(SchedulingSpec, ReadsEveryKeyOfAnEntry) {
  const auto spec = parse(R"(
callback_groups:
  - id: /a/plan@Timer(20000000)
    policy: SCHED_FIFO
    affinity: [3, 0]
    priority: 46
    response_deadline: 303885
    wcet: 295903
    min_inter_arrival: 19047619
    max_inter_arrival: 40000000
    missed_releases_allowed: 2
    overwrites_allowed: 7
    foreign_work_budget: 1000
non_ros_threads:
  - name: cyclone-recv
    policy: SCHED_DEADLINE
    runtime: 1024
    deadline: 2000
    period: 2000
)");
  ASSERT_EQ(spec.callbacks().size(), 1U);
  const SpecEntry& entry = spec.callbacks().front();
  EXPECT_EQ(entry.id, "/a/plan@Timer(20000000)");
  EXPECT_EQ(entry.line, 3);
  EXPECT_EQ(entry.parameters.policy, Policy::fifo);
  EXPECT_EQ(entry.parameters.priority, 46U);
  EXPECT_EQ(entry.parameters.cpus, (Cpus{0, 3}));
  EXPECT_EQ(entry.response_deadline_ns, 303885);
  EXPECT_EQ(entry.wcet_ns, 295903);
  EXPECT_EQ(entry.min_inter_arrival_ns, 19047619);
  EXPECT_EQ(entry.max_inter_arrival_ns, 40000000);
  EXPECT_EQ(entry.missed_releases_allowed, 2U);
  EXPECT_EQ(entry.overwrites_allowed, 7U);
  EXPECT_EQ(entry.foreign_work_budget_ns, 1000);

  const SpecEntry* thread = spec.find_thread("cyclone-recv");
  ASSERT_NE(thread, nullptr);
  EXPECT_EQ(thread->parameters.policy, Policy::deadline);
  EXPECT_EQ(thread->parameters.runtime_ns, 1024U);
  EXPECT_EQ(thread->parameters.deadline_ns, 2000U);
  EXPECT_EQ(thread->parameters.period_ns, 2000U);
  EXPECT_EQ(spec.find_thread("other"), nullptr);
}

TEST(SchedulingSpec, LeavesOpenWhatTheEntryLeavesOpen) {
  for (const auto* fields :
       {"", "    affinity: ~\n    policy: ~\n", "    affinity: []\n    policy: []\n",
        "    affinity:\n    policy:\n    response_deadline: ~\n"}) {
    const auto spec = parse("callback_groups:\n  - id: /a@Timer(1)\n" + std::string(fields));
    const SpecEntry& entry = spec.callbacks().front();
    EXPECT_EQ(entry.parameters, ThreadParameters{}) << fields;
    EXPECT_EQ(entry.response_deadline_ns, std::nullopt) << fields;
    EXPECT_EQ(entry.missed_releases_allowed, std::nullopt) << fields;
  }
}

TEST(SchedulingSpec, ReadsChains) {
  const auto spec = parse(R"(
chains:
  - name: brake
    callbacks: [/a@Timer(1), /b@Subscription(/t)]
    path_latency: 1
    data_age: 9223372036854775807
)");
  ASSERT_EQ(spec.chains().size(), 1U);
  const SpecChain& chain = spec.chains().front();
  EXPECT_EQ(chain.name, "brake");
  EXPECT_THAT(chain.callbacks, ElementsAre("/a@Timer(1)", "/b@Subscription(/t)"));
  EXPECT_EQ(chain.path_latency_ns, 1);
  EXPECT_EQ(chain.reaction_time_ns, std::nullopt);
  EXPECT_EQ(chain.data_age_ns, INT64_MAX);
}

TEST(SchedulingSpec, FindsTheExactEntryBeforeTheNodesWildcard) {
  const auto spec = parse(R"(
callback_groups:
  - id: /a/plan/*
  - id: /a/plan@Timer(5)
  - id: /a/pla/*
)");
  EXPECT_EQ(spec.find_callback("/a/plan@Timer(5)")->line, 4);
  EXPECT_EQ(spec.find_callback("/a/plan@Timer(5)#2")->line, 3);
  EXPECT_EQ(spec.find_callback("/a/plan@Subscription(/t@1)")->line, 3);
  EXPECT_EQ(spec.find_callback("/a/pla@Timer(5)")->line, 5);
  EXPECT_EQ(spec.find_callback("/a/plan/sub@Timer(5)"), nullptr);
  EXPECT_EQ(spec.find_callback("/a/planner@Timer(5)"), nullptr);
  EXPECT_EQ(spec.find_callback("/a/plan"), nullptr);
  EXPECT_TRUE(spec.callbacks()[0].is_wildcard());
  EXPECT_FALSE(spec.callbacks()[1].is_wildcard());
  EXPECT_EQ(spec.callbacks()[0].node(), "/a/plan");
  EXPECT_EQ(spec.callbacks()[1].node(), "/a/plan");
}

TEST(SchedulingSpec, LoadsAFileAndKeepsItsNameAndHash) {
  const auto file = std::filesystem::path(testing::TempDir()) / "cie_scheduling_spec_test.yaml";
  const std::string text = "callback_groups: []\n";
  std::ofstream(file) << text;
  const auto spec = SchedulingSpec::load(file);
  EXPECT_EQ(spec.name(), file.string());
  EXPECT_EQ(spec.sha256(), sha256_hex(text));
  EXPECT_THAT(spec.callbacks(), IsEmpty());
  std::filesystem::remove(file);
  EXPECT_THROW(SchedulingSpec::load(file), SpecError);
  EXPECT_THROW(SchedulingSpec::load(testing::TempDir()), SpecError);
}

TEST(SchedulingSpec, FindsATimerThatHasANameByItAndThenByItsPeriod) {
  const auto spec = parse(R"(
callback_groups:
  - id: /n/*
  - id: /n@Timer(5)
  - id: /n@Timer(slow)
  - id: /n@Timer(007)
  - id: /m@Timer(99999999999999999999999)
)");
  EXPECT_EQ(spec.find_callback("/n@Timer(slow)", 5)->line, 5) << "its name wins";
  EXPECT_EQ(spec.find_callback("/n@Timer(tick)", 5)->line, 4);
  EXPECT_EQ(spec.find_callback("/n@Timer(tick)", 6)->line, 3) << "another period";
  EXPECT_EQ(spec.find_callback("/n@Timer(tick)")->line, 3) << "the period is not known";
  EXPECT_EQ(spec.find_callback("/n@Timer(5)#2", 5)->line, 3) << "not the first without a name";
  EXPECT_EQ(spec.find_callback("/n@Timer(7)", 5)->line, 3) << "that is a period";
  EXPECT_EQ(spec.find_callback("/n@Subscription(tick)", 5)->line, 3);
  EXPECT_EQ(spec.find_callback("/m@Timer(tick)", 5), nullptr);
}

TEST(SpecErrors, NameFileLineEntryAndRemedy) {
  EXPECT_THAT(error_of_entry("    policy: SCHED_OTHER\n    nice: 50\n"),
              AllOf(StartsWith("spec.yaml:4: entry \"/a@Timer(1)\": "), HasSubstr("\"nice\""),
                    HasSubstr("\"50\""), HasSubstr("-20 to 19")));
}

TEST(SchedulingSpec, TakesDurationsWithUnitsExactly) {
  const auto spec = SchedulingSpec::parse(R"(callback_groups:
  - id: a
    policy: SCHED_DEADLINE
    runtime: 1.5ms
    deadline: 0.01s
    period: 20000us
    response_deadline: 1s
    wcet: 250ns
    min_inter_arrival: 0ns
    max_inter_arrival: 9223372036.854775807s
    foreign_work_budget: 0.000001s
  - {id: b, policy: SCHED_OTHER, slice: 100us, wcet: 1.000001ms, response_deadline: 2min}
chains:
  - {name: c, callbacks: [a], path_latency: 5ms, reaction_time: 6.50ms, data_age: '7ms'}
)",
                                          "spec.yaml");
  const SpecEntry& a = *spec.find_callback("a");
  EXPECT_EQ(a.parameters.runtime_ns, 1'500'000U);
  EXPECT_EQ(a.parameters.deadline_ns, 10'000'000U);
  EXPECT_EQ(a.parameters.period_ns, 20'000'000U);
  EXPECT_EQ(a.response_deadline_ns, 1'000'000'000);
  EXPECT_EQ(a.wcet_ns, 250);
  EXPECT_EQ(a.min_inter_arrival_ns, 0);
  EXPECT_EQ(a.max_inter_arrival_ns, std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(a.foreign_work_budget_ns, 1'000);
  const SpecEntry& b = *spec.find_callback("b");
  EXPECT_EQ(b.parameters.slice_ns, 100'000U);
  EXPECT_EQ(b.wcet_ns, 1'000'001);
  EXPECT_EQ(b.response_deadline_ns, 120'000'000'000);
  EXPECT_EQ(spec.chains()[0].path_latency_ns, 5'000'000);
  EXPECT_EQ(spec.chains()[0].reaction_time_ns, 6'500'000);
  EXPECT_EQ(spec.chains()[0].data_age_ns, 7'000'000);
}

struct BadEntry {
  const char* fields;
  const char* complaint;
};

class SpecEntryError : public testing::TestWithParam<BadEntry> {};

TEST_P(SpecEntryError, IsNamedAndNothingIsClamped) {
  EXPECT_THAT(error_of_entry(GetParam().fields), HasSubstr(GetParam().complaint));
}

INSTANTIATE_TEST_SUITE_P(
    Parameters, SpecEntryError,
    testing::Values(
        BadEntry{"    priorty: 5\n", "unknown key \"priorty\"; did you mean \"priority\"?"},
        BadEntry{"    respons_deadline: 5\n", "; did you mean \"response_deadline\"?"},
        BadEntry{"    colour: 5\n",
                 "unknown key \"colour\"; man cie-spec lists those that are known"},
        BadEntry{"    nice: 1\n    nice: 1\n", "written twice"},
        BadEntry{"    policy: FIFO\n", "unknown policy \"FIFO\"; did you mean \"SCHED_FIFO\"?"},
        BadEntry{"    policy: sched_rr\n", "; did you mean \"SCHED_RR\"?"},
        BadEntry{"    policy: SCHED_BACTH\n", "; did you mean \"SCHED_BATCH\"?"},
        BadEntry{"    policy: fastest\n", "\"fastest\"; write SCHED_OTHER, SCHED_BATCH, "},
        BadEntry{"    policy: [SCHED_FIFO]\n", "\"policy\" is a list"},
        BadEntry{"    policy: SCHED_FIFO\n", "needs \"priority\""},
        BadEntry{"    policy: SCHED_FIFO\n    priority: 0\n", "from 1 to 99"},
        BadEntry{"    policy: SCHED_RR\n    priority: 100\n", "from 1 to 99"},
        BadEntry{"    policy: SCHED_FIFO\n    priority: 5\n    nice: 5\n", "\"nice\" does not fit"},
        BadEntry{"    policy: SCHED_FIFO\n    priority: 5\n    period: 5\n", "\"period\" does not"},
        BadEntry{"    policy: SCHED_OTHER\n    priority: 50\n", "\"priority\" 50 does not fit"},
        BadEntry{"    policy: SCHED_OTHER\n    priority: -21\n", "\"priority\" -21 does not fit"},
        BadEntry{"    policy: SCHED_OTHER\n    priority: -5\n    nice: 3\n", "contradicts"},
        BadEntry{"    policy: SCHED_BATCH\n    nice: -21\n", "from -20 to 19"},
        BadEntry{"    policy: SCHED_IDLE\n    nice: 20\n", "\"nice\""},
        BadEntry{"    nice: 5\n", "without \"policy\""},
        BadEntry{"    runtime: 5\n", "without \"policy\""},
        BadEntry{"    policy: SCHED_DEADLINE\n    runtime: 2000\n    deadline: 3000\n",
                 "needs \"period\""},
        BadEntry{"    policy: SCHED_DEADLINE\n    runtime: 1023\n    deadline: 3000\n"
                 "    period: 3000\n",
                 "from 1024"},
        BadEntry{"    policy: SCHED_DEADLINE\n    runtime: 4000\n    deadline: 3000\n"
                 "    period: 5000\n",
                 "beyond \"deadline\" 3000"},
        BadEntry{"    policy: SCHED_DEADLINE\n    runtime: 2000\n    deadline: 3001\n"
                 "    period: 3000\n",
                 "beyond \"period\" 3000"},
        BadEntry{"    policy: SCHED_DEADLINE\n    runtime: 2000\n    deadline: 3000\n"
                 "    period: 3000\n    priority: 9\n",
                 "\"priority\" does not fit"},
        BadEntry{"    affinity: 0\n", "\"affinity\" is a single value; write a list"},
        BadEntry{"    affinity: [1, 1]\n", "CPU 1 is listed twice"},
        BadEntry{"    affinity: [1024]\n", "from 0 to 1023"},
        BadEntry{"    affinity: [-1]\n", "from 0 to 1023"},
        BadEntry{"    affinity: [[0]]\n", "\"affinity\" is a list"}));

INSTANTIATE_TEST_SUITE_P(
    Bounds, SpecEntryError,
    testing::Values(
        BadEntry{"    wcet: 1.5\n", "\"1.5\""}, BadEntry{"    wcet: 1e6\n", "\"1e6\""},
        BadEntry{"    wcet: 0x10\n", "decimal digits"}, BadEntry{"    wcet: 010\n", "leading zero"},
        BadEntry{"    wcet: +5\n", "\"+5\""},
        BadEntry{"    wcet: 5 ms\n", "with a unit, as in 250ns, 1.5us, 5ms, 1s"},
        BadEntry{"    wcet: 5m\n", "with a unit"}, BadEntry{"    wcet: ms\n", "\"ms\""},
        BadEntry{"    wcet: 05ms\n", "leading zero"}, BadEntry{"    wcet: 0.5ns\n", "\"0.5ns\""},
        BadEntry{"    wcet: 1.05ns\n", "\"1.05ns\""},
        BadEntry{"    wcet: 0.00000000001s\n", "\"0.00000000001s\""},
        BadEntry{"    wcet: 5.00000001us\n", "\"5.00000001us\""},
        BadEntry{"    wcet: 1.0000005ms\n", "\"1.0000005ms\""},
        BadEntry{"    wcet: .5ms\n", "\".5ms\""}, BadEntry{"    wcet: 1.ms\n", "\"1.ms\""},
        BadEntry{"    wcet: -5ms\n", "\"-5ms\""}, BadEntry{"    wcet: 0s\n", "from 1"},
        BadEntry{"    wcet: 9223372037s\n", "9223372036854775807"},
        BadEntry{"    wcet: 9223372036.854775808s\n", "9223372036854775807"},
        BadEntry{"    missed_releases_allowed: 5ms\n", "unit"},
        BadEntry{"    policy: SCHED_OTHER\n    nice: 5ns\n", "unit"},
        BadEntry{"    policy: SCHED_OTHER\n    slice: 101ms\n", "to 100000000"},
        BadEntry{"    wcet: 9223372036854775808\n", "9223372036854775807"},
        BadEntry{"    wcet: 0\n", "from 1"}, BadEntry{"    wcet: {a: 1}\n", "a map"},
        BadEntry{"    response_deadline: -1\n", "from 1"},
        BadEntry{"    missed_releases_allowed: -1\n", "from 0"},
        BadEntry{"    min_inter_arrival: 2\n    max_inter_arrival: 1\n",
                 "beyond \"max_inter_arrival\""}));

struct BadSpec {
  const char* text;
  const char* complaint;
};

class SpecStructureError : public testing::TestWithParam<BadSpec> {};

TEST_P(SpecStructureError, IsNamedWithItsLine) {
  EXPECT_THAT(error_of(GetParam().text),
              AllOf(StartsWith("spec.yaml:"), HasSubstr(GetParam().complaint)));
}

INSTANTIATE_TEST_SUITE_P(
    Sections, SpecStructureError,
    testing::Values(
        BadSpec{"", "empty"}, BadSpec{"# only a comment\n", "empty"},
        BadSpec{"- id: /a@Timer(1)\n", "\"the file\" is a list"},
        BadSpec{
            "callback_groups:\n  - &a\n    id: /n@Timer(1000)\n  - <<: *a\n    id: /m@Timer(1000)\n",
            "spec.yaml:4: entry \"/m@Timer(1000)\": unknown key \"<<\""},
        BadSpec{"callbacks: []\n", ":1: unknown key \"callbacks\"; known are callback_groups, "},
        BadSpec{"callback_group: []\n", "; did you mean \"callback_groups\"?"},
        BadSpec{"callback_groups: {}\n", "\"callback_groups\" is a map"},
        BadSpec{"callback_groups:\n  - policy: SCHED_OTHER\n", ":2: neither \"id\" nor \"name\""},
        BadSpec{"callback_groups:\n  - id: a\n    name: a\n", "both \"id\" and \"name\""},
        BadSpec{"callback_groups:\n  - id: ''\n", "id is empty"},
        BadSpec{"callback_groups:\n  - id: [a]\n", "\"id\" is a list"},
        BadSpec{"callback_groups:\n  - id: a\n  - id: a\n",
                ":3: entry \"a\": the id has an entry "
                "already at line 2"},
        BadSpec{"callback_groups:\n  - id: /*\n", "\"<node>/*\""},
        BadSpec{"callback_groups:\n  - id: '*'\n", "\"<node>/*\""},
        BadSpec{"callback_groups:\n  - id: /a/*/b\n", "\"<node>/*\""},
        BadSpec{"callback_groups:\n  - id: /a*\n", "\"<node>/*\""},
        BadSpec{"callback_groups:\n  - id: /a@Timer(1)/*\n", "\"<node>/*\""},
        BadSpec{"non_ros_threads:\n  - name: t\n    wcet: 5\n", "unknown key \"wcet\""},
        BadSpec{
            "dds_threads:\n  - name: recvuc\n",
            "spec.yaml:2: entry \"recvuc\": Cyclone DDS has no thread of this name; did you mean "
            "\"recvUC\"?"},
        BadSpec{"dds_threads:\n  - name: tev\n    wcet: 5\n",
                "spec.yaml:3: entry \"tev\": unknown key \"wcet\""},
        BadSpec{"non_ros_threads:\n  - id: gc\ndds_threads:\n  - name: gc\n",
                "spec.yaml:4: entry \"gc\": the id has an entry already at line 2"},
        BadSpec{
            "callback_groups:\n  - {id: a, policy: SCHED_OTHER, slice: 99999}\n",
            "entry \"a\": \"slice\" is \"99999\"; write a whole number from 100000 to 100000000"},
        BadSpec{"callback_groups:\n  - {id: a, policy: SCHED_FIFO, priority: 1, slice: 200000}\n",
                "entry \"a\": \"slice\" does not fit SCHED_FIFO"},
        BadSpec{"callback_groups:\n  - {id: a, slice: 200000}\n",
                "\"slice\" does not fit an entry"},
        BadSpec{"callback_groups:\n  - {id: a, domain_id: 233}\n", "from 0 to 232"},
        BadSpec{"callback_groups:\n  - {id: a, domain_id: zero}\n", "entry \"a\": \"domain_id\""},
        BadSpec{"hardware_info: []\n", "\"hardware_info\" is a list"},
        BadSpec{"hardware_info:\n  model: [1]\n", "\"model\" is a list"},
        BadSpec{"chains:\n  - callbacks: [a]\n", "needs a \"name\""},
        BadSpec{"chains:\n  - name: c\n", "entry \"c\": a chain needs \"callbacks\""},
        BadSpec{"chains:\n  - name: c\n    callbacks: []\n", "needs \"callbacks\""},
        BadSpec{"chains:\n  - name: c\n    callbacks: [/a/*]\n", "exact logical ids"},
        BadSpec{"chains:\n  - name: c\n    callbacks: [a]\n    path_latency: 0\n", "from 1"},
        BadSpec{"chains:\n  - name: c\n    callbacks: [a]\n    latency: 5\n", "unknown key"},
        BadSpec{"chains:\n  - {name: c, callbacks: [a]}\n  - {name: c, callbacks: [a]}\n",
                ":3: entry \"c\": a chain of this name"},
        BadSpec{"callback_groups: []\n---\nchains: []\n", "second document"}));

}  // namespace
}  // namespace cie
