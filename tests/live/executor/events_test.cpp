// What DDS notices of publishers and subscriptions, as callbacks of their own.
#include <cie/scheduling/clock.hpp>

#include "dispatch/node_state.hpp"
#include "executors.hpp"
#include "support.hpp"

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using cie_msgs::Sample;
using testing::ElementsAre;
using testing::IsSubsetOf;
using testing::UnorderedElementsAre;

// What a handler was told.
template <typename Info>
class Told {
 public:
  void operator()(const Info& info) {
    const std::lock_guard lock{mutex_};
    all_.push_back(info);
    threads_.insert(std::this_thread::get_id());
  }
  std::vector<Info> all() const {
    const std::lock_guard lock{mutex_};
    return all_;
  }
  std::optional<Info> last() const {
    const std::lock_guard lock{mutex_};
    return all_.empty() ? std::nullopt : std::optional{all_.back()};
  }
  std::set<std::thread::id> threads() const {
    const std::lock_guard lock{mutex_};
    return threads_;
  }
  auto handler() {
    return [this](const Info& info) { (*this)(info); };
  }

 private:
  mutable std::mutex mutex_;
  std::vector<Info> all_;
  std::set<std::thread::id> threads_;
};

// The changes that were told are the total: none is lost, none told twice.
template <typename Info>
void expect_no_change_lost(const Told<Info>& told) {
  std::int64_t sum = 0;
  std::int64_t before = 0;
  for (const Info& info : told.all()) {
    sum += info.total_count_change;
    EXPECT_EQ(sum, info.total_count);
    EXPECT_GE(info.total_count, before);
    before = info.total_count;
  }
}

std::vector<std::string> ids(const Node& node) {
  std::vector<std::string> ids;
  for (const auto& callback : node.state()->callbacks())
    ids.push_back(callback->logical_id());
  return ids;
}

class Events : public testing::TestWithParam<Kind> {
 protected:
  void SetUp() override {
    executor->add_node(node);
    spinning.emplace(*executor);
  }
  void TearDown() override { spinning.reset(); }

  template <typename F>
  auto subscribe(const QoS& qos, SubscriptionEventCallbacks events, F function) {
    SubscriptionOptions options;
    options.event_callbacks = std::move(events);
    return node.create_subscription<Sample>("data", qos, std::move(function), options);
  }
  auto subscribe(const QoS& qos, SubscriptionEventCallbacks events) {
    return subscribe(qos, std::move(events), [](const Sample&) {});
  }
  auto advertise(const QoS& qos, PublisherEventCallbacks events = {}) {
    return node.create_publisher<Sample>("data", qos, {std::move(events)});
  }

  Context context{private_options()};
  std::unique_ptr<Executor> executor = make(GetParam());
  Node node{context, "node", "/car"};
  std::optional<Spinning> spinning;
};

INSTANTIATE_TEST_SUITE_P(Executors, Events, every_executor(), name_of);

TEST_P(Events, TellBothSidesOfTheOther) {
  Told<MatchedInfo> of_subscription;
  Told<MatchedInfo> of_publisher;
  const auto subscription = subscribe(10, {.matched_callback = of_subscription.handler()});
  auto publisher = advertise(10, {.matched_callback = of_publisher.handler()});
  const auto is_at = [](const auto& told, std::uint32_t total, std::uint32_t current) {
    return eventually([&] {
      const auto last = told.last();
      return last && last->total_count == total && last->current_count == current;
    });
  };
  EXPECT_TRUE(is_at(of_publisher, 1, 1));
  EXPECT_TRUE(is_at(of_subscription, 1, 1));
  publisher.reset();
  EXPECT_TRUE(is_at(of_subscription, 1, 0));
  publisher = advertise(10);
  // Asking how many there are takes nothing from what is told.
  for (int i = 0; i < 100; ++i)
    static_cast<void>(subscription->publisher_count());
  EXPECT_TRUE(is_at(of_subscription, 2, 1));
  expect_no_change_lost(of_subscription);
  std::int64_t current = 0;
  for (const MatchedInfo& info : of_subscription.all()) {
    current += info.current_count_change;
    EXPECT_EQ(current, info.current_count);
  }
}

TEST_P(Events, TellBothSidesThatMessagesAreTooFarApart) {
  Told<DeadlineMissedInfo> requested;
  Told<DeadlineMissedInfo> offered;
  std::atomic<int> received{0};
  const auto subscription =
      subscribe(QoS{10}.deadline(20ms), {.deadline_callback = requested.handler()},
                [&received](const Sample&) { ++received; });
  const auto publisher =
      advertise(QoS{10}.deadline(20ms), {.deadline_callback = offered.handler()});
  publisher->publish(Sample{});
  ASSERT_TRUE(eventually([&] { return received == 1; }));
  EXPECT_TRUE(eventually([&] { return requested.last() && requested.last()->total_count >= 3; }));
  EXPECT_TRUE(eventually([&] { return offered.last() && offered.last()->total_count >= 3; }));
  expect_no_change_lost(requested);
  expect_no_change_lost(offered);
}

TEST_P(Events, TellThatAPublisherSaysNothingOfBeingAlive) {
  Told<LivelinessChangedInfo> changed;
  Told<LivelinessLostInfo> lost;
  const QoS qos = QoS{10}.liveliness(Liveliness::manual_by_topic).liveliness_lease_duration(40ms);
  const auto subscription = subscribe(qos, {.liveliness_callback = changed.handler()});
  const auto publisher = advertise(qos, {.liveliness_callback = lost.handler()});
  const auto alive = [&](std::uint32_t count) {
    return eventually([&] {
      const auto last = changed.last();
      return last && last->alive_count == count && last->not_alive_count == 1 - count;
    });
  };
  EXPECT_TRUE(alive(0));  // as soon as its first lease is over
  EXPECT_TRUE(eventually([&] { return lost.last() && lost.last()->total_count >= 1; }));
  for (int i = 0; i < 3; ++i) {
    const auto before = changed.all().size();
    publisher->publish(Sample{});
    EXPECT_TRUE(eventually([&] { return changed.all().size() > before; }));
    EXPECT_TRUE(alive(0));
  }
  expect_no_change_lost(lost);
  std::int64_t sum = 0;
  for (const auto& info : changed.all()) {
    sum += info.alive_count_change;
    EXPECT_EQ(sum, info.alive_count);
  }
}

TEST_P(Events, TellBothSidesThatTheirQosDoNotFit) {
  Told<IncompatibleQosInfo> requested;
  Told<IncompatibleQosInfo> offered;
  const auto subscription = subscribe(10, {.incompatible_qos_callback = requested.handler()});
  const auto publisher =
      advertise(QoS{10}.best_effort(), {.incompatible_qos_callback = offered.handler()});
  for (const auto* told : {&requested, &offered}) {
    ASSERT_TRUE(eventually([told] { return told->last().has_value(); }));
    EXPECT_EQ(told->last()->total_count, 1U);
    EXPECT_EQ(told->last()->total_count_change, 1);
    EXPECT_EQ(told->last()->last_policy_kind, QosPolicyKind::reliability);
  }
  EXPECT_EQ(subscription->publisher_count(), 0U);
}

TEST_P(Events, EndWithTheirEndpointAlsoInTheirOwnCallback) {
  std::atomic<int> told{0};
  std::shared_ptr<Publisher<Sample>> publisher;
  std::shared_ptr<Subscription<Sample>> subscription;
  subscription = subscribe(QoS{10}.deadline(5ms), {.deadline_callback = [&](const auto&) {
                             if (++told == 2) subscription.reset();
                           }});
  publisher = advertise(QoS{10}.deadline(5ms), {.deadline_callback = [](const auto&) {}});
  publisher->publish(Sample{});
  ASSERT_TRUE(eventually([&] { return told == 2; }));
  ASSERT_TRUE(eventually([&] { return ids(node).size() == 1; }));
  EXPECT_THAT(ids(node), ElementsAre("/car/node@OfferedDeadlineMissed(/car/data)"));
  publisher.reset();
  EXPECT_THAT(ids(node), ElementsAre());
  std::this_thread::sleep_for(20ms);
  EXPECT_EQ(told, 2);
}

TEST_P(Events, ComeAndGoWhileTheyHappen) {
  for (int round = 0; round < 15; ++round) {
    std::atomic<int> missed{0};
    const QoS qos = QoS{1}.deadline(1ms);
    auto passing = std::make_unique<Node>(context, "passing");
    executor->add_node(*passing);
    SubscriptionOptions options;
    options.event_callbacks.deadline_callback = [&missed](const auto&) { ++missed; };
    options.event_callbacks.matched_callback = [](const auto&) {};
    auto subscription = passing->create_subscription<Sample>(
        "/car/data", qos, [](const Sample&) {}, options);
    auto publisher = passing->create_publisher<Sample>(
        "/car/data", qos, {{.deadline_callback = [&missed](const auto&) { ++missed; }}});
    publisher->publish(Sample{});
    ASSERT_TRUE(eventually([&] { return missed > 1; }));
    if (round % 3 == 0) passing.reset();  // before its handles
    if (round % 3 == 1) passing->remove(subscription);
  }
}

TEST(EventCallbacks, TellNothingOfAPublisherThatSaysInTimeThatItIsAlive) {
  Context context{private_options()};
  Node node{context, "node"};
  Told<LivelinessLostInfo> lost;
  const QoS qos = QoS{1}.liveliness(Liveliness::manual_by_topic).liveliness_lease_duration(200ms);
  PublisherEventCallbacks events{.liveliness_callback = lost.handler()};
  const auto publisher = node.create_publisher<Sample>("data", qos, {events});
  const auto subscription = node.create_subscription<Sample>("data", qos, [](const Sample&) {});
  CallbackIsolatedExecutor executor;
  executor.add_node(node);
  const Spinning spinning{executor};
  // For two leases, as soon as this machine lets us run so long without a pause of one.
  EXPECT_TRUE(eventually([&] {
    const auto before = lost.all().size();
    publisher->publish(Sample{});  // a lapsed one needs more than being asserted
    for (int i = 0; i < 40; ++i) {
      std::this_thread::sleep_for(10ms);
      publisher->assert_liveliness();
    }
    return lost.all().size() == before;
  }));
  EXPECT_TRUE(eventually([&] { return lost.last().has_value(); }));  // now that it is silent
}

TEST(EventCallbacks, HaveIdsThatStayAndThreadsOfTheirOwn) {
  Context context{private_options()};
  Node node{context, "node", "/car"};
  Told<MatchedInfo> matched;
  Told<IncompatibleQosInfo> incompatible;
  Told<MatchedInfo> of_publisher;
  SubscriptionOptions options;
  auto& events = options.event_callbacks;
  events.matched_callback = matched.handler();
  events.incompatible_qos_callback = incompatible.handler();
  events.deadline_callback = [](const auto&) {};
  events.liveliness_callback = [](const auto&) {};
  events.message_lost_callback = [](const auto&) {};
  const auto subscription = node.create_subscription<Sample>(
      "data", 10, [](const Sample&) {}, options);
  PublisherEventCallbacks all;
  all.matched_callback = of_publisher.handler();
  all.incompatible_qos_callback = [](const auto&) {};
  all.deadline_callback = [](const auto&) {};
  all.liveliness_callback = [](const auto&) {};
  const auto publisher = node.create_publisher<Sample>("data", 10, {all});
  EXPECT_THAT(
      ids(node),
      UnorderedElementsAre(
          "/car/node@Subscription(/car/data)", "/car/node@SubscriptionMatched(/car/data)",
          "/car/node@RequestedIncompatibleQos(/car/data)",
          "/car/node@RequestedDeadlineMissed(/car/data)", "/car/node@LivelinessChanged(/car/data)",
          "/car/node@MessageLost(/car/data)", "/car/node@PublicationMatched(/car/data)",
          "/car/node@OfferedIncompatibleQos(/car/data)",
          "/car/node@OfferedDeadlineMissed(/car/data)", "/car/node@LivelinessLost(/car/data)"));
  const auto weak = node.create_publisher<Sample>("data", QoS{10}.best_effort());
  CallbackIsolatedExecutor executor;
  executor.add_node(node);
  const Spinning spinning{executor};
  ASSERT_TRUE(
      eventually([&] { return matched.last() && incompatible.last() && of_publisher.last(); }));
  std::set<std::thread::id> threads;
  for (const auto& own : {matched.threads(), incompatible.threads(), of_publisher.threads()}) {
    EXPECT_EQ(own.size(), 1U);
    threads.insert(own.begin(), own.end());
  }
  EXPECT_EQ(threads.size(), 3U);
  std::set<std::string> names;
  for (const NamedThread& thread : threads_now())
    names.insert(thread.name);
  EXPECT_THAT((std::vector<std::string>{"node:Matched", "node:DeadlineMi", "node:MessageLos",
                                        "node:Liveliness", "node:Incompatib"}),
              IsSubsetOf(names));
}

TEST(EventCallbacks, AreNamedLikeTheirSubscriptionAndShareAGroupIfToldTo) {
  Context context{private_options()};
  Node node{context, "node"};
  Told<MatchedInfo> matched;
  Told<IncompatibleQosInfo> incompatible;
  SubscriptionOptions options;
  options.name = "front";
  auto& events = options.event_callbacks;
  events.group = node.create_callback_group(GroupType::mutually_exclusive);
  events.matched_callback = matched.handler();
  events.incompatible_qos_callback = incompatible.handler();
  const auto subscription = node.create_subscription<Sample>(
      "data", 10, [](const Sample&) {}, options);
  EXPECT_THAT(ids(node),
              UnorderedElementsAre("/node@Subscription(front)", "/node@SubscriptionMatched(front)",
                                   "/node@RequestedIncompatibleQos(front)"));
  const auto fits = node.create_publisher<Sample>("data", 10);
  const auto weak = node.create_publisher<Sample>("data", QoS{10}.best_effort());
  CallbackIsolatedExecutor executor;
  executor.add_node(node);
  const Spinning spinning{executor};
  ASSERT_TRUE(eventually([&] { return matched.last() && incompatible.last(); }));
  EXPECT_EQ(matched.threads(), incompatible.threads());

  Node other{context, "other"};
  PublisherEventCallbacks strange{.matched_callback = [](const auto&) {}, .group = events.group};
  EXPECT_THROW((void)other.create_publisher<Sample>("data", 10, {strange}), std::logic_error);
}

TEST(EventCallbacks, AreRefusedWithTheirEndpointIfASpecCannotBeApplied) {
  Context context{private_options()};
  Node node{context, "node"};
  ExecutorOptions options;
  options.spec = std::make_shared<SchedulingSpec>(SchedulingSpec::parse(R"(
callback_groups:
  - id: /node@SubscriptionMatched(/data)
    policy: SCHED_OTHER
    affinity: [1023]
)",
                                                                        "spec.yaml"));
  CallbackIsolatedExecutor executor{options};
  executor.add_node(node);
  std::atomic<bool> is_served{false};
  const auto timer = node.create_wall_timer(1ms, [&is_served] { is_served = true; });
  const Spinning spinning{executor};
  ASSERT_TRUE(eventually([&] { return is_served.load(); }));
  SubscriptionOptions matched;
  matched.event_callbacks.matched_callback = [](const auto&) {};
  EXPECT_THROW((void)node.create_subscription<Sample>(
                   "data", 10, [](const Sample&) {}, matched),
               SchedulingRefused);
  EXPECT_THAT(ids(node), ElementsAre(timer->logical_id()));
  const auto subscription = node.create_subscription<Sample>("data", 10, [](const Sample&) {});
  EXPECT_EQ(subscription->logical_id(), "/node@Subscription(/data)");
}

// Warnings of a Context, which come from threads of DDS.
class Warned {
 public:
  Context::Options options() {
    auto options = private_options();
    options.on_warning = [this](const std::string& text) {
      const std::lock_guard lock{mutex_};
      texts_.push_back(text);
    };
    return options;
  }
  std::vector<std::string> texts() const {
    const std::lock_guard lock{mutex_};
    return texts_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> texts_;
};

TEST(Warnings, TellOnceOfQosThatDoNotFitAndThatNobodyHandles) {
  Warned warned;
  Context context{warned.options()};
  Node node{context, "node", "/car"};
  const auto subscription = node.create_subscription<Sample>("data", 10, [](const Sample&) {});
  for (int i = 0; i < 3; ++i) {
    const auto weak = node.create_publisher<Sample>("data", QoS{10}.best_effort());
  }
  const auto rare =
      node.create_subscription<Sample>("/late", QoS{10}.deadline(1s), [](const Sample&) {});
  const auto often = node.create_publisher<Sample>("/late", QoS{10}.deadline(2s));
  EXPECT_TRUE(eventually([&] { return warned.texts().size() >= 4; }));
  EXPECT_THAT(
      warned.texts(),
      UnorderedElementsAre(
          "subscription of \"/car/data\" in node /car/node: a publisher offers less than its QoS "
          "asks for (reliability): no messages of it come",
          "publisher of \"/car/data\" in node /car/node: a subscription asks for more than its QoS "
          "offers (reliability): no messages go to it",
          "subscription of \"/late\" in node /car/node: a publisher offers less than its QoS asks "
          "for (deadline): no messages of it come",
          "publisher of \"/late\" in node /car/node: a subscription asks for more than its QoS "
          "offers (deadline): no messages go to it"));
}

TEST(Lifespan, EndsMessagesThatWait) {
  Context context{private_options()};
  Node node{context, "node"};
  std::atomic<int> received{0};
  const auto subscription =
      node.create_subscription<Sample>("data", 10, [&](const Sample&) { ++received; });
  const auto lasting = node.create_publisher<Sample>("data", 10);
  const auto passing = node.create_publisher<Sample>("data", QoS{10}.lifespan(10ms));
  passing->publish(Sample{});
  passing->publish(std::make_shared<const Sample>());
  std::this_thread::sleep_for(100ms);
  lasting->publish(Sample{});
  SingleThreadedExecutor executor;
  executor.add_node(node);
  const Spinning spinning{executor};
  EXPECT_TRUE(eventually([&] { return received == 1; }));
  std::this_thread::sleep_for(20ms);
  EXPECT_EQ(received, 1);
}

}  // namespace
}  // namespace cie::test
