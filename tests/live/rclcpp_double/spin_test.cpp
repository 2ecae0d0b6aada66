// spin_some(), spin_all(), spin_once() and spin_until_future_complete(): what they serve, and when they return.
#include "support/rclcpp/tests/recorded_releases.hpp"
#include "support/rclcpp/tests/spinning.hpp"

#include <future>
#include <set>
#include <stdexcept>

namespace cie_rclcpp {
namespace {

using namespace test;
using rclcpp::FutureReturnCode;

// Something that waits to be executed as often as it was triggered.
class Work : public rclcpp::Waitable {
 public:
  explicit Work(std::function<void()> function = [] {}) : function_(std::move(function)) {}
  ~Work() override { notice_.clear(); }
  void add_to_wait_set(rclcpp::ToWaitSet) override {}
  bool is_ready(rclcpp::OfWaitSet) override { return false; }
  std::shared_ptr<void> take_data() override { return nullptr; }
  std::shared_ptr<void> take_data_by_entity_id(std::size_t) override { return nullptr; }
  void execute(rclcpp::TakenData) override {
    ++executed;
    function_();
  }
  void set_on_ready_callback(std::function<void(std::size_t, int)> callback) override {
    notice_.set([callback = std::move(callback)](std::size_t count) { callback(count, 0); });
  }
  void clear_on_ready_callback() override { notice_.clear(); }
  void trigger() { notice_.raise(); }

  std::atomic<int> executed{0};

 private:
  const std::function<void()> function_;
  rmw_double::Notice notice_;
};

class SpinTest : public WithContext {
 protected:
  SpinTest() { executor_.add_node(node_); }
  std::shared_ptr<Work> work(
      std::function<void()> function = [] {},
      CallbackGroupType type = CallbackGroupType::MutuallyExclusive) {
    groups_.push_back(node_->create_callback_group(type));
    auto made = std::make_shared<Work>(std::move(function));
    node_->get_node_waitables_interface()->add_waitable(made, groups_.back());
    return made;
  }
  static auto elapsed_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::steady_clock::now() - start;
  }

  const rclcpp::Node::SharedPtr node_ = node("node");
  std::vector<rclcpp::CallbackGroup::SharedPtr> groups_;
  CallbackIsolatedExecutor executor_{cie::ExecutorOptions{}, in_context()};
};

TEST_F(SpinTest, SomeIsWhatWaitsAtTheCall) {
  std::shared_ptr<Work> again;
  again = work([&] { again->trigger(); });
  const auto other = work();
  const auto idle = work();
  again->trigger();
  other->trigger();
  other->trigger();
  for (int i = 1; i <= 3; ++i) {
    executor_.spin_some(10s);
    EXPECT_EQ(again->executed, i);
    EXPECT_EQ(other->executed, 2);
    std::this_thread::sleep_for(1ms);
    EXPECT_EQ(again->executed, i) << "nothing runs between the calls";
  }
  EXPECT_EQ(idle->executed, 0);
}

TEST_F(SpinTest, SomeReturnsAtOnceIfNothingWaits) {
  const auto timer = node_->create_wall_timer(10s, [] {});
  const auto start = std::chrono::steady_clock::now();
  executor_.spin_some(10s);
  executor_.spin_all(10s);
  executor_.spin_once(0s);
  EXPECT_LT(elapsed_since(start), 5s);
}

TEST_F(SpinTest, AllIsWhatComesMeanwhileToo) {
  std::shared_ptr<Work> chain;
  chain = work([&] {
    if (chain->executed < 5) chain->trigger();
  });
  chain->trigger();
  executor_.spin_all(10s);
  EXPECT_EQ(chain->executed, 5);
  EXPECT_THROW(executor_.spin_all(-1s), std::invalid_argument);
}

// Of two that share a thread the second does not begin when the time is over.
TEST_F(SpinTest, NoneBeginsAfterTheTime) {
  const auto group = node_->create_callback_group(CallbackGroupType::MutuallyExclusive);
  std::vector<std::shared_ptr<Work>> both;
  for (int i = 0; i < 2; ++i) {
    both.push_back(std::make_shared<Work>([] { std::this_thread::sleep_for(600ms); }));
    node_->get_node_waitables_interface()->add_waitable(both.back(), group);
    both.back()->trigger();
  }
  executor_.spin_some(500ms);
  EXPECT_EQ(both[0]->executed + both[1]->executed, 1);
  executor_.spin_some(500ms);
  EXPECT_EQ(both[0]->executed + both[1]->executed, 2);
}

TEST_F(SpinTest, OnceIsOne) {
  const auto one = work();
  const auto other = work();
  one->trigger();
  other->trigger();
  one->trigger();
  for (int i = 1; i <= 3; ++i) {
    executor_.spin_once();
    EXPECT_EQ(one->executed + other->executed, i);
  }
  EXPECT_EQ(other->executed, 1) << "who waits longest is next";
  const auto start = std::chrono::steady_clock::now();
  executor_.spin_once(30ms);
  EXPECT_GE(elapsed_since(start), 30ms);
  EXPECT_EQ(one->executed + other->executed, 3);
}

TEST_F(SpinTest, OnceWaitsForWhatComesFirst) {
  const auto late = work();
  std::thread other{[&] {
    std::this_thread::sleep_for(20ms);
    late->trigger();
  }};
  executor_.spin_once(20s);
  other.join();
  EXPECT_EQ(late->executed, 1);
  int runs = 0;
  const auto timer = node_->create_wall_timer(20ms, [&] { ++runs; });
  executor_.spin_once(20s);
  EXPECT_EQ(runs, 1);
}

TEST_F(SpinTest, OnceServesWhatIsCreatedWhileItWaits) {
  int runs = 0;
  rclcpp::TimerBase::SharedPtr timer;
  std::thread other{[&] {
    std::this_thread::sleep_for(20ms);
    timer = node_->create_wall_timer(1ms, [&] { ++runs; });
  }};
  executor_.spin_once(20s);
  other.join();
  EXPECT_EQ(runs, 1);
}

TEST_F(SpinTest, AGroupThatRunsSeveralAtOnceDoesSoHere) {
  std::atomic<int> inside{0};
  std::atomic<bool> were_two{false};
  const auto wide = work(
      [&] {
        ++inside;
        if (comes([&] { return inside >= 2 || were_two; })) were_two = true;
        --inside;
      },
      CallbackGroupType::Reentrant);
  for (int i = 0; i < 4; ++i)
    wide->trigger();
  executor_.spin_some();
  EXPECT_TRUE(were_two);
  EXPECT_EQ(wide->executed, 4);
  wide->trigger();
  executor_.spin_once();
  EXPECT_EQ(wide->executed, 5);
}

// So that a loop of calls costs none.
TEST_F(SpinTest, ThreadsStayForTheNextCall) {
  std::set<std::thread::id> threads;
  const auto noting = work([&] { threads.insert(std::this_thread::get_id()); });
  for (int i = 0; i < 10; ++i) {
    noting->trigger();
    executor_.spin_some();
  }
  EXPECT_EQ(noting->executed, 10);
  EXPECT_EQ(threads.size(), 1U);
  EXPECT_FALSE(threads.contains(std::this_thread::get_id()));
}

TEST_F(SpinTest, SpinGoesOnWhereTheyEnded) {
  const auto one = work();
  one->trigger();
  executor_.spin_some();
  one->trigger();
  Spinning spinning{executor_};
  EXPECT_TRUE(comes([&] { return one->executed == 2; }));
  EXPECT_THROW(executor_.spin_some(), std::runtime_error);
  executor_.cancel();
  spinning.join();
  one->trigger();
  executor_.spin_some();
  EXPECT_EQ(one->executed, 3);
}

TEST_F(SpinTest, UntilTheFutureIsComplete) {
  const auto service = node_->create_service<SetBool>(
      "turn",
      [](const SetBool::Request::SharedPtr& request, const SetBool::Response::SharedPtr& response) {
        response->success = request->data;
      });
  const auto client = node_->create_client<SetBool>("turn");
  auto request = std::make_shared<SetBool::Request>();
  request->data = true;
  for (int i = 0; i < 3; ++i) {
    const auto future = client->async_send_request(request);
    EXPECT_EQ(executor_.spin_until_future_complete(future, 20s), FutureReturnCode::SUCCESS);
    EXPECT_TRUE(future.get()->success);
  }
  rclcpp::Executor& base = executor_;
  const auto future = client->async_send_request(request);
  EXPECT_EQ(base.spin_until_future_complete(future, 20s), FutureReturnCode::SUCCESS);
  EXPECT_EQ(executor_.spin_until_future_complete(future), FutureReturnCode::SUCCESS);
}

TEST_F(SpinTest, UntilTheTimeIsOverOrSomebodyCancels) {
  std::atomic<int> runs{0};
  const auto timer = node_->create_wall_timer(1ms, [&] {
    if (++runs == 30) executor_.cancel();
  });
  std::promise<void> promise;
  const auto future = promise.get_future();
  EXPECT_EQ(executor_.spin_until_future_complete(future, 5ms), FutureReturnCode::TIMEOUT);
  const int at_timeout = runs;
  std::this_thread::sleep_for(10ms);
  EXPECT_EQ(runs, at_timeout);
  EXPECT_EQ(executor_.spin_until_future_complete(future), FutureReturnCode::INTERRUPTED);
  EXPECT_EQ(runs, 30);
  context_->shutdown("test");
  EXPECT_EQ(executor_.spin_until_future_complete(future, 20s), FutureReturnCode::INTERRUPTED);
  EXPECT_EQ(runs, 30);
}

TEST_F(SpinTest, WhatACallbackThrowsComesOut) {
  const auto failing = work([] { throw std::runtime_error{"no more fuel"}; });
  failing->trigger();
  EXPECT_THROW(executor_.spin_some(), cie::CallbackError);
  const auto other = work();
  other->trigger();
  executor_.spin_some();
  EXPECT_EQ(other->executed, 1) << "and the next call serves";
}

// Else what it threw came out of the next call, or of none.
TEST_F(SpinTest, ReturnsWhenWhatACallbackThrewWasHandedOver) {
  std::atomic<bool> was_handled{false};
  CallbackIsolatedExecutor executor{cie::ExecutorOptions{.on_exception =
                                                             [&](const cie::CallbackFailure&) {
                                                               std::this_thread::sleep_for(50ms);
                                                               was_handled = true;
                                                             }},
                                    in_context()};
  const auto other_node = node("failing");
  executor.add_node(other_node);
  const auto group = other_node->create_callback_group(CallbackGroupType::MutuallyExclusive);
  const auto failing = std::make_shared<Work>([] { throw std::runtime_error{"no more fuel"}; });
  other_node->get_node_waitables_interface()->add_waitable(failing, group);
  failing->trigger();
  executor.spin_some();
  EXPECT_TRUE(was_handled);
  failing->trigger();
  executor.spin_some();
  EXPECT_EQ(failing->executed, 2) << "and the next call serves";
}

TEST_F(SpinTest, ParametersAreServed) {
  using rcl_interfaces::srv::SetParameters;
  const auto client = node_->create_client<SetParameters>("/test/node/set_parameters");
  auto request = std::make_shared<SetParameters::Request>();
  request->parameters.push_back(
      {"gain", {rcl_interfaces::msg::ParameterType::PARAMETER_INTEGER, 7}});
  const auto future = client->async_send_request(request);
  for (int i = 0; i < 1000 && future.wait_for(1ms) != std::future_status::ready; ++i)
    executor_.spin_some();
  ASSERT_EQ(future.wait_for(0s), std::future_status::ready);
  EXPECT_EQ(node_->get_parameter("gain"), 7);
}

TEST_F(SpinTest, WhatIsDroppedByAnotherIsNotWaitedFor) {
  std::vector<std::shared_ptr<Work>> doomed;
  const auto group = node_->create_callback_group(CallbackGroupType::MutuallyExclusive);
  for (int i = 0; i < 2; ++i) {
    doomed.push_back(std::make_shared<Work>([&doomed] {
      doomed.resize(1);
      std::this_thread::sleep_for(20ms);
    }));
    node_->get_node_waitables_interface()->add_waitable(doomed.back(), group);
    doomed.back()->trigger();
  }
  const auto first = doomed.front();
  executor_.spin_some(20s);
  EXPECT_EQ(first->executed, 1);
}

TEST_F(SpinTest, NoneBeginsAfterCancel) {
  std::atomic<int> runs{0};
  std::vector<std::shared_ptr<Work>> all(8);
  for (auto& each : all) {
    each = work([&runs, &each] {
      ++runs;
      each->trigger();
    });
  }
  for (int round = 0; round < 50; ++round) {
    for (const auto& each : all)
      each->trigger();
    const int before = runs;
    Spinning spinning{executor_};
    EXPECT_TRUE(comes([&] { return runs > before + 20; }));
    executor_.cancel();
    const std::size_t begun = instances_begun();
    spinning.join();
    EXPECT_EQ(instances_begun(), begun) << round;
  }
}

TEST_F(SpinTest, TheCallbackThatCancelsDoesNotRunAgain) {
  std::shared_ptr<Work> last;
  last = work([&] {
    last->trigger();
    executor_.cancel();
  });
  for (int round = 1; round <= 20; ++round) {
    last->trigger();
    executor_.spin();
    EXPECT_EQ(last->executed, round);
  }
}

}  // namespace
}  // namespace cie_rclcpp
