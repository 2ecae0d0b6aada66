#include "dds/names.hpp"

#include "dds/delivery.hpp"

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
