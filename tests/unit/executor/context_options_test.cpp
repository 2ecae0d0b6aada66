// What a Context reads from the environment.
#include <cie/executor/context.hpp>

#include <cstdlib>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie {
namespace {

class ContextOptions : public testing::Test {
 protected:
  ContextOptions() {
    for (const char* const name :
         {"CIE_DOMAIN_ID", "ROS_DOMAIN_ID", "CIE_LOOPBACK", "CIE_DISCOVERY_TAG",
          "CIE_SHARED_MEMORY", "CIE_ROS_GRAPH", "ROS_DISTRO"}) {
      unsetenv(name);
    }
  }
  static void set(const char* name, const char* value) { setenv(name, value, 1); }
  static Context::Options read() { return Context::Options::from_environment(); }
  static std::string complaint() {
    try {
      read();
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "none";
  }
};

TEST_F(ContextOptions, AreThoseOfAPlainProcessWithoutVariables) {
  const auto options = read();
  EXPECT_EQ(options.domain, 0U);
  EXPECT_FALSE(options.loopback);
  EXPECT_FALSE(options.shared_memory);
  EXPECT_TRUE(options.pass_pointers);
  EXPECT_EQ(options.ros_graph, RosGraph::humble);
}

TEST_F(ContextOptions, OfCieComeBeforeThoseOfRos) {
  set("ROS_DOMAIN_ID", "7");
  EXPECT_EQ(read().domain, 7U);
  set("CIE_DOMAIN_ID", "8");
  EXPECT_EQ(read().domain, 8U);
  set("ROS_DISTRO", "jazzy");
  set("CIE_ROS_GRAPH", "humble");
  EXPECT_EQ(read().ros_graph, RosGraph::humble);
}

TEST_F(ContextOptions, FollowTheDistributionOfRos) {
  for (const char* const older : {"foxy", "galactic", "humble"}) {
    set("ROS_DISTRO", older);
    EXPECT_EQ(read().ros_graph, RosGraph::humble) << older;
  }
  for (const char* const newer : {"iron", "jazzy", "kilted", "rolling"}) {
    set("ROS_DISTRO", newer);
    EXPECT_EQ(read().ros_graph, RosGraph::iron) << newer;
  }
  set("CIE_ROS_GRAPH", "none");
  EXPECT_EQ(read().ros_graph, RosGraph::none);
}

TEST_F(ContextOptions, SwitchWith1And0) {
  set("CIE_SHARED_MEMORY", "1");
  set("CIE_LOOPBACK", "0");
  EXPECT_TRUE(read().shared_memory);
  EXPECT_FALSE(read().loopback);
}

TEST_F(ContextOptions, NameTheVariableThatCannotBeUsed) {
  set("CIE_SHARED_MEMORY", "yes");
  EXPECT_THAT(complaint(), testing::HasSubstr("CIE_SHARED_MEMORY=\"yes\""));
  unsetenv("CIE_SHARED_MEMORY");
  set("CIE_ROS_GRAPH", "noetic");
  EXPECT_THAT(complaint(), testing::HasSubstr("CIE_ROS_GRAPH=\"noetic\""));
}

}  // namespace
}  // namespace cie
