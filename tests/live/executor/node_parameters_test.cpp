// Parameters as others on the network see them: the services and the topic of ROS 2.
#include "executors.hpp"
#include "support.hpp"

#include <atomic>
#include <cerrno>
#include <cstring>
#include <future>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#include <test_rcl_interfaces.hpp>

namespace cie::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using namespace rcl_interfaces::srv;
using rcl_interfaces::msg::Parameter;
using rcl_interfaces::msg::ParameterEvent;

constexpr std::uint8_t kInteger = 2;
constexpr std::uint8_t kString = 4;

// `length` zeroed elements.
template <typename Sequence>
void make_room(Sequence& sequence, std::size_t length) {
  using Element = std::remove_pointer_t<decltype(sequence._buffer)>;
  sequence._buffer = static_cast<Element*>(executor::allocate_contents(length * sizeof(Element)));
  sequence._length = sequence._maximum = static_cast<std::uint32_t>(length);
  sequence._release = true;
}

template <typename Sequence>
void put_texts(Sequence& sequence, const std::vector<std::string>& texts) {
  make_room(sequence, texts.size());
  for (std::size_t i = 0; i < texts.size(); ++i)
    set_text(sequence._buffer[i], texts[i]);
}

// A process that asks would be another one; a node of its own under an executor of its own is as
// good, because parameters are answered on a thread of neither.
class NodeParameters : public testing::Test {
 protected:
  template <typename Request, typename Response, typename Fill>
  std::shared_ptr<const Response> ask(const std::string& service, Fill fill) {
    const auto client = asking.create_client<Request, Response>(service);
    EXPECT_TRUE(client->wait_for_service(20s));
    const auto request = make_message<Request>();
    fill(*request);
    return client->async_send_request(*request).get();
  }

  Context context{private_options()};
  Node node{context, "lidar", "/car", {}, {{"rate", parameter_text("20")}}};
  Node asking{context, "asking"};
  CallbackIsolatedExecutor executor;
};

TEST_F(NodeParameters, AreAskedForDescribedListedAndSetByServices) {
  node.declare_parameter<std::int64_t>(
      "rate", 10, {.description = "scans per second", .integer_range = IntegerRange{1, 40, 1}});
  node.declare_parameter("frame.name", "front");
  executor.add_node(asking);
  const Spinning spinning{executor};

  const auto got = ask<GetParameters_Request, GetParameters_Response>(
      "/car/lidar/get_parameters", [](auto& request) {
        put_texts(request.names, {"rate", "frame.name"});
      });
  ASSERT_EQ(got->values._length, 2U);
  EXPECT_EQ(got->values._buffer[0].type, kInteger);
  EXPECT_EQ(got->values._buffer[0].integer_value, 20);
  EXPECT_STREQ(got->values._buffer[1].string_value, "front");

  const auto types = ask<GetParameterTypes_Request, GetParameterTypes_Response>(
      "/car/lidar/get_parameter_types",
      [](auto& request) { put_texts(request.names, {"frame.name"}); });
  ASSERT_EQ(types->types._length, 1U);
  EXPECT_EQ(types->types._buffer[0], kString);

  const auto described = ask<DescribeParameters_Request, DescribeParameters_Response>(
      "/car/lidar/describe_parameters", [](auto& request) { put_texts(request.names, {"rate"}); });
  ASSERT_EQ(described->descriptors._length, 1U);
  const auto& descriptor = described->descriptors._buffer[0];
  EXPECT_STREQ(descriptor.description, "scans per second");
  EXPECT_EQ(descriptor.type, kInteger);
  ASSERT_EQ(descriptor.integer_range._length, 1U);
  EXPECT_EQ(descriptor.integer_range._buffer[0].to_value, 40);

  const auto listed = ask<ListParameters_Request, ListParameters_Response>(
      "/car/lidar/list_parameters", [](auto&) {});
  ASSERT_EQ(listed->result.names._length, 2U);
  EXPECT_STREQ(listed->result.names._buffer[0], "frame.name");
  ASSERT_EQ(listed->result.prefixes._length, 1U);
  EXPECT_STREQ(listed->result.prefixes._buffer[0], "frame");

  const auto two = [](auto& request, std::int64_t rate, const char* name) {
    make_room(request.parameters, 2);
    Parameter& first = request.parameters._buffer[0];
    set_text(first.name, "rate");
    first.value.type = kInteger;
    first.value.integer_value = rate;
    Parameter& second = request.parameters._buffer[1];
    set_text(second.name, "frame.name");
    second.value.type = kString;
    set_text(second.value.string_value, name);
  };
  const auto each = ask<SetParameters_Request, SetParameters_Response>(
      "/car/lidar/set_parameters", [&](auto& request) { two(request, 41, "rear"); });
  ASSERT_EQ(each->results._length, 2U);
  EXPECT_FALSE(each->results._buffer[0].successful);
  EXPECT_THAT(each->results._buffer[0].reason, HasSubstr("not in the range"));
  EXPECT_TRUE(each->results._buffer[1].successful);
  EXPECT_EQ(node.get_parameter<std::int64_t>("rate"), 20);
  EXPECT_EQ(node.get_parameter<std::string>("frame.name"), "rear");

  const auto all = ask<SetParametersAtomically_Request, SetParametersAtomically_Response>(
      "/car/lidar/set_parameters_atomically", [&](auto& request) { two(request, 41, "front"); });
  EXPECT_FALSE(all->result.successful);
  EXPECT_EQ(node.get_parameter<std::string>("frame.name"), "rear");
}

// As rclcpp answers, whose clients take an answer of another length for none at all.
TEST_F(NodeParameters, AreNotToldBesideOneThatIsNotDeclared) {
  node.declare_parameter<std::int64_t>("rate", 10);
  executor.add_node(asking);
  const Spinning spinning{executor};
  const auto one_unknown = [](auto& request) { put_texts(request.names, {"rate", "no"}); };
  const auto got =
      ask<GetParameters_Request, GetParameters_Response>("/car/lidar/get_parameters", one_unknown);
  EXPECT_EQ(got->values._length, 0U);
  const auto types = ask<GetParameterTypes_Request, GetParameterTypes_Response>(
      "/car/lidar/get_parameter_types", one_unknown);
  EXPECT_EQ(types->types._length, 0U);
  const auto described = ask<DescribeParameters_Request, DescribeParameters_Response>(
      "/car/lidar/describe_parameters", one_unknown);
  EXPECT_EQ(described->descriptors._length, 0U);
}

TEST_F(NodeParameters, AreSetOnAThreadOfTheirOwn) {
  node.declare_parameter("rate", 10);
  std::string asked_on;
  std::string refusal_reason;
  const auto handle =
      node.add_on_set_parameters_callback([&](const std::vector<cie::Parameter>& all) {
        char name[16] = {};
        pthread_getname_np(pthread_self(), name, sizeof name);
        asked_on = name;
        if (all.front().value == ParameterValue{std::int64_t{13}})
          throw std::runtime_error{"unlucky"};
        return SetParametersResult{};
      });
  executor.add_node(asking);
  const Spinning spinning{executor};
  const auto set_to = [&](std::int64_t rate) {
    return ask<SetParameters_Request, SetParameters_Response>(
        "/car/lidar/set_parameters", [rate](auto& request) {
          make_room(request.parameters, 1);
          set_text(request.parameters._buffer[0].name, "rate");
          request.parameters._buffer[0].value.type = kInteger;
          request.parameters._buffer[0].value.integer_value = rate;
        });
  };
  EXPECT_TRUE(set_to(12)->results._buffer[0].successful);
  EXPECT_EQ(asked_on, "cie-parameters");
  // What it throws is the reason, and the thread goes on.
  EXPECT_STREQ(set_to(13)->results._buffer[0].reason, "unlucky");
  EXPECT_TRUE(set_to(14)->results._buffer[0].successful);
}

TEST_F(NodeParameters, AreToldAsEvents) {
  std::mutex mutex;
  std::vector<std::string> events;
  const auto subscription = asking.create_subscription<ParameterEvent>(
      "/parameter_events", 10, [&](const ParameterEvent& event) {
        const std::lock_guard lock{mutex};
        const auto add = [&](const char* what, const auto& parameters) {
          for (std::uint32_t i = 0; i < parameters._length; ++i) {
            events.push_back(std::string{event.node} + " " + what + " " +
                             parameters._buffer[i].name + " " +
                             std::to_string(parameters._buffer[i].value.integer_value));
          }
        };
        add("new", event.new_parameters);
        add("changed", event.changed_parameters);
        add("deleted", event.deleted_parameters);
      });
  executor.add_node(asking);
  const Spinning spinning{executor};
  node.declare_parameter("rate", 10);
  node.set_parameter("rate", 11);
  node.set_parameter("rate", "eleven");  // refused
  node.undeclare_parameter("rate");
  EXPECT_TRUE(eventually([&] {
    const std::lock_guard lock{mutex};
    return events.size() == 3;
  }));
  EXPECT_THAT(events, ElementsAre("/car/lidar new rate 20", "/car/lidar changed rate 11",
                                  "/car/lidar deleted rate 11"));
}

std::set<std::string> thread_names() {
  std::set<std::string> names;
  for (const auto& thread : threads_now())
    names.insert(thread.name);
  return names;
}

TEST_F(NodeParameters, CostNothingUntilOneIsDeclared) {
  executor.add_node(node);
  executor.add_node(asking);
  const Spinning spinning{executor};
  EXPECT_FALSE(thread_names().contains("cie-parameters"));
  node.declare_parameter("rate", 10);
  EXPECT_TRUE(thread_names().contains("cie-parameters"));
}

// 0 if there is none.
id_t tid_of(const std::string& name) {
  for (const auto& thread : threads_now()) {
    if (thread.name == name) return static_cast<id_t>(thread.tid);
  }
  return 0;
}

TEST_F(NodeParameters, HaveAnOrdinaryThreadWhateverItsCreatorIs) {
  const sched_param parameter{.sched_priority = 1};
  int error = 0;
  std::thread{[&] {
    error = sched_setscheduler(0, SCHED_FIFO, &parameter) == 0 ? 0 : errno;
    node.declare_parameter("rate", 10);
  }}.join();
  if (error != 0) GTEST_SKIP() << "not possible here: needs CAP_SYS_NICE: " << std::strerror(error);
  const id_t tid = tid_of("cie-parameters");
  EXPECT_EQ(sched_getscheduler(static_cast<pid_t>(tid)), SCHED_OTHER);
  EXPECT_EQ(getpriority(PRIO_PROCESS, tid), 10);
}

// The thread comes while spinning, or before; it is the spec's either way.
TEST_F(NodeParameters, HaveAThreadThatTheSpecConfigures) {
  const auto spec = [](const char* cpus) {
    return std::make_shared<SchedulingSpec>(SchedulingSpec::parse(
        std::string{"non_ros_threads:\n  - name: cie-parameters\n    policy: SCHED_OTHER\n    "
                    "nice: 12\n    affinity: "} +
            cpus + "\n",
        "test.yaml"));
  };
  {
    CallbackIsolatedExecutor configured{{.spec = spec("[0]")}};
    configured.add_node(node);
    const Spinning spinning{configured};
    node.declare_parameter("rate", 10);
    EXPECT_TRUE(
        eventually([] { return getpriority(PRIO_PROCESS, tid_of("cie-parameters")) == 12; }));
    configured.remove_node(node);
  }
  CallbackIsolatedExecutor refusing{{.spec = spec("[999]")}};
  refusing.add_node(node);
  EXPECT_THROW(refusing.spin(), SchedulingRefused);
}

TEST_F(NodeParameters, ComeAndGoWithTheirNodeWhileTheyAreAskedForAndSet) {
  executor.add_node(asking);
  const Spinning spinning{executor};
  const auto lister = asking.create_client<ListParameters_Request, ListParameters_Response>(
      "/passing/list_parameters", {.timeout = 20ms});
  const auto setter = asking.create_client<SetParameters_Request, SetParameters_Response>(
      "/passing/set_parameters", {.timeout = 20ms});
  std::atomic<bool> is_over{false};
  std::thread asker{[&] {
    const auto list = make_message<ListParameters_Request>();
    const auto set = make_message<SetParameters_Request>();
    make_room(set->parameters, 1);
    set_text(set->parameters._buffer[0].name, "rate");
    set->parameters._buffer[0].value.type = kInteger;
    while (!is_over) {
      std::atomic<int> answered{0};
      lister->async_send_request(*list, [&](const auto&) { ++answered; });
      setter->async_send_request(*set, [&](const auto&) { ++answered; });
      eventually([&] { return answered == 2; });
    }
  }};
  for (int round = 0; round < 20; ++round) {
    std::atomic<bool> is_set{false};
    Node passing{context, "passing"};
    const auto posted = passing.add_post_set_parameters_callback(
        [&](const std::vector<cie::Parameter>&) { is_set = true; });
    passing.declare_parameter("rate", 10);
    EXPECT_TRUE(eventually([&] { return is_set.load(); }));
    std::this_thread::sleep_for(1ms);
  }
  is_over = true;
  asker.join();
}

}  // namespace
}  // namespace cie::test
