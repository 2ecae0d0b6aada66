// Whoever owns an entity decides when it ends: nobody else keeps it, and nothing calls what has gone.
#include "rclcpp_node.hpp"
#include "support/rclcpp/tests/spinning.hpp"

#include <memory>
#include <string>
#include <vector>

namespace lifecycle_msgs::srv {
struct GetState : std_srvs::srv::SetBool {};
}  // namespace lifecycle_msgs::srv

namespace cie_rclcpp {
namespace {

using namespace test;

class LifetimesTest : public WithContext {
 protected:
  std::shared_ptr<RclcppNode> serve(const rclcpp::Node::SharedPtr& node) {
    auto served = std::make_shared<RclcppNode>(node->get_node_base_interface(), server_, [] {});
    served->add_whole();
    return served;
  }
  static rclcpp::Service<SetBool>::SharedPtr service(rclcpp::Node& node) {
    return node.create_service<SetBool>(
        "serve", [](const SetBool::Request::SharedPtr&, const SetBool::Response::SharedPtr&) {});
  }

  std::shared_ptr<InternalServer> server_ = std::make_shared<InternalServer>();
};

// A handler of events has rcl's handle, and with it the middleware's reader; so may whoever asked for
// the handle. Since Jazzy the subscription goes without a word to the middleware.
TEST_F(LifetimesTest, TheMiddlewareDoesNotCallASubscriptionThatHasGone) {
  const auto watched = node("watched");
  const auto subscription = [&] {
    return watched->create_subscription<Message>("x", 1, [](const Message&) {});
  };
  const auto served = serve(watched);
  {
    auto dropped = subscription();
    const auto reader = dropped->get_subscription_handle()->reader;
    std::vector<std::shared_ptr<rclcpp::Waitable>> handlers;
    for (const auto& each : dropped->get_event_handlers())
      handlers.push_back(each.second);
    ASSERT_EQ(handlers.size(), 1U);
    const auto all = served->look().came;
    ASSERT_EQ(all.size(), 1U);
    EXPECT_TRUE(reader->notice.is_set());
    dropped.reset();
    EXPECT_FALSE(reader->notice.is_set()) << "who owned it has gone, its handler lives";
    EXPECT_FALSE(reader->lost.notice.is_set());
  }
  served->look();
  auto dropped = subscription();
  const auto handle = dropped->get_subscription_handle();
  served->look();
  EXPECT_TRUE(handle->reader->notice.is_set());
  dropped.reset();
  EXPECT_FALSE(handle->reader->notice.is_set());
}

TEST_F(LifetimesTest, TheMiddlewareDoesNotCallAServiceOrAClientThatHasGone) {
  const auto asked = node("asked");
  auto serving = service(*asked);
  auto asking = asked->create_client<SetBool>("serve");
  const auto served = serve(asked);
  served->look();
  const auto of_service = serving->get_service_handle();
  const auto of_client = asking->get_client_handle();
  EXPECT_TRUE(of_service->reader->notice.is_set());
  EXPECT_TRUE(of_client->reader->notice.is_set());
  serving.reset();
  asking.reset();
  EXPECT_FALSE(of_service->reader->notice.is_set());
  EXPECT_FALSE(of_client->reader->notice.is_set());
}

// rcl's state machine ends the services of a lifecycle node before rclcpp's objects of them go: who keeps the
// handle of one then reads what has been freed.
TEST_F(LifetimesTest, NobodyKeepsTheHandleOfAServiceOfRclsStateMachine) {
  using lifecycle_msgs::srv::GetState;
  const auto managed = node("managed");
  const auto serving = managed->create_service<GetState>(
      "~/mine", [](const GetState::Request::SharedPtr&, const GetState::Response::SharedPtr&) {});
  const auto owners = serving->get_service_handle().use_count();
  const auto served = serve(managed);
  served->look();
  EXPECT_TRUE(serving->get_service_handle()->reader->notice.is_set());
  EXPECT_EQ(serving->get_service_handle().use_count(), owners);
}

// A LifecycleNode that is dropped while it is a member ends them, and is looked at meanwhile.
TEST_F(LifetimesTest, NobodyAsksAServiceOfRclsStateMachineAgain) {
  using lifecycle_msgs::srv::GetState;
  const auto managed = node("managed");
  std::vector<rclcpp::Service<GetState>::SharedPtr> services;
  for (const auto* name : {"change_state", "get_state", "get_available_states",
                           "get_available_transitions", "get_transition_graph"}) {
    services.push_back(managed->create_service<GetState>(
        std::string{"~/"} + name,
        [](const GetState::Request::SharedPtr&, const GetState::Response::SharedPtr&) {}));
  }
  const auto served = serve(managed);
  served->look();
  for (const auto& each : services)
    each->get_service_handle()->fini();
  EXPECT_NO_THROW(served->look());
}

// With its owner's last handle an entity ends, whatever the executor knows of it then.
TEST_F(LifetimesTest, NobodyElseKeepsAnEntity) {
  const auto full = node("full");
  const auto served = serve(full);
  auto group = full->create_callback_group(CallbackGroupType::MutuallyExclusive, false);
  served->add_group(group);
  rclcpp::SubscriptionOptions handled;
  handled.event_callbacks.message_lost_callback = [](rclcpp::QOSMessageLostInfo&) {};
  auto subscription = full->create_subscription<Message>(
      "x", 1, [](const Message&) {}, handled);
  auto serving = service(*full);
  auto client = full->create_client<SetBool>("serve");
  auto timer = full->create_wall_timer(10ms, [] {});
  std::vector<std::weak_ptr<const void>> ends{subscription,
                                              serving,
                                              client,
                                              timer,
                                              subscription->get_subscription_handle(),
                                              serving->get_service_handle(),
                                              client->get_client_handle(),
                                              timer->get_timer_handle()};
  for (const auto& each : subscription->get_event_handlers())
    ends.emplace_back(each.second);
  const auto changes = served->look();  // what it found is kept here
  EXPECT_EQ(changes.came.size(), 5U);
  subscription.reset();
  serving.reset();
  client.reset();
  timer.reset();
  for (std::size_t i = 0; i < ends.size(); ++i)
    EXPECT_TRUE(ends[i].expired()) << i;
  const std::weak_ptr<void> of_group = group;
  group.reset();
  EXPECT_TRUE(of_group.expired());
}

// What a callback does as its node is removed by itself ends later, when the entity has another listener.
TEST_F(LifetimesTest, WhoListenedBeforeDoesNotEndWhoListensNow) {
  const auto twice = node("twice");
  const auto subscription = twice->create_subscription<Message>("x", 1, [](const Message&) {});
  const auto serving = service(*twice);
  const auto asking = twice->create_client<SetBool>("serve");
  const auto former = serve(twice);
  const auto before = former->look().came;
  former->remove_whole();
  const auto latter = serve(twice);
  const auto now = latter->look().came;
  for (const auto& callback : before)
    callback->end();
  EXPECT_TRUE(subscription->get_subscription_handle()->reader->notice.is_set());
  EXPECT_TRUE(serving->get_service_handle()->reader->notice.is_set());
  EXPECT_TRUE(asking->get_client_handle()->reader->notice.is_set());
  for (const auto& callback : now)
    callback->end();
  EXPECT_FALSE(subscription->get_subscription_handle()->reader->notice.is_set());
  EXPECT_FALSE(serving->get_service_handle()->reader->notice.is_set());
  EXPECT_FALSE(asking->get_client_handle()->reader->notice.is_set());
}

// Who keeps a handler longer than its subscription has no subscription to handle events of.
TEST_F(LifetimesTest, AHandlerWithoutItsSubscriptionIsNotTaken) {
  const auto watching = node("watching");
  rclcpp::SubscriptionOptions options;
  options.event_callbacks.message_lost_callback = [](rclcpp::QOSMessageLostInfo&) {};
  auto subscription = watching->create_subscription<Message>(
      "x", 1, [](const Message&) {}, options);
  std::vector<rclcpp::Waitable::SharedPtr> handlers;
  for (const auto& each : subscription->get_event_handlers())
    handlers.push_back(each.second);
  ASSERT_FALSE(handlers.empty());
  for (const auto& handler : handlers)
    EXPECT_EQ(owner_of(handler, {subscription}), subscription);
  const auto entity = make_entity(handlers.front(), subscription);
  subscription.reset();
  EXPECT_FALSE(entity->run_next(Inbox::Source::middleware, 0,
                                [](std::int64_t, std::uint64_t) { FAIL() << "it was taken"; }));
}

}  // namespace
}  // namespace cie_rclcpp
