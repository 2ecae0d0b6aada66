// Requests and responses: whose request a service's callback serves, and how long its response took.
#include "ros2_text.hpp"

#include <cstdint>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

// A timer of process 1 calls the service of process 2. Layers differ in how many zeros end a gid.
constexpr const char* kClientAndService = R"(
  0 rcl_node_init pid=1 node_handle=0x10 node_name=a namespace=/
  0 rmw_client_init pid=1 rmw_client_handle=0x71 gid=1.15.3.0
  0 rcl_client_init pid=1 client_handle=0x70 node_handle=0x10 rmw_client_handle=0x71 service_name=/enable
  1 rcl_timer_init pid=1 timer_handle=0x20 period=100
  1 rclcpp_timer_callback_added pid=1 timer_handle=0x20 callback=0x30
  1 rclcpp_timer_link_node pid=1 timer_handle=0x20 node_handle=0x10
  2 rcl_node_init pid=2 node_handle=0x10 node_name=b namespace=/
  2 rcl_service_init pid=2 service_handle=0x20 node_handle=0x10 rmw_service_handle=0x72 service_name=/enable
  2 rclcpp_service_callback_added pid=2 service_handle=0x20 callback=0x50
)";
constexpr const char* kServiceChain = "/a@Timer(100) -> /b@Service(/enable)";
constexpr const char* kServiceId = "/b@Service(/enable)";

// rclcpp responds when the callback has ended.
constexpr const char* kServiceCall = R"(
  10 callback_start pid=1 callback=0x30
  12 rmw_send_request pid=1 rmw_client_handle=0x71 request=0x99 sequence_number=5
  15 callback_end pid=1 callback=0x30
  18 rmw_take_request pid=2 tid=2 rmw_service_handle=0x72 request=0x88 client_gid=1.15.3 sequence_number=5 taken=1
  20 callback_start pid=2 tid=2 callback=0x50
  27 callback_end pid=2 tid=2 callback=0x50
  28 rmw_send_response pid=2 tid=2 rmw_service_handle=0x72 response=0x89 client_gid=1.15.3 sequence_number=5 timestamp=1000028
  33 rmw_take_response pid=1 rmw_client_handle=0x71 response=0x98 sequence_number=5 source_timestamp=1000028 taken=1
)";

std::string replaced(std::string text, std::string_view from, std::string_view to) {
  return text.replace(text.find(from), from.size(), to);
}

TEST(Ros2Services, ARequestLeadsToItsServicesCallback) {
  const auto result = analyze_ros2(std::string(kClientAndService) + kServiceCall);
  EXPECT_THAT(result.chains(), ElementsAre(std::string(kServiceChain) + ": 1"));
  EXPECT_TRUE(result.instances[1].is_from_known_publisher);
}

TEST(Ros2Services, ResponseTimesAreBoundedByWhatTheClientDidBeforeItSent) {
  const auto result = analyze_ros2(std::string(kClientAndService) + kServiceCall);
  const auto& service = result.callback(kServiceId);
  EXPECT_EQ(service.response_time_lower->max, 27 - 20);
  // Some layers tell of a request when they have written it: after the thread's event before.
  EXPECT_EQ(service.response_time_upper->max, 27 - 10);
}

TEST(Ros2Services, TheResponsesWayIsTheChainsLastHop) {
  const auto result = analyze_ros2(std::string(kClientAndService) + kServiceCall);
  ASSERT_EQ(result.analysis.report.chains.size(), 1U);
  const auto& response = result.analysis.report.chains.front().response;
  ASSERT_TRUE(response);
  EXPECT_EQ(response->count, 1U);
  EXPECT_EQ(response->sum, 33 - 28);
}

// No event tells when a request was written: between hosts, too, it took its way from when it was sent, whichever of
// the two events comes first by their clocks.
TEST(Ros2Services, ARequestToAnotherHostIsSentWhenThatIsTold) {
  const auto on_two_hosts = [](const std::string& text) {
    std::string moved;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);)
      moved += line + (line.find("pid=2") != std::string::npos ? " boot=other\n" : "\n");
    return moved;
  };
  constexpr const char* kToldLate = R"(
  10 callback_start pid=1 callback=0x30
  18 rmw_take_request pid=2 tid=2 rmw_service_handle=0x72 request=0x88 client_gid=1.15.3 sequence_number=5 taken=1
  19 rmw_send_request pid=1 rmw_client_handle=0x71 request=0x99 sequence_number=5
  19 callback_end pid=1 callback=0x30
  20 callback_start pid=2 tid=2 callback=0x50
  27 callback_end pid=2 tid=2 callback=0x50
)";
  for (const auto& [call, sent] : {std::pair{kServiceCall, 12}, std::pair{kToldLate, 19}}) {
    const auto result = analyze_ros2(on_two_hosts(std::string(kClientAndService) + call));
    ASSERT_EQ(result.analysis.report.chains.size(), 1U);
    const auto& chain = result.analysis.report.chains.front();
    EXPECT_EQ(chain.from_start->max, 27 - 10) << sent;
    EXPECT_EQ(chain.hop_table.front().start_to_publish->max, sent - 10);
    EXPECT_EQ(chain.hop_table.front().publish_to_start->max, 20 - sent);
  }
}

TEST(Ros2Services, AResponseMayBeSentInsideTheCallback) {
  const auto inside = replaced(replaced(kServiceCall, "27 callback_end", "29 callback_end"),
                               "28 rmw_send", "29 rmw_send");
  const auto result = analyze_ros2(std::string(kClientAndService) + inside);
  ASSERT_EQ(result.analysis.report.chains.size(), 1U);
  ASSERT_TRUE(result.analysis.report.chains.front().response);
  EXPECT_EQ(result.analysis.report.chains.front().response->sum, 33 - 29);
}

TEST(Ros2Services, ARequestMayBeToldAfterItWasServed) {
  const auto late =
      replaced(kServiceCall,
               "12 rmw_send_request pid=1 rmw_client_handle=0x71 request=0x99 sequence_number=5",
               "") +
      "34 rmw_send_request pid=1 tid=3 rmw_client_handle=0x71 sequence_number=5";
  const auto result = analyze_ros2(std::string(kClientAndService) + R"(
    9 callback_start pid=1 tid=3 callback=0x30)" +
                                   replaced(late, "10 callback_start pid=1 callback=0x30\n  ", "") +
                                   "\n36 callback_end pid=1 tid=3 callback=0x30");
  EXPECT_THAT(result.chains(), ElementsAre(std::string(kServiceChain) + ": 1"));
  const auto& service = result.callback(kServiceId);
  EXPECT_EQ(service.response_time_lower->max, 27 - 20);
  EXPECT_FALSE(service.response_time_upper);
}

TEST(Ros2Services, ALaterRequestMayBeToldAfterItWasServed) {
  const auto result = analyze_ros2(std::string(kClientAndService) + kServiceCall + R"(
    50 callback_start pid=1 tid=3 callback=0x30
    58 rmw_take_request pid=2 tid=2 rmw_service_handle=0x72 request=0x88 client_gid=1.15.3 sequence_number=6 taken=1
    60 callback_start pid=2 tid=2 callback=0x50
    67 callback_end pid=2 tid=2 callback=0x50
    74 rmw_send_request pid=1 tid=3 rmw_client_handle=0x71 sequence_number=6
    76 callback_end pid=1 tid=3 callback=0x30)");
  EXPECT_THAT(result.chains(), ElementsAre(std::string(kServiceChain) + ": 2"));
}

// Viewers join messages by these.
TEST(Ros2Services, RequestsThatAreToldAfterTheyWereServedAreToldApart) {
  const auto late = [](std::int64_t begin, const std::string& number) {
    const auto at = [begin](std::int64_t later) { return std::to_string(begin + later); };
    return at(0) + " callback_start pid=1 tid=3 callback=0x30\n" + at(8) +
           " rmw_take_request pid=2 tid=2 rmw_service_handle=0x72 request=0x88 client_gid=1.15.3 sequence_number=" +
           number + " taken=1\n" + at(10) + " callback_start pid=2 tid=2 callback=0x50\n" + at(17) +
           " callback_end pid=2 tid=2 callback=0x50\n" + at(24) +
           " rmw_send_request pid=1 tid=3 rmw_client_handle=0x71 sequence_number=" + number + "\n" +
           at(26) + " callback_end pid=1 tid=3 callback=0x30\n";
  };
  const auto result = analyze_ros2(std::string(kClientAndService) + late(50, "5") + late(150, "6"));
  EXPECT_THAT(result.chains(), ElementsAre(std::string(kServiceChain) + ": 2"));
  std::set<std::int64_t> taken;
  for (const auto& row : result.instances) {
    if (row.logical_id == kServiceId) taken.insert(row.message);
  }
  EXPECT_EQ(taken.size(), 2U);
  EXPECT_FALSE(taken.contains(0));
}

TEST(Ros2Services, ClientsCountTheirRequestsThemselves) {
  const auto result =
      analyze_ros2(std::string(kClientAndService) + R"(
    3 rcl_node_init pid=3 node_handle=0x10 node_name=c namespace=/
    3 rmw_client_init pid=3 rmw_client_handle=0x71 gid=1.15.4
    3 rcl_client_init pid=3 client_handle=0x70 node_handle=0x10 rmw_client_handle=0x71 service_name=/enable
    4 rmw_send_request pid=3 tid=3 rmw_client_handle=0x71 sequence_number=5)" +
                   replaced(kServiceCall, "client_gid=1.15.3 ", "client_gid=1.15.4 "));
  EXPECT_THAT(result.chains(), IsEmpty());  // its request came from outside callbacks
}

TEST(Ros2Services, WhatWasNotTakenIsNoRequest) {
  const auto result =
      analyze_ros2(std::string(kClientAndService) + replaced(kServiceCall, "taken=1", "taken=0"));
  EXPECT_THAT(result.chains(), IsEmpty());
}

TEST(Ros2Services, AnActionsRequestIsNotTheNextCallbacks) {
  const auto result =
      analyze_ros2(std::string(kClientAndService) + R"(
    3 rcl_service_init pid=2 service_handle=0x80 node_handle=0x10 rmw_service_handle=0x82 service_name=/go/_action/send_goal)" +
                   replaced(kServiceCall, "rmw_service_handle=0x72", "rmw_service_handle=0x82"));
  EXPECT_THAT(result.chains(), IsEmpty());
}

TEST(Ros2Services, ARequestOfAnUnknownClientIsNotBounded) {
  const auto result =
      analyze_ros2(std::string(kClientAndService) +
                   replaced(kServiceCall, "client_gid=1.15.3 ", "client_gid=1.15.9 "));
  EXPECT_THAT(result.chains(), IsEmpty());
  EXPECT_FALSE(result.callback(kServiceId).response_time_upper);
}

TEST(Ros2Services, ASpecMayNameTheChain) {
  const auto result = analyze_ros2(std::string(kClientAndService) + kServiceCall, -1, R"--(
chains:
  - name: enable
    callbacks: ["/a@Timer(100)", "/b@Service(/enable)"]
)--");
  EXPECT_THAT(result.chains(), ElementsAre("enable: 1"));
  ASSERT_TRUE(result.analysis.report.chains.front().response);
  EXPECT_EQ(result.analysis.report.chains.front().response->sum, 33 - 28);
}

// Two servers offer the service of /a's client: /b's in process 2, and /c's in process `c`. /b
// sends its response at 28 and /c at 38; the client takes them at 41 and 47.
std::string two_servers(int c, const std::string& first_taken, const std::string& second_taken) {
  std::string text = std::string(kClientAndService) + R"(
  3 rcl_node_init pid=C node_handle=0x60 node_name=c namespace=/
  3 rcl_service_init pid=C service_handle=0x61 node_handle=0x60 rmw_service_handle=0x62 service_name=/enable
  3 rclcpp_service_callback_added pid=C service_handle=0x61 callback=0x63
  10 callback_start pid=1 callback=0x30
  12 rmw_send_request pid=1 rmw_client_handle=0x71 sequence_number=5
  15 callback_end pid=1 callback=0x30
  18 rmw_take_request pid=2 tid=2 rmw_service_handle=0x72 client_gid=1.15.3 sequence_number=5 taken=1
  19 rmw_take_request pid=C tid=3 rmw_service_handle=0x62 client_gid=1.15.3 sequence_number=5 taken=1
  20 callback_start pid=2 tid=2 callback=0x50
  21 callback_start pid=C tid=3 callback=0x63
  26 callback_end pid=C tid=3 callback=0x63
  27 callback_end pid=2 tid=2 callback=0x50
  28 rmw_send_response pid=2 tid=2 rmw_service_handle=0x72 client_gid=1.15.3 sequence_number=5 timestamp=1000028
  38 rmw_send_response pid=C tid=3 rmw_service_handle=0x62 client_gid=1.15.3 sequence_number=5 timestamp=1000038
  41 rmw_take_response pid=1 rmw_client_handle=0x71 sequence_number=5 taken=1)" +
                     first_taken + R"(
  47 rmw_take_response pid=1 rmw_client_handle=0x71 sequence_number=5 taken=1)" +
                     second_taken + "\n";
  for (auto at = text.find("pid=C"); at != std::string::npos; at = text.find("pid=C"))
    text.replace(at, 5, "pid=" + std::to_string(c));
  return text;
}

// "CHAIN: time" of each, or "CHAIN: -".
std::vector<std::string> responses(const std::string& text) {
  std::vector<std::string> all;
  const auto result = analyze_ros2(text);
  for (const auto& chain : result.analysis.report.chains) {
    const auto& response = chain.response;
    all.push_back(chain.name + ": " +
                  (response
                       ? std::to_string(response->count) + " of " + std::to_string(response->sum)
                       : "-"));
  }
  return all;
}

constexpr const char* kToB = "/a@Timer(100) -> /b@Service(/enable): ";
constexpr const char* kToC = "/a@Timer(100) -> /c@Service(/enable): ";

// Both answer each call.
TEST(Ros2Services, ASourceTimestampTellsWhoseResponseWasTaken) {
  constexpr const char* kOfB = " source_timestamp=1000028";
  constexpr const char* kOfC = " source_timestamp=1000038";
  for (const int c : {3, 2}) {
    EXPECT_THAT(responses(two_servers(c, kOfB, kOfC)),
                UnorderedElementsAre(kToB + std::string("1 of ") + std::to_string(41 - 28),
                                     kToC + std::string("1 of ") + std::to_string(47 - 38)))
        << c;
    EXPECT_THAT(responses(two_servers(c, kOfC, kOfB)),
                UnorderedElementsAre(kToB + std::string("1 of ") + std::to_string(47 - 28),
                                     kToC + std::string("1 of ") + std::to_string(41 - 38)))
        << c;
  }
}

TEST(Ros2Services, OneOfSeveralResponsesIsUndecidedWithoutASourceTimestamp) {
  for (const int c : {3, 2}) {
    EXPECT_THAT(responses(two_servers(c, "", "")),
                UnorderedElementsAre(std::string(kToB) + "-", std::string(kToC) + "-"))
        << c;
  }
}

// One more server answers, which was not recorded.
TEST(Ros2Services, AResponseThatNoServerWasSeenToSendIsOfNoChain) {
  constexpr const char* kOfNone = " source_timestamp=1000031";
  EXPECT_THAT(responses(two_servers(3, kOfNone, kOfNone)),
              UnorderedElementsAre(std::string(kToB) + "-", std::string(kToC) + "-"));
}

// What /c took was not seen, so that nobody knows which instance responds.
TEST(Ros2Services, AResponseOfAnUnknownInstanceMayBeTheOneThatIsTaken) {
  const auto text = replaced(two_servers(3, "", ""), "rmw_service_handle=0x62 client_gid=1.15.3",
                             "rmw_service_handle=0x62 client_gid=1.15.9");
  EXPECT_THAT(responses(text), ElementsAre(std::string(kToB) + "-"));
}

// A callback that takes the request alone responds later: rclcpp tells no end of it.
TEST(Ros2Services, AnEndThatIsNotToldNeedNotBeAnException) {
  const auto result = analyze_ros2(std::string(kClientAndService) + R"(
    20 callback_start pid=2 tid=2 callback=0x50
    30 callback_start pid=2 tid=2 callback=0x50
    40 callback_start pid=2 tid=2 callback=0x50)");
  for (const auto* rule : {"E1", "E2"}) {
    EXPECT_THAT(result.evidence(rule),
                testing::HasSubstr("by an exception, or its response is sent later"))
        << rule;
  }
}

// Before tracetools 8.5 nothing tells of calls.
TEST(Ros2Services, WithoutTheirEventsNothingIsKnown) {
  const auto result = analyze_ros2(std::string(kClientAndService) + R"(
    20 callback_start pid=2 tid=2 callback=0x50
    27 callback_end pid=2 tid=2 callback=0x50)");
  EXPECT_EQ(result.callback(kServiceId).response_time_lower->max, 27 - 20);
  EXPECT_FALSE(result.callback(kServiceId).response_time_upper);
}

}  // namespace
}  // namespace cie::test
