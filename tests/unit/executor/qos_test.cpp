#include <cie/executor/qos.hpp>

#include "dds/dds_qos.hpp"

#include <chrono>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::executor {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

struct Policies {
  dds_history_kind_t history{};
  std::int32_t depth = -7;
  dds_reliability_kind_t reliability{};
  dds_duration_t blocking = 0;
  dds_durability_kind_t durability{};
  bool disposes = true;
  dds_duration_t deadline = 0;
  dds_duration_t lifespan = 0;
  dds_liveliness_kind_t liveliness{};
  dds_duration_t lease = 0;
};

Policies policies_of(const QoS& qos) {
  const auto dds_qos = dds::to_dds(qos, "topic");
  Policies found;
  EXPECT_TRUE(dds_qget_history(dds_qos.get(), &found.history, &found.depth));
  EXPECT_TRUE(dds_qget_reliability(dds_qos.get(), &found.reliability, &found.blocking));
  EXPECT_TRUE(dds_qget_durability(dds_qos.get(), &found.durability));
  EXPECT_TRUE(dds_qget_writer_data_lifecycle(dds_qos.get(), &found.disposes));
  EXPECT_TRUE(dds_qget_deadline(dds_qos.get(), &found.deadline));
  EXPECT_TRUE(dds_qget_lifespan(dds_qos.get(), &found.lifespan));
  EXPECT_TRUE(dds_qget_liveliness(dds_qos.get(), &found.liveliness, &found.lease));
  return found;
}

TEST(Qos, ANumberIsAReliableVolatileQueueOfThatDepth) {
  const Policies policies = policies_of(10);
  EXPECT_EQ(policies.history, DDS_HISTORY_KEEP_LAST);
  EXPECT_EQ(policies.depth, 10);
  EXPECT_EQ(policies.reliability, DDS_RELIABILITY_RELIABLE);
  EXPECT_EQ(policies.blocking, 100'000'000);
  EXPECT_EQ(policies.durability, DDS_DURABILITY_VOLATILE);
  EXPECT_FALSE(policies.disposes);
  EXPECT_EQ(policies.deadline, DDS_INFINITY);
  EXPECT_EQ(policies.lifespan, DDS_INFINITY);
  EXPECT_EQ(policies.liveliness, DDS_LIVELINESS_AUTOMATIC);
  EXPECT_EQ(policies.lease, DDS_INFINITY);
}

TEST(Qos, HasDurationsInNanoseconds) {
  const QoS qos = QoS{1}
                      .deadline(20ms)
                      .lifespan(1s)
                      .liveliness(Liveliness::manual_by_topic)
                      .liveliness_lease_duration(300us)
                      .max_blocking_time(7ms);
  const Policies policies = policies_of(qos);
  EXPECT_EQ(policies.deadline, 20'000'000);
  EXPECT_EQ(policies.lifespan, 1'000'000'000);
  EXPECT_EQ(policies.liveliness, DDS_LIVELINESS_MANUAL_BY_TOPIC);
  EXPECT_EQ(policies.lease, 300'000);
  EXPECT_EQ(policies.blocking, 7'000'000);
  EXPECT_EQ(policies_of(QoS{1}.max_blocking_time(std::nullopt)).blocking, DDS_INFINITY);
  EXPECT_EQ(qos.deadline(), 20ms);
  EXPECT_EQ(QoS{1}.lifespan(), std::nullopt);
}

TEST(Qos, HasNoDurationsThatAreNotPositive) {
  const auto refusal = [](const QoS& qos) -> std::string {
    try {
      dds::to_dds(qos, "/scan");
      return "accepted";
    } catch (const std::logic_error& error) {
      return error.what();
    }
  };
  EXPECT_EQ(refusal(QoS{1}.deadline(0ns)),
            "the deadline in the QoS of \"/scan\" cannot be 0 ns: write more, or none for an "
            "unlimited one");
  EXPECT_THAT(refusal(QoS{1}.lifespan(-5ns)), HasSubstr("the lifespan in the QoS of \"/scan\""));
  EXPECT_THAT(refusal(QoS{1}.max_blocking_time(0ns)), HasSubstr("the blocking time in"));
  EXPECT_THAT(refusal(QoS{1}.liveliness_lease_duration(0ns)), HasSubstr("the lease duration in"));
}

TEST(Qos, OfSensorDataIsShortAndBestEffort) {
  const Policies policies = policies_of(SensorDataQoS{});
  EXPECT_EQ(policies.depth, 5);
  EXPECT_EQ(policies.reliability, DDS_RELIABILITY_BEST_EFFORT);
}

TEST(Qos, KeepAllHasNoDepth) {
  const Policies policies = policies_of(QoS{KeepAll{}});
  EXPECT_EQ(policies.history, DDS_HISTORY_KEEP_ALL);
  EXPECT_EQ(QoS{KeepAll{}}.depth(), 0U);
}

TEST(Qos, TransientLocalKeepsAsMuchForTheLateAsInTheQueue) {
  const auto dds_qos = dds::to_dds(QoS{KeepLast{3}}.transient_local(), "topic");
  dds_duration_t delay = -1;
  dds_history_kind_t history{};
  std::int32_t depth = 0;
  std::int32_t samples = 0;
  std::int32_t instances = 0;
  std::int32_t per_instance = 0;
  ASSERT_TRUE(dds_qget_durability_service(dds_qos.get(), &delay, &history, &depth, &samples,
                                          &instances, &per_instance));
  EXPECT_EQ(history, DDS_HISTORY_KEEP_LAST);
  EXPECT_EQ(depth, 3);
  EXPECT_EQ(policies_of(QoS{KeepLast{3}}.transient_local()).durability,
            DDS_DURABILITY_TRANSIENT_LOCAL);
}

TEST(Qos, OfDepthZeroIsRefusedByName) {
  try {
    dds::to_dds(0, "/scan");
    FAIL() << "was accepted";
  } catch (const std::logic_error& error) {
    EXPECT_NE(std::string{error.what()}.find("/scan"), std::string::npos);
  }
  EXPECT_THROW(dds::to_dds(0x80000000U, "/scan"), std::logic_error);
}

}  // namespace
}  // namespace cie::executor
