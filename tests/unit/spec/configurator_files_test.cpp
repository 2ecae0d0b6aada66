// Files of the existing thread configurators are read as they are.
#include <cie/tracepoints/scheduling_spec.hpp>

#include <cstdint>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie {
namespace {

using ::testing::ElementsAre;
using ::testing::Pair;

using Cpus = std::vector<std::uint32_t>;

TEST(ConfiguratorFile, TemplateOfTheFirstConfigurator) {
  const auto spec = SchedulingSpec::parse(R"(callback_groups:
  - id: /sample_node@Subscription(/parameter_events)@Service(/sample_node/get_parameters)@Waitable@Waitable
    affinity: ~
    policy: SCHED_OTHER
    priority: 0

  - id: /sample_node@Subscription(/topic_in)@Waitable
    affinity: ~
    policy: SCHED_OTHER
    priority: 0

  - id: /sample_node@Timer(1333000000)
    affinity: ~
    policy: SCHED_OTHER
    priority: 0)",
                                          "template.yaml");
  ASSERT_EQ(spec.callbacks().size(), 3U);
  EXPECT_EQ(spec.callbacks()[0].id,
            "/sample_node@Subscription(/parameter_events)@Service(/sample_node/get_parameters)");
  const SpecEntry* entry = spec.find_callback("/sample_node@Subscription(/topic_in)");
  ASSERT_NE(entry, nullptr) << "waitables are no part of a callback's id";
  EXPECT_EQ(entry->parameters.policy, Policy::other);
  EXPECT_EQ(entry->parameters.nice, 0);
  EXPECT_EQ(entry->parameters.cpus, std::nullopt);
}

TEST(ConfiguratorFile, EveryPolicyAsItsManualWritesIt) {
  const auto spec = SchedulingSpec::parse(R"(
callback_groups:
  - id: xxxxx
    affinity:
      - 0
      - 1
    policy: SCHED_OTHER
    priority: -10
  - id: yyyyy
    affinity:
      - 2
      - 3
    policy: SCHED_FIFO
    priority: 50
  - id: zzzzz
    affinity:
      - 0
    policy: SCHED_DEADLINE
    priority: 0
    runtime: 10000000
    deadline: 10000000
    period: 20000000
  - id: idle
    affinity: ~
    policy: SCHED_IDLE
    priority: 0
)",
                                          "manual.yaml");
  EXPECT_EQ(spec.find_callback("xxxxx")->parameters.nice, -10);
  EXPECT_EQ(spec.find_callback("xxxxx")->parameters.cpus, (Cpus{0, 1}));
  EXPECT_EQ(spec.find_callback("yyyyy")->parameters.priority, 50U);
  EXPECT_EQ(spec.find_callback("zzzzz")->parameters.runtime_ns, 10'000'000U);
  EXPECT_EQ(spec.find_callback("zzzzz")->parameters.priority, 0U);
  EXPECT_EQ(spec.find_callback("idle")->parameters.policy, Policy::idle);
}

TEST(ConfiguratorFile, TemplateOfTheLaterConfigurator) {
  const auto spec = SchedulingSpec::parse(R"(
hardware_info:
  cpu_family: 6
  cpu_max_mhz: 2101.0000
  model_name: Intel(R) Xeon(R) Silver 4216 CPU @ 2.10GHz
rt_throttling:
  runtime_us: 950000
  period_us: 1000000
callback_groups:
  - id: /n@Timer(100000000)
    domain_id: 0
    affinity: ~
    policy: SCHED_OTHER
    nice: 0
  - id: /n@Timer(100000000)
    domain_id: 1
    affinity: ~
    policy: SCHED_OTHER
    nice: 0
  - id: /m/*
    domain_id: 0
    policy: SCHED_RR
    priority: 30
    affinity: []
non_ros_threads:
  - name: worker/*
    policy: SCHED_FIFO
    priority: 85
    affinity: [3]
kernel_threads:
  - name: ksoftirqd/0
    policy: SCHED_FIFO
irqs:
  - name: eth0
    affinity: [1]
)",
                                          "template.yaml");
  EXPECT_THAT(spec.hardware_info(),
              ElementsAre(Pair("cpu_family", "6"), Pair("cpu_max_mhz", "2101.0000"),
                          Pair("model_name", "Intel(R) Xeon(R) Silver 4216 CPU @ 2.10GHz")));
  EXPECT_EQ(spec.callbacks().size(), 2U) << "two domains asking the same are one entry";
  EXPECT_EQ(spec.find_callback("/m@Timer(1)")->parameters.priority, 30U);
  EXPECT_THAT(spec.not_applied(),
              ElementsAre(Pair("rt_throttling", 7), Pair("kernel_threads", 31), Pair("irqs", 34)));
  ASSERT_NE(spec.find_thread("worker/*"), nullptr) << "a thread's name is no pattern";
  EXPECT_EQ(spec.find_thread("worker/1"), nullptr);
}

TEST(ConfiguratorFile, ANiceValueOfSchedIdleMeansNothing) {
  const auto spec = SchedulingSpec::parse(
      "callback_groups:\n  - {id: a, policy: SCHED_IDLE, nice: -10, affinity: []}\n", "spec.yaml");
  EXPECT_EQ(spec.find_callback("a")->parameters.policy, Policy::idle);
  EXPECT_EQ(spec.find_callback("a")->parameters.nice, 0);
}

TEST(ConfiguratorFile, DomainsThatAskDifferentlyCannotBeToldApart) {
  EXPECT_THROW(SchedulingSpec::parse(R"(
callback_groups:
  - {id: a, domain_id: 0, policy: SCHED_OTHER, nice: 0}
  - {id: a, domain_id: 1, policy: SCHED_OTHER, nice: 5}
)",
                                     "spec.yaml"),
               SpecError);
}

}  // namespace
}  // namespace cie
