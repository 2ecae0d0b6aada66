#include <cie/scheduling/threads.hpp>

#include <string>
#include <utility>

#include <gtest/gtest.h>

namespace cie::scheduling {
namespace {

trace::CallbackInfo timer(std::string id, std::uint64_t period_ns) {
  trace::CallbackInfo info;
  info.kind = CallbackKind::timer;
  info.logical_id = std::move(id);
  info.period_ns = period_ns;
  return info;
}

trace::CallbackInfo subscription(std::string id, std::string source) {
  trace::CallbackInfo info;
  info.kind = CallbackKind::subscription;
  info.logical_id = std::move(id);
  info.source = std::move(source);
  return info;
}

trace::CallbackInfo waitable(std::string id, std::string source) {
  auto info = subscription(std::move(id), std::move(source));
  info.kind = CallbackKind::waitable;
  return info;
}

TEST(ThreadLabel, SaysWhoAndWhatInFifteenBytes) {
  EXPECT_EQ(thread_label(timer("/car/lidar@Timer(100000000)", 100'000'000)), "lidar:100ms");
  EXPECT_EQ(thread_label(timer("/lidar@Timer(1500)", 1500)), "lidar:1500ns");
  EXPECT_EQ(thread_label(timer("/lidar@Timer(2000)", 2000)), "lidar:2us");
  EXPECT_EQ(thread_label(subscription("/a@Subscription(/b)", "/b")), "a:b");
  EXPECT_EQ(thread_label(waitable("/lidar@Waitable(camera)", "camera")), "lidar:camera");
  EXPECT_EQ(thread_label(waitable("/car/imu@RequestedDeadlineMissed(/scan)", "/scan")),
            "imu:DeadlineMis");
  EXPECT_EQ(thread_label(waitable("/imu@LivelinessLost(/scan)", "/scan")), "imu:LivelinessL");
  // Topics that differ in their beginnings stay apart.
  EXPECT_EQ(thread_label(subscription("/cloud_fusion@S(x)", "/front/points")), "cloud_f:front/p");
  EXPECT_EQ(thread_label(subscription("/cloud_fusion@S(x)", "/rear/points")), "cloud_f:rear/po");
  // A short name leaves its room to the topic.
  EXPECT_EQ(thread_label(subscription("/b@S(x)", "/front/points_raw")), "b:front/points_");
}

}  // namespace
}  // namespace cie::scheduling
