// Whatever goes, in whatever order, while everything spins: its callbacks end, and nothing of what
// they used is touched afterwards. ASan and TSan see it if they do not (sanitized).
//
// CIE_SOAK_ROUNDS=N runs every case N times instead of a few.
#include "executors.hpp"
#include "support.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <type_traits>
#include <vector>

#include <gtest/gtest.h>
#include <test_services.hpp>

namespace cie::test {
namespace {

using cie_msgs::Sample;
using test_services::Add_Request;
using test_services::Add_Response;

static_assert(std::is_final_v<Node>, "a callback may run while members of a derived class go");

int rounds(int few) {
  const char* const wanted = std::getenv("CIE_SOAK_ROUNDS");
  return wanted == nullptr ? few : std::atoi(wanted);
}

// What a callback uses: memory that goes at once when its owner says so.
struct Used {
  std::unique_ptr<std::atomic<int>> runs = std::make_unique<std::atomic<int>>(0);
  std::function<void()> body() {
    return [counter = runs.get()] {
      ++*counter;
      std::this_thread::yield();
      ++*counter;
    };
  }
};

// Keeps every kind of callback busy from another node.
class Traffic {
 public:
  explicit Traffic(const Context& context) : node_(context, "traffic") {
    data_ = node_.create_publisher<Sample>("data", 10);
    client_ = node_.create_client<Add_Request, Add_Response>("add", {.timeout = 5ms});
    service_ = node_.create_service<Add_Request, Add_Response>(
        "answer",
        [](const Add_Request& asked, Add_Response& response) { response.sum = asked.a + asked.b; });
    timer_ = node_.create_wall_timer(500us, [this] {
      data_->publish(*message_);
      if (client_->pending_requests() < 5)
        client_->async_send_request(*request_, [](const auto&) {});
    });
  }
  Node& node() noexcept { return node_; }

 private:
  MessagePtr<Sample> message_ = make_message<Sample>();
  MessagePtr<Add_Request> request_ = make_message<Add_Request>();
  Node node_;
  std::shared_ptr<Publisher<Sample>> data_;
  std::shared_ptr<Service<Add_Request, Add_Response>> service_;
  std::shared_ptr<Client<Add_Request, Add_Response>> client_;
  std::shared_ptr<Timer> timer_;
};

// Makes one callback of a kind that runs `body`.
using Maker = std::shared_ptr<void> (*)(Node& node, std::function<void()> body,
                                        const std::shared_ptr<CallbackGroup>& group);

std::shared_ptr<void> timer(Node& node, std::function<void()> body,
                            const std::shared_ptr<CallbackGroup>& group) {
  TimerOptions options;
  options.group = group;
  return node.create_wall_timer(300us, std::move(body), options);
}
std::shared_ptr<void> subscription(Node& node, std::function<void()> body,
                                   const std::shared_ptr<CallbackGroup>& group) {
  CallbackOptions options;
  options.group = group;
  return node.create_subscription<Sample>(
      "data", 10, [body = std::move(body)](const Sample&) { body(); }, options);
}
std::shared_ptr<void> service(Node& node, std::function<void()> body,
                              const std::shared_ptr<CallbackGroup>& group) {
  CallbackOptions options;
  options.group = group;
  return node.create_service<Add_Request, Add_Response>(
      "add", [body = std::move(body)](const Add_Request&, Add_Response&) { body(); }, options);
}
// Asks again and again; goes with its function.
std::shared_ptr<void> client(Node& node, std::function<void()> body,
                             const std::shared_ptr<CallbackGroup>& group) {
  ClientOptions options;
  options.group = group;
  options.timeout = 1ms;
  auto client = node.create_client<Add_Request, Add_Response>("answer", options);
  const auto request = make_message<Add_Request>();
  for (int i = 0; i < 5; ++i)
    client->async_send_request(*request, [body](const auto&) { body(); });
  return client;
}
// Triggered by a thread of its own, up to its end.
std::shared_ptr<void> guard_condition(Node& node, std::function<void()> body,
                                      const std::shared_ptr<CallbackGroup>& group) {
  struct Triggered {
    std::shared_ptr<GuardCondition> guard_condition;
    std::jthread trigger;
  };
  CallbackOptions options;
  options.group = group;
  auto triggered = std::make_shared<Triggered>();
  triggered->guard_condition = node.create_guard_condition("go", std::move(body), options);
  triggered->trigger =
      std::jthread{[copy = triggered->guard_condition.get()](const std::stop_token& stop) {
        while (!stop.stop_requested()) {
          copy->trigger();
          std::this_thread::sleep_for(100us);
        }
      }};
  return triggered;
}
// Of a subscription whose publisher is silent.
std::shared_ptr<void> event(Node& node, std::function<void()> body,
                            const std::shared_ptr<CallbackGroup>& group) {
  struct Ends {
    std::shared_ptr<Publisher<Sample>> publisher;
    std::shared_ptr<Subscription<Sample>> subscription;
  };
  const QoS qos = QoS{1}.deadline(1ms);
  SubscriptionOptions options;
  options.event_callbacks.deadline_callback = [body = std::move(body)](const auto&) { body(); };
  options.event_callbacks.group = group;
  auto ends = std::make_shared<Ends>();
  ends->subscription = node.create_subscription<Sample>(
      "silent", qos, [](const Sample&) {}, options);
  ends->publisher = node.create_publisher<Sample>("silent", qos);
  ends->publisher->publish(*make_message<Sample>());
  return ends;
}
constexpr std::array<Maker, 6> kMakers{timer,  subscription,    service,
                                       client, guard_condition, event};

class Lifetimes : public testing::TestWithParam<Kind> {
 protected:
  std::unique_ptr<Executor> make() {
    return test::make(GetParam(), {.reentrant_threads = 2, .threads = 2});
  }
};

INSTANTIATE_TEST_SUITE_P(Executors, Lifetimes, every_executor(), name_of);

TEST_P(Lifetimes, DroppingAHandleOfAnyKindEndsItsCallback) {
  Context context{private_options()};
  const auto executor = make();
  Traffic traffic{context};
  Node node{context, "node"};
  executor->add_node(traffic.node());
  executor->add_node(node);
  const Spinning spinning{*executor};
  for (int round = 0; round < rounds(6); ++round) {
    for (const Maker& make_one : kMakers) {
      auto group = round % 3 == 0   ? nullptr
                   : round % 3 == 1 ? node.create_callback_group(GroupType::mutually_exclusive)
                                    : node.create_callback_group(GroupType::reentrant);
      Used first;
      std::optional<Used> second{std::in_place};
      auto handle = make_one(node, first.body(), group);
      auto other = make_one(node, second->body(), group);
      group.reset();  // lives in its callbacks
      if (round % 2 == 0) {
        ASSERT_TRUE(eventually([&] { return *first.runs + *second->runs > 0; }));
      }
      other.reset();
      second.reset();  // nobody counts on it any more
      handle.reset();
      const int at_end = *first.runs;
      std::this_thread::sleep_for(1ms);
      EXPECT_EQ(*first.runs, at_end);
    }
  }
}

TEST_P(Lifetimes, PublishersParameterHandlersAndGroupsMayGoAtAnyTime) {
  Context context{private_options()};
  const auto executor = make();
  Traffic traffic{context};
  Node node{context, "node"};
  node.declare_parameter("rate", 1);
  std::atomic<std::int64_t> rate{0};
  const auto setter = node.create_wall_timer(300us, [&] { node.set_parameter("rate", ++rate); });
  executor->add_node(traffic.node());
  executor->add_node(node);
  const Spinning spinning{*executor};
  for (int round = 0; round < rounds(30); ++round) {
    std::optional<Used> used{std::in_place};
    auto on_set = node.add_on_set_parameters_callback([body = used->body()](const auto&) {
      body();
      return SetParametersResult{};
    });
    auto post_set =
        node.add_post_set_parameters_callback([body = used->body()](const auto&) { body(); });
    auto publisher = node.create_publisher<Sample>("data", 10);
    publisher->publish(*make_message<Sample>());
    if (round % 3 == 0) {
      ASSERT_TRUE(eventually([&] { return *used->runs > 0; }));
    }
    publisher.reset();
    post_set.reset();
    on_set.reset();
    used.reset();
  }
}

TEST_P(Lifetimes, ACallbackMayEndItself) {
  Context context{private_options()};
  const auto executor = make();
  Node node{context, "node"};
  executor->add_node(node);
  std::atomic<int> others{0};
  const auto other = node.create_wall_timer(1ms, [&] { ++others; });
  const Spinning spinning{*executor};
  ASSERT_TRUE(eventually([&] { return others > 2; }));  // all threads are there
  const std::size_t threads = settled(thread_count);
  for (int round = 0; round < rounds(20); ++round) {
    std::atomic<int> runs{0};
    std::promise<void> may_begin;
    auto begun = may_begin.get_future().share();
    std::shared_ptr<Timer> timer;
    timer = node.create_wall_timer(1us, [&, begun, kept = std::make_shared<int>(1)] {
      begun.wait();
      ++runs;
      const std::weak_ptr<int> own = kept;
      timer.reset();
      ++runs;
      EXPECT_FALSE(own.expired()) << "its function lives until it returns";
    });
    may_begin.set_value();
    ASSERT_TRUE(eventually([&] { return runs == 2; }));
  }
  EXPECT_TRUE(eventually([&] { return thread_count() <= threads; })) << "its thread goes";
}

// Each in the middle of ending the other: one of them does not wait.
TEST_P(Lifetimes, TwoCallbacksMayEndEachOther) {
  Context context{private_options()};
  const auto executor = make();
  Node node{context, "node"};
  executor->add_node(node);
  const Spinning spinning{*executor};
  for (int round = 0; round < rounds(20); ++round) {
    std::array<std::shared_ptr<Timer>, 2> timers;
    std::atomic<int> inside{0};
    std::atomic<int> done{0};
    std::promise<void> may_begin;
    auto begun = may_begin.get_future().share();
    for (std::size_t i = 0; i < 2; ++i) {
      timers[i] = node.create_one_shot_timer(1us, [&, begun, i] {
        begun.wait();
        ++inside;
        const auto patience = std::chrono::steady_clock::now() + 20ms;  // on one thread: alone
        while (inside < 2 && std::chrono::steady_clock::now() < patience)
          std::this_thread::yield();
        timers[1 - i].reset();
        ++done;
      });
    }
    may_begin.set_value();
    ASSERT_TRUE(eventually([&] { return done > 0 && done == inside; }));
  }
}

TEST_P(Lifetimes, ACallbackMayDestroyNodes) {
  Context context{private_options()};
  const auto executor = make();
  Node stays{context, "stays"};
  executor->add_node(stays);
  const Spinning spinning{*executor};
  for (int round = 0; round < rounds(10); ++round) {
    std::optional<Used> used{std::in_place};
    auto other = std::make_unique<Node>(context, "other");
    const auto others = timer(*other, used->body(), nullptr);
    executor->add_node(*other);
    std::atomic<bool> is_done{false};
    const auto destroyer = stays.create_one_shot_timer(200us, [&] {
      other.reset();
      used.reset();
      is_done = true;
    });
    ASSERT_TRUE(eventually([&] { return is_done.load(); }));
    // And its own.
    auto own = std::make_unique<Node>(context, "own");
    std::atomic<int> runs{0};
    const auto own_timer = own->create_wall_timer(200us, [&] {
      own.reset();
      ++runs;
    });
    executor->add_node(*own);
    ASSERT_TRUE(eventually([&] { return runs == 1; }));
  }
}

TEST_P(Lifetimes, RemoveEndsACallbackAndLeavesTheHandleIdle) {
  Context context{private_options()};
  const auto executor = make();
  Node node{context, "node"};
  Node stranger{context, "stranger"};
  executor->add_node(node);
  const Spinning spinning{*executor};
  std::atomic<int> runs{0};
  const auto held = std::make_shared<int>(0);
  const auto guard_condition = node.create_guard_condition("go", [&runs, held] { ++runs; });
  guard_condition->trigger();
  ASSERT_TRUE(eventually([&] { return runs == 1; }));
  EXPECT_THROW(stranger.remove(guard_condition), std::logic_error);
  node.remove(guard_condition);
  EXPECT_EQ(held.use_count(), 1) << "its function is gone";
  node.remove(guard_condition);
  guard_condition->trigger();
  const auto service = node.create_service<Add_Request, Add_Response>(
      "add", [&](const Add_Request&, Add_Response&) { ++runs; });
  const auto client = node.create_client<Add_Request, Add_Response>("add");
  auto future = client->async_send_request(*make_message<Add_Request>());
  node.remove(service);
  node.remove(client);
  EXPECT_NE(future.wait_for(0s), std::future_status::timeout) << "answered, or broken";
  const auto timer = node.create_wall_timer(200us, [&] { ++runs; });
  node.remove(timer);
  const int at_removal = runs;
  timer->reset();
  std::this_thread::sleep_for(3ms);
  EXPECT_EQ(runs, at_removal);
  EXPECT_FALSE(timer->logical_id().empty());
}

TEST(Lifetimes, AFunctionThatHoldsItsOwnHandleEndsWithItsNode) {
  Context context{private_options()};
  const auto watched = std::make_shared<int>(0);
  {
    Node node{context, "node"};
    const auto handle = std::make_shared<std::shared_ptr<Timer>>();
    *handle = node.create_wall_timer(1ms, [handle, watched] {});
  }
  EXPECT_EQ(watched.use_count(), 1);
}

// A class with a node: what its callbacks use stands above the node, or above the handles.
class NodeLast {
 public:
  explicit NodeLast(const Context& context) : node_(context, "last") {
    handle_ = timer(node_, used_.body(), nullptr);
  }
  Node& node() noexcept { return node_; }

 private:
  std::shared_ptr<void> handle_;
  Used used_;
  Node node_;
};
class HandleLast {
 public:
  explicit HandleLast(const Context& context) : node_(context, "first") {
    handle_ = timer(node_, used_.body(), nullptr);
  }
  Node& node() noexcept { return node_; }

 private:
  Node node_;
  Used used_;
  std::shared_ptr<void> handle_;
};

TEST_P(Lifetimes, AClassWithANodeMayGoWhileItIsSpun) {
  Context context{private_options()};
  const auto executor = make();
  const Spinning spinning{*executor};
  for (int round = 0; round < rounds(20); ++round) {
    NodeLast last{context};
    HandleLast first{context};
    executor->add_node(last.node());
    executor->add_node(first.node());
    std::this_thread::sleep_for(std::chrono::microseconds{round * 100 % 1000});
  }
}

// Every order of context, node, executor and handles, while another thread is in spin().
TEST_P(Lifetimes, OwnersMayGoInAnyOrderWhileEverythingSpins) {
  std::array<int, 4> order{0, 1, 2, 3};
  do {
    auto context = std::make_unique<Context>(private_options());
    auto node = std::make_unique<Node>(*context, "node");
    auto executor = make();
    Used used;
    std::vector<std::shared_ptr<void>> handles;
    for (const Maker& make_one : kMakers)
      handles.push_back(make_one(*node, used.body(), nullptr));
    executor->add_node(*node);
    Executor* const raw = executor.get();
    std::thread spinning{[raw] { raw->spin(); }};
    EXPECT_TRUE(eventually([&] { return raw->is_spinning() && *used.runs > 0; }));
    for (const int owner : order) {
      if (owner == 0) context.reset();
      if (owner == 1) node.reset();
      if (owner == 2) executor.reset();
      if (owner == 3) handles.clear();
    }
    used.runs.reset();
    spinning.join();
  } while (std::ranges::next_permutation(order).found);
}

// Two threads let go of a node and of its executor at the same time.
TEST_P(Lifetimes, NodeAndExecutorMayGoAtTheSameTime) {
  Context context{private_options()};
  for (int round = 0; round < rounds(10); ++round) {
    auto node = std::make_unique<Node>(context, "node");
    auto executor = make();
    std::optional<Used> used{std::in_place};
    auto handle = timer(*node, used->body(), nullptr);
    executor->add_node(*node);
    Executor* const raw = executor.get();
    std::thread spinning{[raw] { raw->spin(); }};
    eventually([&] { return raw->is_spinning(); });
    std::thread first{[&] { node.reset(); }};
    std::thread second{[&] { handle.reset(); }};
    executor.reset();
    first.join();
    second.join();
    used.reset();
    spinning.join();
  }
}

// An executor that its own callback destroys: spin() returns after that one, and waits for its thread
// however slowly it was told to leave.
TEST_P(Lifetimes, ACallbackMayDestroyItsExecutor) {
  for (int round = 0; round < rounds(10); ++round) {
    Context context{private_options()};
    Node node{context, "node"};
    auto executor = make();
    std::atomic<int> runs{0};
    const auto timer = node.create_wall_timer(200us, [&] {
      if (++runs == 1) executor.reset();
    });
    executor->add_node(node);
    Executor* const raw = executor.get();
    raw->spin();
    EXPECT_GE(runs, 1);
    EXPECT_EQ(executor, nullptr);
  }
}

}  // namespace
}  // namespace cie::test
