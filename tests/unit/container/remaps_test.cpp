#include <cie/executor/context.hpp>
#include <cie/executor/node.hpp>

#include <stdexcept>

#include <cie_messages.hpp>
#include <gtest/gtest.h>

namespace cie {
namespace {

class Remaps : public testing::Test {
 protected:
  // The logical id of a subscription of `topic` by /car/lidar.
  std::string subscribed(const TopicRemaps& remaps, std::string_view topic) {
    Node node{context_, "lidar", "/car", remaps};
    return node.create_subscription<cie_msgs::Sample>(topic, 1, [](const cie_msgs::Sample&) {})
        ->logical_id();
  }
  Context context_{{.domain = 212, .loopback = true, .tag = "remaps"}};
};

TEST_F(Remaps, ReplaceATopicHoweverItIsWritten) {
  EXPECT_EQ(subscribed({{"scan", "/front"}}, "scan"), "/car/lidar@Subscription(/front)");
  EXPECT_EQ(subscribed({{"scan", "points"}}, "/car/scan"), "/car/lidar@Subscription(/car/points)");
  EXPECT_EQ(subscribed({{"~/scan", "/x"}}, "/car/lidar/scan"), "/car/lidar@Subscription(/x)");
}

TEST_F(Remaps, LeaveOtherTopicsAlone) {
  EXPECT_EQ(subscribed({{"scan", "/front"}}, "/scan"), "/car/lidar@Subscription(/scan)");
}

TEST_F(Remaps, DoNotChain) {
  EXPECT_EQ(subscribed({{"/a", "/b"}, {"/b", "/c"}}, "/a"), "/car/lidar@Subscription(/b)");
}

TEST_F(Remaps, RefuseWhatIsNoTopicOrMeantTwice) {
  EXPECT_THROW(subscribed({{"sc an", "/b"}}, "/a"), std::invalid_argument);
  EXPECT_THROW(subscribed({{"/car/a", "/b"}, {"a", "/c"}}, "/a"), std::invalid_argument);
}

}  // namespace
}  // namespace cie
