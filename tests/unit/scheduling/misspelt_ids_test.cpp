#include "scheduling/misspelt_ids.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::scheduling {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

const KnownIds kKnown{
    .nodes = {"/car/lidar", "/car/brake"},
    .callbacks = {"/car/lidar@Timer(100000000)", "/car/lidar@Subscription(/car/command)",
                  "/car/brake@Subscription(/car/stop)"},
    .threads = {"recvUC", "tev", "pump"}};

std::vector<std::string> told(const std::string& spec) {
  std::vector<std::string> texts;
  for (const auto& problem : misspelt_ids(SchedulingSpec::parse(spec, "car.yaml"), kKnown)) {
    EXPECT_TRUE(problem.is_misspelt);
    texts.push_back(problem.text());
  }
  return texts;
}

TEST(MisspeltIds, AreToldWithFileLineAndWhatWasMeant) {
  const auto* const spec = R"(callback_groups:
  - id: /car/lidar@Timer(100000000)
  - id: /car/lidr@Subscription(/car/command)
  - id: /car/brkae/*
non_ros_threads:
  - id: pumpp
)";
  EXPECT_THAT(told(spec),
              ElementsAre("car.yaml:3: \"/car/lidr@Subscription(/car/command)\": no callback has "
                          "this id: it configures nothing; did you mean "
                          "\"/car/lidar@Subscription(/car/command)\"?",
                          "car.yaml:4: \"/car/brkae/*\": no node is called so: it configures "
                          "nothing; did you mean \"/car/brake/*\"?",
                          "car.yaml:6: \"pumpp\": no thread is called so: it configures nothing; "
                          "did you mean \"pump\"?"));
}

TEST(MisspeltIds, AreThoseOfNodesThatAreHere) {
  EXPECT_THAT(told("callback_groups:\n  - id: /car/brake@Service(/release)\n"),
              ElementsAre("car.yaml:2: \"/car/brake@Service(/release)\": no callback has this id: "
                          "it configures nothing"))
      << "near to nothing";
}

TEST(MisspeltIds, StandInChainsToo) {
  const auto* const spec = R"yaml(callback_groups:
  - id: /car/lidar@Timer(100000000)
chains:
  - name: stop
    callbacks: ["/car/lidar@Timer(10000000)", "/car/brake@Subscription(/car/stop)"]
)yaml";
  EXPECT_THAT(told(spec),
              ElementsAre("car.yaml:4: \"/car/lidar@Timer(10000000)\": no callback has this id: "
                          "chain \"stop\" is never seen; did you mean "
                          "\"/car/lidar@Timer(100000000)\"?"));
}

TEST(MisspeltIds, AreNotThePeriodsOfTimersWithNames) {
  const KnownIds known{.nodes = {"/n"}, .callbacks = {SpecCallback{"/n@Timer(tick)", 100}}};
  const auto problems = [&known](const std::string& id) {
    return misspelt_ids(SchedulingSpec::parse("callback_groups: [{id: " + id + "}]", "n.yaml"),
                        known);
  };
  EXPECT_THAT(problems("/n@Timer(100)"), IsEmpty());
  EXPECT_THAT(problems("/n@Timer(tick)"), IsEmpty());
  EXPECT_EQ(problems("/n@Timer(200)").size(), 1U);
}

// The spec of a whole system, of which this process is a part.
TEST(MisspeltIds, AreNotThoseOfOtherProcesses) {
  const auto* const spec = R"(callback_groups:
  - id: /car/lidar@Timer(100000000)
  - id: /car/lidar@Subscription(/car/command)
  - id: /car/brake@Subscription(/car/stop)
  - id: /car/radar@Timer(100000000)
  - id: /car/light/*
non_ros_threads:
  - id: logger
dds_threads:
  - name: recv
)";
  EXPECT_THAT(told(spec), IsEmpty());
  EXPECT_THAT(told("callback_groups:\n  - id: /truck/engine@Service(/start)\n"), IsEmpty());
}

}  // namespace
}  // namespace cie::scheduling
