// Nodes and groups come and go.
#include <cie/scheduling/callback.hpp>

#include "support/rclcpp/tests/spinning.hpp"

#include <stdexcept>

namespace cie_rclcpp {
namespace {

using namespace test;

class MembersTest : public WithContext {
 protected:
  static std::string message_of(const std::function<void()>& function) {
    try {
      function();
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "nothing was thrown";
  }
  CallbackIsolatedExecutor executor_{cie::ExecutorOptions{}, in_context()};
};

TEST_F(MembersTest, ANodeHasOneExecutor) {
  const auto shared = node("shared");
  executor_.add_node(shared);
  const std::string already = "Node '/test/shared' has already been added to an executor.";
  EXPECT_EQ(message_of([&] { executor_.add_node(shared); }), already);
  CallbackIsolatedExecutor other{cie::ExecutorOptions{}, in_context()};
  EXPECT_EQ(message_of([&] { other.add_node(shared); }), already);
  EXPECT_EQ(message_of([&] { other.remove_node(shared); }),
            "Node needs to be associated with this executor.");
  executor_.remove_node(shared);
  EXPECT_EQ(message_of([&] { executor_.remove_node(shared); }),
            "Node needs to be associated with this executor.");
  other.add_node(shared);
}

TEST_F(MembersTest, AGroupHasOneExecutor) {
  const auto shared = node("shared");
  const auto base = shared->get_node_base_interface();
  const auto group = shared->create_callback_group(CallbackGroupType::MutuallyExclusive, false);
  EXPECT_EQ(message_of([&] { executor_.remove_callback_group(group); }),
            "Callback group needs to be associated with this executor.");
  executor_.add_callback_group(group, base);
  EXPECT_EQ(message_of([&] { executor_.add_callback_group(group, base); }),
            "Callback group has already been added to an executor.");
  EXPECT_EQ(executor_.get_manually_added_callback_groups().size(), 1U);
  EXPECT_EQ(executor_.get_automatically_added_callback_groups_from_nodes().size(), 0U);
  executor_.remove_callback_group(group);
  EXPECT_EQ(executor_.get_all_callback_groups().size(), 0U);
  executor_.add_callback_group(group, base);
}

TEST_F(MembersTest, AnExecutorThatGoesLetsGo) {
  const auto kept = node("kept");
  const auto group = kept->create_callback_group(CallbackGroupType::MutuallyExclusive, false);
  {
    CallbackIsolatedExecutor other{cie::ExecutorOptions{}, in_context()};
    other.add_node(kept);
    other.add_callback_group(group, kept->get_node_base_interface());
    other.spin_for(1ms);
  }
  executor_.add_node(kept);
  executor_.add_callback_group(group, kept->get_node_base_interface());
}

TEST_F(MembersTest, GroupsOfOneNodeInTwoExecutors) {
  const auto split = node("split");
  std::atomic<int> here{0};
  std::atomic<int> there{0};
  const auto group = split->create_callback_group(CallbackGroupType::MutuallyExclusive, false);
  const auto one = split->create_wall_timer(1ms, [&] { ++here; });
  const auto two = split->create_wall_timer(
      1ms, [&] { ++there; }, group);
  CallbackIsolatedExecutor other{cie::ExecutorOptions{}, in_context()};
  executor_.add_node(split);
  other.add_callback_group(group, split->get_node_base_interface());
  {
    const Spinning first{executor_};
    EXPECT_TRUE(comes([&] { return here > 0; }));
    EXPECT_EQ(there, 0);
    const Spinning second{other};
    EXPECT_TRUE(comes([&] { return there > 0; }));
  }
}

TEST_F(MembersTest, RemovingANodeWaitsForWhatItsCallbackDoes) {
  const auto working = node("working");
  std::atomic<bool> is_inside{false};
  std::atomic<bool> has_ended{false};
  const auto timer = working->create_wall_timer(1ms, [&] {
    is_inside = true;
    std::this_thread::sleep_for(50ms);
    has_ended = true;
  });
  executor_.add_node(working);
  const Spinning spinning{executor_};
  EXPECT_TRUE(comes([&] { return is_inside.load(); }));
  executor_.remove_node(working);
  EXPECT_TRUE(has_ended);
  has_ended = false;
  std::this_thread::sleep_for(10ms);
  EXPECT_FALSE(has_ended) << "nothing of it runs any more";
}

TEST_F(MembersTest, ACallbackRemovesItsOwnNode) {
  const auto leaving = node("leaving");
  std::atomic<int> runs{0};
  const auto timer = leaving->create_wall_timer(1ms, [&] {
    ++runs;
    executor_.remove_node(leaving);
  });
  executor_.add_node(leaving);
  const Spinning spinning{executor_};
  EXPECT_TRUE(comes([&] { return runs == 1; }));
  std::this_thread::sleep_for(10ms);
  EXPECT_EQ(runs, 1);
}

TEST_F(MembersTest, AddedWhileItSpins) {
  std::atomic<int> runs{0};  // outlives the spinning: a timer may go while its callback runs
  const Spinning spinning{executor_};
  std::this_thread::sleep_for(5ms);
  const auto late = node("late");
  const auto timer = late->create_wall_timer(1ms, [&] { ++runs; });
  executor_.add_node(late);
  EXPECT_TRUE(comes([&] { return runs > 0; }));
  executor_.remove_node(late);
  const int until_now = runs;
  std::this_thread::sleep_for(5ms);
  EXPECT_EQ(runs, until_now);
  executor_.add_node(late);
  EXPECT_TRUE(comes([&] { return runs > until_now; })) << "and again";
}

TEST_F(MembersTest, ANodeMayGoWithoutBeingRemoved) {
  std::atomic<int> runs{0};
  const Spinning spinning{executor_};
  for (int i = 0; i < 3; ++i) {
    auto going = node("going");
    auto timer = going->create_wall_timer(1ms, [&] { ++runs; });
    executor_.add_node(going);
    const int until_now = runs;
    EXPECT_TRUE(comes([&] { return runs > until_now; }));
    timer.reset();
    going.reset();
    EXPECT_TRUE(comes([&] { return executor_.get_all_callback_groups().empty(); }));
  }
}

// The user still has the group and what is in it: with its node, nobody serves that any more.
TEST_F(MembersTest, ANodeMayGoBeforeWhatItCreated) {
  std::atomic<int> runs{0};
  const Spinning spinning{executor_};
  auto going = node("going");
  const auto group = going->create_callback_group(CallbackGroupType::MutuallyExclusive);
  const auto timer = going->create_wall_timer(
      1ms, [&] { ++runs; }, group);
  executor_.add_node(going);
  EXPECT_TRUE(comes([&] { return runs > 0; }));
  going.reset();
  EXPECT_TRUE(comes([&] { return executor_.get_all_callback_groups().empty(); }));
  EXPECT_TRUE(ends(runs));
}

// It lives on until its callback ends, and where rclcpp's list of timers is just being read, until that
// ends: rclcpp's own executors, too, may run it once more then.
TEST_F(MembersTest, ATimerIsDroppedWhileItRuns) {
  std::atomic<int> runs{0};
  std::atomic<bool> may_end{false};
  const auto dropping = node("dropping");
  auto timer = dropping->create_wall_timer(1ms, [&] {
    ++runs;
    comes([&] { return may_end.load(); });
  });
  executor_.add_node(dropping);
  const Spinning spinning{executor_};
  EXPECT_TRUE(comes([&] { return runs > 0; }));
  const std::weak_ptr dropped = timer;
  timer.reset();
  EXPECT_FALSE(dropped.expired()) << "its callback runs";
  may_end = true;
  ASSERT_TRUE(comes([&] { return dropped.expired(); }));
  const int until_now = runs;
  std::this_thread::sleep_for(10ms);
  EXPECT_EQ(runs, until_now);
}

// Whoever looks for what is new does not wait for a callback, which may wait for what is new.
TEST_F(MembersTest, ACallbackMayWaitForWhatItCreates) {
  const auto busy = node("busy");
  const auto of_timer = busy->create_callback_group(CallbackGroupType::MutuallyExclusive);
  const auto of_others = busy->create_callback_group(CallbackGroupType::MutuallyExclusive);
  auto sibling = busy->create_subscription<Message>(
      "unused", 1, [](const Message&) {}, in(of_timer));
  rclcpp::TimerBase::SharedPtr created;
  std::atomic<bool> created_ran{false};
  std::atomic<int> outcome{0};
  const auto timer = busy->create_wall_timer(
      1ms,
      [&] {
        if (outcome != 0) return;
        sibling.reset();  // of this group: its end would wait for this callback
        std::this_thread::sleep_for(20ms);
        created = busy->create_wall_timer(
            1ms, [&] { created_ran = true; }, of_others);
        outcome = comes([&] { return created_ran.load(); }) ? 1 : 2;
      },
      of_timer);
  executor_.add_node(busy);
  const Spinning spinning{executor_};
  ASSERT_TRUE(comes([&] { return outcome != 0; }));
  EXPECT_EQ(outcome, 1);
}

// A parameter's function runs on the thread that serves parameters, and may end what it serves.
TEST_F(MembersTest, AParametersFunctionRemovesItsNode) {
  const auto tuned = node("tuned");
  std::atomic<bool> has_removed{false};
  const auto handle = tuned->add_on_set_parameters_callback([&](const auto&) {
    executor_.remove_node(tuned);
    has_removed = true;
    return rcl_interfaces::msg::SetParametersResult{.successful = true};
  });
  using rcl_interfaces::srv::SetParameters;
  const auto client = tuned->create_client<SetParameters>("/test/tuned/set_parameters");
  executor_.add_node(tuned);
  const Spinning spinning{executor_};
  auto request = std::make_shared<SetParameters::Request>();
  request->parameters.push_back(
      {"gain", {rcl_interfaces::msg::ParameterType::PARAMETER_INTEGER, 7}});
  client->async_send_request(request);
  EXPECT_TRUE(comes([&] { return has_removed.load(); }));
}

// Nothing of it is left but the user's handle, which nobody serves.
TEST_F(MembersTest, AGroupMayGoBeforeItsCallbacks) {
  const auto one = node("one");
  auto group = one->create_callback_group(CallbackGroupType::MutuallyExclusive);
  std::atomic<int> runs{0};
  const auto timer = one->create_wall_timer(
      1ms, [&] { ++runs; }, group);
  executor_.add_node(one);
  const Spinning spinning{executor_};
  ASSERT_TRUE(comes([&] { return runs > 0; }));
  group.reset();
  executor_.remove_node(one);
  const int at_removal = runs;
  std::this_thread::sleep_for(20ms);
  EXPECT_EQ(runs, at_removal);
}

// What the executor found gone by itself still belongs to its node.
TEST_F(MembersTest, RemovingANodeWaitsForCallbacksWhoseGroupWentBefore) {
  const auto working = node("working");
  auto group = working->create_callback_group(CallbackGroupType::MutuallyExclusive);
  std::atomic<bool> is_inside{false};
  std::atomic<bool> may_end{false};
  std::atomic<bool> has_ended{false};
  const auto timer = working->create_wall_timer(
      1ms,
      [&] {
        is_inside = true;
        comes([&] { return may_end.load(); });
        std::this_thread::sleep_for(50ms);
        has_ended = true;
      },
      group);
  executor_.add_node(working);
  const Spinning spinning{executor_};
  ASSERT_TRUE(comes([&] { return is_inside.load(); }));
  group.reset();
  const auto other = working->create_wall_timer(1s, [] {});  // the executor looks at the node again
  ASSERT_TRUE(comes([&] { return executor_.get_all_callback_groups().size() == 1; }));
  may_end = true;
  executor_.remove_node(working);
  EXPECT_TRUE(has_ended);
}

// Coming and going at random, beside messages: for the sanitizers.
TEST_F(MembersTest, EverythingAtOnce) {
  const auto steady = node("steady");
  const auto publisher = steady->create_publisher<Message>("topic", 10);
  std::atomic<int> received{0};
  const auto timer =
      steady->create_wall_timer(1ms, [&, i = 0U]() mutable { publisher->publish(Message{++i}); });
  executor_.add_node(steady);
  Spinning spinning{executor_};
  for (int i = 0; i < 20; ++i) {
    auto changing = node("changing");
    executor_.add_node(changing);
    std::vector<std::shared_ptr<void>> all;
    for (int j = 0; j < 3; ++j) {
      const auto group = changing->create_callback_group(
          j == 2 ? CallbackGroupType::Reentrant : CallbackGroupType::MutuallyExclusive);
      all.push_back(group);
      all.push_back(changing->create_subscription<Message>(
          "topic", 2, [&](const Message&) { ++received; }, in(group)));
      all.push_back(changing->create_wall_timer(
          1ms, [&] { ++received; }, group));
    }
    const int until_now = received;
    EXPECT_TRUE(comes([&] { return received > until_now + 5; }));
    if (i % 3 == 0) all.clear();
    if (i % 2 == 0) executor_.remove_node(changing);
  }
}

}  // namespace
}  // namespace cie_rclcpp
