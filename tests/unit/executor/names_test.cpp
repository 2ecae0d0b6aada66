#include "names.hpp"

#include <cie/tracepoints/logical_id.hpp>

#include "delivery.hpp"

#include <array>
#include <stdexcept>

#include <gtest/gtest.h>

namespace cie::executor {
namespace {

TEST(NodeName, IsPutUnderItsNamespace) {
  EXPECT_EQ(qualified_node_name("lidar", "/"), "/lidar");
  EXPECT_EQ(qualified_node_name("lidar", ""), "/lidar");
  EXPECT_EQ(qualified_node_name("lidar", "front"), "/front/lidar");
  EXPECT_EQ(qualified_node_name("lidar", "/car/front"), "/car/front/lidar");
}

TEST(NodeName, MustBeAName) {
  for (const char* const name : {"", "a/b", "1a", "a b", "a-b", "~"}) {
    EXPECT_THROW(qualified_node_name(name, "/"), std::invalid_argument) << name;
  }
  for (const char* const name_space : {"//", "/a/", "/1", "/a//b"}) {
    EXPECT_THROW(qualified_node_name("a", name_space), std::invalid_argument) << name_space;
  }
}

TEST(Topic, IsRelativeAbsoluteOrPrivate) {
  EXPECT_EQ(qualified_topic("scan", "/car/lidar"), "/car/scan");
  EXPECT_EQ(qualified_topic("scan", "/lidar"), "/scan");
  EXPECT_EQ(qualified_topic("/scan", "/car/lidar"), "/scan");
  EXPECT_EQ(qualified_topic("~/scan", "/car/lidar"), "/car/lidar/scan");
  for (const char* const topic : {"", "/", "~", "a//b", "/a/", "9", "a b", "a@b"}) {
    EXPECT_THROW(qualified_topic(topic, "/n"), std::invalid_argument) << topic;
  }
}

// What ROS 2 nodes listen to.
TEST(Topic, IsPrefixedInDds) {
  EXPECT_EQ(message_topic("/car/scan").dds, "rt/car/scan");
  EXPECT_EQ(message_topic("/car/scan").ros, "/car/scan");
}

TEST(Topic, OfAServiceIsThatOfRos2) {
  EXPECT_EQ(request_topic("/car/plan").dds, "rq/car/planRequest");
  EXPECT_EQ(reply_topic("/car/plan").dds, "rr/car/planReply");
}

TEST(LogicalId, IsWhatTheExistingExecutorsWrite) {
  EXPECT_EQ(logical_id("/a/b", CallbackKind::timer, "100000000"), "/a/b@Timer(100000000)");
  EXPECT_EQ(logical_id("/b", CallbackKind::subscription, "/scan"), "/b@Subscription(/scan)");
  EXPECT_EQ(logical_id("/b", CallbackKind::service, "/set"), "/b@Service(/set)");
  EXPECT_EQ(logical_id("/b", CallbackKind::client, "/set"), "/b@Client(/set)");
}

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

TEST(ThreadLabel, SaysWhoAndWhatInFifteenBytes) {
  EXPECT_EQ(thread_label(timer("/car/lidar@Timer(100000000)", 100'000'000)), "lidar:100ms");
  EXPECT_EQ(thread_label(timer("/lidar@Timer(1500)", 1500)), "lidar:1500ns");
  EXPECT_EQ(thread_label(timer("/lidar@Timer(2000)", 2000)), "lidar:2us");
  EXPECT_EQ(thread_label(subscription("/a@Subscription(/b)", "/b")), "a:b");
  // Topics that differ in their beginnings stay apart.
  EXPECT_EQ(thread_label(subscription("/cloud_fusion@S(x)", "/front/points")), "cloud_f:front/p");
  EXPECT_EQ(thread_label(subscription("/cloud_fusion@S(x)", "/rear/points")), "cloud_f:rear/po");
  // A short name leaves its room to the topic.
  EXPECT_EQ(thread_label(subscription("/b@S(x)", "/front/points_raw")), "b:front/points_");
}

TEST(Demangled, IsReadable) {
  EXPECT_EQ(demangled(typeid(std::array<int, 3>)), "std::array<int, 3ul>");
}

TEST(WriterGid, DependsOnEveryByteAndIsNeverZero) {
  unsigned char guid[16] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 0, 0, 1, 3};
  const std::uint64_t gid = writer_gid(guid);
  EXPECT_NE(gid, 0U);
  for (unsigned char& byte : guid) {
    ++byte;
    EXPECT_NE(writer_gid(guid), gid);
    --byte;
  }
  EXPECT_EQ(writer_gid(guid), gid);
  const unsigned char zero[16] = {};
  EXPECT_NE(writer_gid(zero), 0U);
}

}  // namespace
}  // namespace cie::executor
