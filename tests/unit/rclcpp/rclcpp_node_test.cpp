// What look() finds of a node, and as what.
#include "rclcpp_node.hpp"

#include "distributions.hpp"
#include "support/rclcpp/tests/spinning.hpp"

#include <algorithm>
#include <functional>
#include <memory>
#include <thread>

namespace cie_rclcpp {
namespace {

using namespace test;
using cie::GroupType;
using testing::ElementsAre;
using testing::IsEmpty;

class RclcppNodeTest : public WithContext {
 protected:
  static std::vector<std::string> ids(const Callbacks& callbacks) {
    std::vector<std::string> all;
    for (const auto& callback : callbacks)
      all.push_back(callback->logical_id());
    return all;
  }
  std::shared_ptr<RclcppNode> serve(const rclcpp::Node::SharedPtr& node) {
    server_->admission->open([] { return false; });
    auto served = std::make_shared<RclcppNode>(node->get_node_base_interface(), server_, [this] {
      ++changes_;
      on_change_();
    });
    served->add_whole();
    return served;
  }
  rclcpp::CallbackGroup::SharedPtr group(
      const rclcpp::Node::SharedPtr& node,
      CallbackGroupType type = CallbackGroupType::MutuallyExclusive) {
    groups_.push_back(node->create_callback_group(type));
    return groups_.back();
  }

  std::shared_ptr<InternalServer> server_ = std::make_shared<InternalServer>();
  std::atomic<int> changes_{0};
  std::function<void()> on_change_ = [] {};
  std::vector<rclcpp::CallbackGroup::SharedPtr> groups_;
};

TEST_F(RclcppNodeTest, ANodeByItselfHasNoCallbacks) {
  const auto empty = node("empty");
  const auto served = serve(empty);
  EXPECT_EQ(served->name(), "/test/empty");
  const auto changes = served->look();
  EXPECT_THAT(changes.came, IsEmpty()) << "services of parameters are rclcpp's own";
  EXPECT_THAT(changes.gone, IsEmpty());
  EXPECT_EQ(served->groups(RclcppNode::Added::with_node).size(), 1U) << "the default group";
}

// A specification's entry is for whatever timer the node has now.
TEST_F(RclcppNodeTest, WhatTakesThePlaceOfWhatWasDroppedHasItsLogicalId) {
  const auto renewing = node("renewing");
  const auto of_both = group(renewing);
  const auto make = [&] {
    return renewing->create_wall_timer(
        10ms, [] {}, of_both);
  };
  auto timer = make();
  const auto served = serve(renewing);
  Callbacks all = served->look().came;
  ASSERT_THAT(ids(all), ElementsAre("/test/renewing@Timer(10000000)"));
  timer.reset();
  timer = make();
  std::vector<std::string> gone;
  const auto changes = served->look([&](const Callbacks& callbacks) {
    gone = ids(callbacks);
    for (const auto& callback : callbacks)
      callback->begin_to_end();
  });
  EXPECT_THAT(gone, ElementsAre("/test/renewing@Timer(10000000)"));
  EXPECT_THAT(ids(changes.came), ElementsAre("/test/renewing@Timer(10000000)"));
}

// A timer that makes itself anew while it runs: rclcpp keeps the old one until its function returns.
TEST_F(RclcppNodeTest, WhatTakesThePlaceOfWhatStillRunsIsServedThereafter) {
  const auto renewing = node("renewing");
  for (const auto type : {CallbackGroupType::MutuallyExclusive, CallbackGroupType::Reentrant}) {
    const auto of_both = group(renewing, type);
    rclcpp::TimerBase::SharedPtr timer;
    const auto served = serve(renewing);
    const auto look = [&] {
      return served->look([&](const Callbacks& callbacks) {
        for (const auto& callback : callbacks)
          callback->begin_to_end();
      });
    };
    const auto renew = [&] {
      timer = renewing->create_wall_timer(
          1ms, [] {}, of_both);
    };
    RclcppNode::Changes meanwhile;
    timer = renewing->create_wall_timer(
        1ms,
        [&] {
          timer.reset();
          renew();
          meanwhile = look();
        },
        of_both);
    Callbacks first = look().came;
    ASSERT_THAT(ids(first), ElementsAre("/test/renewing@Timer(1000000)"));
    std::this_thread::sleep_for(2ms);
    ASSERT_TRUE(first.front()->execute_one());
    EXPECT_THAT(meanwhile.gone, IsEmpty());
    if (type == CallbackGroupType::Reentrant) {
      EXPECT_THAT(ids(meanwhile.came), ElementsAre("/test/renewing@Timer(1000000)#2"))
          << "both may run";
    } else {
      EXPECT_THAT(meanwhile.came, IsEmpty());
      EXPECT_TRUE(meanwhile.is_partial);
      const auto then = look();
      EXPECT_THAT(ids(then.gone), ElementsAre("/test/renewing@Timer(1000000)"));
      EXPECT_THAT(ids(then.came), ElementsAre("/test/renewing@Timer(1000000)"));
      EXPECT_FALSE(then.is_partial);
    }
    timer.reset();
    meanwhile = {};
    look();
    served->remove_all();
  }
}

TEST_F(RclcppNodeTest, WhatNamesNoGroupSharesTheDefaultOne) {
  const auto shared = node("shared");
  const auto timer = shared->create_wall_timer(10ms, [] {});
  const auto one = shared->create_subscription<Message>("one", 7, [](const Message&) {});
  const auto all = serve(shared)->look().came;
  ASSERT_THAT(ids(all),
              ElementsAre("/test/shared@Timer(10000000)", "/test/shared@Subscription(/test/one)"));
  EXPECT_EQ(&all[0]->group(), &all[1]->group());
  EXPECT_EQ(all[0]->group().type(), GroupType::mutually_exclusive);
}

TEST_F(RclcppNodeTest, OneOfEachKindInItsGroup) {
  const auto all_kinds = node("kinds");
  const auto timer = all_kinds->create_wall_timer(
      10ms, [] {}, group(all_kinds));
  const auto subscription = all_kinds->create_subscription<Message>(
      "topic", 7, [](const Message&) {}, in(group(all_kinds)));
  const auto service = all_kinds->create_service<SetBool>(
      "serve", [](const SetBool::Request::SharedPtr&, const SetBool::Response::SharedPtr&) {},
      rclcpp::kServicesDefault, group(all_kinds, CallbackGroupType::Reentrant));
  const auto client =
      all_kinds->create_client<SetBool>("ask", rclcpp::kServicesDefault, group(all_kinds));
  const auto all = serve(all_kinds)->look().came;
  ASSERT_THAT(ids(all),
              ElementsAre("/test/kinds@Timer(10000000)", "/test/kinds@Subscription(/test/topic)",
                          "/test/kinds@Service(/test/serve)", "/test/kinds@Client(/test/ask)"));
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(all[i]->group().type(),
              i == 2 ? GroupType::reentrant : GroupType::mutually_exclusive);
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_NE(&all[i]->group(), &all[j]->group());
  }
}

TEST_F(RclcppNodeTest, ATimerFirstWithinAGroupThenSubscriptionsServicesClients) {
  const auto mixed = node("mixed");
  const auto of_all = group(mixed);
  const auto client = mixed->create_client<SetBool>("ask", rclcpp::kServicesDefault, of_all);
  const auto subscription = mixed->create_subscription<Message>(
      "topic", 1, [](const Message&) {}, in(of_all));
  const auto timer = mixed->create_wall_timer(
      10ms, [] {}, of_all);
  EXPECT_THAT(ids(serve(mixed)->look().came),
              ElementsAre("/test/mixed@Timer(10000000)", "/test/mixed@Subscription(/test/topic)",
                          "/test/mixed@Client(/test/ask)"));
}

TEST_F(RclcppNodeTest, EqualOnesAreToldApartInOrderOfCreation) {
  const auto equal = node("equal");
  std::vector<rclcpp::TimerBase::SharedPtr> timers;
  for (int i = 0; i < 3; ++i)
    timers.push_back(equal->create_wall_timer(
        50ms, [] {}, group(equal)));
  const auto one = equal->create_subscription<Message>("x", 1, [](const Message&) {});
  const auto other = equal->create_subscription<Message>("x", 1, [](const Message&) {});
  EXPECT_THAT(ids(serve(equal)->look().came),
              ElementsAre("/test/equal@Subscription(/test/x)",
                          "/test/equal@Subscription(/test/x)#2", "/test/equal@Timer(50000000)",
                          "/test/equal@Timer(50000000)#2", "/test/equal@Timer(50000000)#3"));
}

// Only rclcpp's own subscription to /parameter_events is rclcpp's, a further one is the user's.
TEST_F(RclcppNodeTest, AUsersSubscriptionToParameterEventsIsACallback) {
  const auto listening = node("listening");
  const auto events = listening->create_subscription<rcl_interfaces::msg::ParameterEvent>(
      "/parameter_events", 10, [](const rcl_interfaces::msg::ParameterEvent&) {});
  const auto like_own = listening->create_service<SetBool>(
      "/other/get_parameters",
      [](const SetBool::Request::SharedPtr&, const SetBool::Response::SharedPtr&) {});
  EXPECT_THAT(ids(serve(listening)->look().came),
              ElementsAre("/test/listening@Subscription(/parameter_events)",
                          "/test/listening@Service(/other/get_parameters)"));
}

// A manager of lifecycles calls those of rclcpp_lifecycle, in whose nodes nobody can give them a group.
TEST_F(RclcppNodeTest, TheServicesOfALifecycleAreNoCallbacksOfTheUser) {
  const auto managed = node("managed");
  std::vector<rclcpp::ServiceBase::SharedPtr> services;
  const auto offer = [&](const std::string& name) {
    services.push_back(managed->create_service<SetBool>(
        "~/" + name,
        [](const SetBool::Request::SharedPtr&, const SetBool::Response::SharedPtr&) {}));
  };
  for (const auto* name : {"change_state", "get_state", "get_available_states",
                           "get_available_transitions", "get_transition_graph", "mine"})
    offer(name);
  EXPECT_THAT(ids(serve(managed)->look().came),
              ElementsAre("/test/managed@Service(/test/managed/mine)"));
}

TEST_F(RclcppNodeTest, AServiceThatIsCalledLikeOneOfThemIsACallback) {
  const auto plain = node("plain");
  const auto service = plain->create_service<SetBool>(
      "~/get_state",
      [](const SetBool::Request::SharedPtr&, const SetBool::Response::SharedPtr&) {});
  EXPECT_THAT(ids(serve(plain)->look().came),
              ElementsAre("/test/plain@Service(/test/plain/get_state)"));
}

TEST_F(RclcppNodeTest, InAGroupOfItsOwnSoIsTheFirst) {
  const auto listening = node("listening");
  const auto own = listening->create_callback_group(CallbackGroupType::MutuallyExclusive);
  const auto events = listening->create_subscription<Message>(
      "/parameter_events", 1, [](const Message&) {}, in(own));
  const auto clock = listening->create_subscription<Message>(
      "/clock", 1, [](const Message&) {}, in(own));
  EXPECT_EQ(serve(listening)->look().came.size(), 2U);
}

TEST_F(RclcppNodeTest, AnEventHandlerOfTheUsersIsACallbackTheDefaultOneIsNot) {
  const auto handling = node("handling");
  rclcpp::SubscriptionOptions handled;
  handled.event_callbacks.message_lost_callback = [](rclcpp::QOSMessageLostInfo&) {};
  const auto one = handling->create_subscription<Message>(
      "x", 1, [](const Message&) {}, handled);
  const auto other = handling->create_subscription<Message>("y", 1, [](const Message&) {});
  const auto all = serve(handling)->look().came;
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(all[2]->kind(), cie::CallbackKind::waitable);
  EXPECT_THAT(all[2]->logical_id(), testing::HasSubstr("EventHandler"));
}

// As in the constructor of a GenericSubscription: the lambda's type has that function's arguments.
template <typename Allocator>
auto default_handler(const std::function<void(Message)>&, const Allocator&) {
  const auto warn = [](rclcpp::QOSRequestedIncompatibleQoSInfo&) {};
  using Handler = rclcpp::RCLCPP_DOUBLE_EVENT_HANDLER()<decltype(warn),
                                                        rclcpp::QOSRequestedIncompatibleQoSInfo>;
  return std::make_shared<Handler>(std::make_shared<rmw_double::Event>(), warn);
}

TEST_F(RclcppNodeTest, ADefaultHandlerIsOneWhereverItsFunctionStands) {
  EXPECT_TRUE(is_default_event_handler(*default_handler([](const Message&) {}, 1)));
  using Kept =
      rclcpp::RCLCPP_DOUBLE_EVENT_HANDLER()<rclcpp::QOSRequestedIncompatibleQoSCallbackType,
                                            rclcpp::QOSRequestedIncompatibleQoSInfo>;
  EXPECT_EQ(is_default_event_handler(Kept{std::make_shared<rmw_double::Event>(),
                                          [](rclcpp::QOSRequestedIncompatibleQoSInfo&) {}}),
            kOwnHandlersAreFunctions)
      << "a user's, which since Iron nothing tells from rclcpp's own";
}

TEST_F(RclcppNodeTest, TheWayThroughTheProcessIsThatOfItsSubscription) {
  const auto inside =
      std::make_shared<rclcpp::Node>("inside", "/test", options().use_intra_process_comms(true));
  const auto one = inside->create_subscription<Message>("x", 4, [](const Message&) {});
  EXPECT_THAT(ids(serve(inside)->look().came), ElementsAre("/test/inside@Subscription(/test/x)"));
}

// While rclcpp destroys a subscription, that way is there for a moment longer.
TEST_F(RclcppNodeTest, TheWayThroughTheProcessIsNoCallbackWhenItsSubscriptionHasGone) {
  const auto inside =
      std::make_shared<rclcpp::Node>("inside", "/test", options().use_intra_process_comms(true));
  auto one = inside->create_subscription<Message>("x", 4, [](const Message&) {});
  const auto served = serve(inside);
  EXPECT_EQ(served->look().came.size(), 1U);
  const auto way = one->get_intra_process_waitable();
  one.reset();
  const auto changes = served->look();
  EXPECT_THAT(changes.came, IsEmpty());
  EXPECT_EQ(changes.gone.size(), 1U);
}

TEST_F(RclcppNodeTest, FindsWhatIsCreatedAndDroppedLater) {
  const auto changing = node("changing");
  const auto served = serve(changing);
  EXPECT_THAT(served->look().came, IsEmpty());
  int told = changes_;
  auto timer = changing->create_wall_timer(
      10ms, [] {}, group(changing));
  EXPECT_GT(changes_, told) << "rclcpp tells of what is created";
  auto subscription = changing->create_subscription<Message>("x", 1, [](const Message&) {});
  EXPECT_THAT(ids(served->look().came), ElementsAre("/test/changing@Subscription(/test/x)",
                                                    "/test/changing@Timer(10000000)"));
  EXPECT_THAT(served->look().came, IsEmpty()) << "each once";
  told = changes_;
  subscription.reset();
  EXPECT_GT(changes_, told) << "what it was told of arrivals by goes with it";
  {
    const auto changes = served->look();
    EXPECT_THAT(ids(changes.gone), ElementsAre("/test/changing@Subscription(/test/x)"));
    EXPECT_THAT(changes.came, IsEmpty());
  }
  timer.reset();
  groups_.clear();
  EXPECT_THAT(ids(served->look().gone), ElementsAre("/test/changing@Timer(10000000)"));
  EXPECT_THAT(served->look().gone, IsEmpty());
  EXPECT_EQ(served->groups(RclcppNode::Added::with_node).size(), 1U);
}

// Nothing else of it tells: it has no event handler of rclcpp's.
TEST_F(RclcppNodeTest, IsToldOfTheEndOfASubscriptionAlone) {
  const auto changing = node("changing");
  rclcpp::SubscriptionOptions bare;
  bare.use_default_callbacks = false;
  auto one = changing->create_subscription<Message>(
      "x", 1, [](const Message&) {}, bare);
  const auto served = serve(changing);
  served->look();
  const int told = changes_;
  one.reset();
  EXPECT_EQ(changes_, told + 1);
  EXPECT_EQ(served->look().gone.size(), 1U);
}

TEST_F(RclcppNodeTest, IsToldOfTheEndOfItsNode) {
  auto going = node("going");
  const auto served = serve(going);
  bool has_gone = false;
  on_change_ = [&] { has_gone = served->has_gone(); };
  served->look();
  going.reset();
  EXPECT_TRUE(has_gone) << "when it was told the last time";
}

TEST_F(RclcppNodeTest, AGroupThatIsNotAddedWithItsNodeIsLeftAlone) {
  const auto partly = node("partly");
  const auto by_hand = partly->create_callback_group(CallbackGroupType::MutuallyExclusive, false);
  const auto timer = partly->create_wall_timer(
      10ms, [] {}, by_hand);
  const auto served = serve(partly);
  EXPECT_THAT(served->look().came, IsEmpty());
  served->add_group(by_hand);
  EXPECT_THAT(ids(served->look().came), ElementsAre("/test/partly@Timer(10000000)"));
  EXPECT_EQ(served->groups(RclcppNode::Added::by_hand).size(), 1U);
  EXPECT_THAT(ids(served->remove_whole()), IsEmpty());
  EXPECT_FALSE(served->is_empty());
  EXPECT_THAT(ids(served->remove_group(*by_hand)), ElementsAre("/test/partly@Timer(10000000)"));
  EXPECT_TRUE(served->is_empty());
  EXPECT_FALSE(by_hand->get_associated_with_executor_atomic());
}

}  // namespace
}  // namespace cie_rclcpp
