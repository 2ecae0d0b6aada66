#include <cie/executor/context.hpp>
#include <cie/executor/node.hpp>

#include <stdexcept>

#include <cie_messages.hpp>
#include <gtest/gtest.h>
#include <test_services.hpp>

namespace cie {
namespace {

using Request = test_services::Add_Request;
using Response = test_services::Add_Response;

class NodeRemaps : public testing::Test {
 protected:
  // The logical id of a subscription of `topic` by /car/lidar.
  std::string subscribed(const Remaps& remaps, std::string_view topic) {
    Node node{context_, "lidar", "/car", remaps};
    return node.create_subscription<cie_msgs::Sample>(topic, 1, [](const cie_msgs::Sample&) {})
        ->logical_id();
  }
  // Likewise, of a service and a client.
  std::string served(const Remaps& remaps, std::string_view service) {
    Node node{context_, "lidar", "/car", remaps};
    return node.create_service<Request, Response>(service, [](const Request&, Response&) {})
        ->logical_id();
  }
  std::string called(const Remaps& remaps, std::string_view service) {
    Node node{context_, "lidar", "/car", remaps};
    return node.create_client<Request, Response>(service)->logical_id();
  }
  Context context_{{.domain = 212, .loopback = true, .tag = "remaps"}};
};

TEST_F(NodeRemaps, ReplaceATopicHoweverItIsWritten) {
  EXPECT_EQ(subscribed({{"scan", "/front"}}, "scan"), "/car/lidar@Subscription(/front)");
  EXPECT_EQ(subscribed({{"scan", "points"}}, "/car/scan"), "/car/lidar@Subscription(/car/points)");
  EXPECT_EQ(subscribed({{"~/scan", "/x"}}, "/car/lidar/scan"), "/car/lidar@Subscription(/x)");
}

TEST_F(NodeRemaps, ReplaceAServiceOnBothItsSides) {
  EXPECT_EQ(served({{"~/reset", "/reset"}}, "~/reset"), "/car/lidar@Service(/reset)");
  EXPECT_EQ(called({{"reset", "/all/reset"}}, "reset"), "/car/lidar@Client(/all/reset)");
  EXPECT_EQ(called({{"reset", "/all/reset"}}, "/reset"), "/car/lidar@Client(/reset)");
}

TEST_F(NodeRemaps, LeaveOtherTopicsAlone) {
  EXPECT_EQ(subscribed({{"scan", "/front"}}, "/scan"), "/car/lidar@Subscription(/scan)");
}

TEST_F(NodeRemaps, DoNotChain) {
  EXPECT_EQ(subscribed({{"/a", "/b"}, {"/b", "/c"}}, "/a"), "/car/lidar@Subscription(/b)");
}

TEST_F(NodeRemaps, RefuseWhatIsNoTopicOrMeantTwice) {
  EXPECT_THROW(subscribed({{"sc an", "/b"}}, "/a"), std::invalid_argument);
  EXPECT_THROW(subscribed({{"/car/a", "/b"}, {"a", "/c"}}, "/a"), std::invalid_argument);
}

}  // namespace
}  // namespace cie
