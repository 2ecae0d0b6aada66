// Messages that are handed over reach subscriptions of their process as they are.
#include "executors.hpp"
#include "support.hpp"
#include "support/sanitizers.hpp"

#include <array>
#include <atomic>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <dds/dds.h>
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <test_messages.hpp>

namespace cie::test {
namespace {

using cie_msgs::Sample;
using test_messages::Shift;

// Messages as two subscriptions got them.
class Pointers : public testing::TestWithParam<Kind> {
 protected:
  void SetUp() override {
#ifdef CIE_TEST_SERIALIZED
    GTEST_SKIP() << "not possible here: built without CIE_MESSAGES_BY_POINTER";
#endif
  }
  auto keep(std::size_t index) {
    return [this, index](std::shared_ptr<const Sample> message) {
      const std::lock_guard lock{mutex};
      kept.at(index).push_back(std::move(message));
    };
  }
  bool have(std::size_t count) {
    return eventually([&] {
      const std::lock_guard lock{mutex};
      return kept[0].size() == count && kept[1].size() == count;
    });
  }
  Context context{private_options()};
  Node node{context, "node"};
  std::mutex mutex;
  std::array<std::vector<std::shared_ptr<const Sample>>, 2> kept;
};

INSTANTIATE_TEST_SUITE_P(Executors, Pointers, every_executor(), name_of);

TEST_P(Pointers, AreWhatEverySubscriptionGets) {
  const auto first = node.create_subscription<Sample>("data", QoS{KeepAll{}}, keep(0));
  const auto second = node.create_subscription<Sample>("data", QoS{KeepAll{}}, keep(1));
  const auto publisher = node.create_publisher<Sample>("data", QoS{KeepAll{}});
  const auto executor = make_executor(GetParam());
  executor->add_node(node);
  Spinning spinning{*executor};
  std::vector<const Sample*> published;
  for (std::uint64_t i = 0; i < 100; ++i) {
    auto message = make_message<Sample>();
    message->seq = i;
    set_text(message->frame_id, std::to_string(i));
    published.push_back(message.get());
    if (i % 2 == 0) {
      publisher->publish(std::move(message));
    } else {
      publisher->publish(std::shared_ptr<const Sample>{std::move(message)});
    }
  }
  ASSERT_TRUE(have(100));
  spinning.cancel_and_wait();
  for (std::size_t i = 0; i < 100; ++i) {
    EXPECT_EQ(kept[0][i].get(), published[i]);
    EXPECT_EQ(kept[1][i].get(), published[i]);
    EXPECT_EQ(kept[0][i]->frame_id, std::to_string(i));
  }
}

TEST_F(Pointers, LetGoOfAMessageWhenTheLastSubscriptionIsDone) {
  std::atomic<int> freed{0};
  std::atomic<int> seen{0};
  const auto look = [&](const Sample&) { ++seen; };
  const auto first = node.create_subscription<Sample>("data", QoS{KeepAll{}}, look);
  const auto second = node.create_subscription<Sample>("data", QoS{KeepAll{}}, look);
  const auto publisher = node.create_publisher<Sample>("data", QoS{KeepAll{}});
  CallbackIsolatedExecutor executor;
  executor.add_node(node);
  const Spinning spinning{executor};
  for (int i = 0; i < 50; ++i) {
    publisher->publish(std::shared_ptr<const Sample>{new Sample{}, [&](const Sample* gone) {
                                                       delete gone;
                                                       ++freed;
                                                     }});
  }
  EXPECT_TRUE(eventually([&] { return seen == 100 && freed == 50; }));
}

TEST_F(Pointers, OutliveWhoeverPublishedThem) {
  {
    Context own{{.domain = 19, .loopback = true, .tag = "pointers"}};
    Node other{own, "other"};
    const auto subscription = other.create_subscription<Sample>("data", 1, keep(0));
    CallbackIsolatedExecutor executor;
    executor.add_node(other);
    const Spinning spinning{executor};
    auto message = make_message<Sample>();
    set_text(message->frame_id, "alive");
    other.create_publisher<Sample>("data", 1)->publish(std::move(message));
    ASSERT_TRUE(eventually([&] {
      const std::lock_guard lock{mutex};
      return kept[0].size() == 1;
    }));
  }
  EXPECT_STREQ(kept[0][0]->frame_id, "alive");
}

TEST_F(Pointers, ReachALateSubscriptionOfTransientLocalMessages) {
  const auto qos = QoS{KeepLast{1}}.transient_local();
  const auto publisher = node.create_publisher<Sample>("map", qos);
  const std::shared_ptr<const Sample> message{make_message<Sample>()};
  publisher->publish(message);
  const auto late = node.create_subscription<Sample>("map", qos, keep(0));
  const auto later = node.create_subscription<Sample>("map", qos, keep(1));
  CallbackIsolatedExecutor executor;
  executor.add_node(node);
  const Spinning spinning{executor};
  ASSERT_TRUE(have(1));
  EXPECT_EQ(kept[0][0], message);
  EXPECT_EQ(kept[1][0], message);
}

TEST_F(Pointers, AreNotNull) {
  const auto publisher = node.create_publisher<Sample>("data", 1);
  EXPECT_THROW(publisher->publish(MessagePtr<Sample>{}), std::invalid_argument);
  EXPECT_THROW(publisher->publish(std::shared_ptr<const Sample>{}), std::invalid_argument);
}

TEST_F(Pointers, AreCopiedWhenTheContextPassesNone) {
  auto options = private_options();
  options.domain -= 19;
  options.pass_pointers = false;
  Context serializing{options};
  Node other{serializing, "other"};
  const auto first = other.create_subscription<Sample>("data", 1, keep(0));
  const auto second = other.create_subscription<Sample>("data", 1, keep(1));
  CallbackIsolatedExecutor executor;
  executor.add_node(other);
  const Spinning spinning{executor};
  auto message = make_message<Sample>();
  message->seq = 7;
  const std::shared_ptr<const Sample> shared{std::move(message)};
  other.create_publisher<Sample>("data", 1)->publish(shared);
  EXPECT_EQ(shared.use_count(), 1);
  ASSERT_TRUE(have(1));
  EXPECT_EQ(kept[0][0]->seq, 7U);
  EXPECT_NE(kept[0][0], shared);
  EXPECT_NE(kept[0][0], kept[1][0]);
}

// An endpoint of plain Cyclone DDS in this process: it knows nothing of our types.
class Plain {
 public:
  Plain(const Context& context, const dds_topic_descriptor& type, const char* topic)
      : participant_(dds_create_participant(context.options().domain, nullptr, nullptr)),
        topic_(dds_create_topic(participant_, &type, topic, nullptr, nullptr)) {}
  Plain(const Plain&) = delete;
  Plain& operator=(const Plain&) = delete;
  ~Plain() { dds_delete(participant_); }
  dds_entity_t reader() const {
    return dds_create_reader(participant_, topic_, qos().get(), nullptr);
  }
  dds_entity_t writer() const {
    return dds_create_writer(participant_, topic_, qos().get(), nullptr);
  }

 private:
  static std::unique_ptr<dds_qos_t, void (*)(dds_qos_t*)> qos() {
    std::unique_ptr<dds_qos_t, void (*)(dds_qos_t*)> made{dds_create_qos(), dds_delete_qos};
    dds_qset_reliability(made.get(), DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
    return made;
  }
  dds_entity_t participant_;
  dds_entity_t topic_;
};

TEST_F(Pointers, GoAsBytesToWhoKnowsOnlyBytesAndBack) {
  const Plain plain{context, MessageTraits<Sample>::descriptor(), "rt/data"};
  const dds_entity_t reader = plain.reader();
  const dds_entity_t writer = plain.writer();
  const auto first = node.create_subscription<Sample>("data", QoS{KeepAll{}}, keep(0));
  const auto second = node.create_subscription<Sample>("data", QoS{KeepAll{}}, keep(1));
  const auto publisher = node.create_publisher<Sample>("data", QoS{KeepAll{}});
  CallbackIsolatedExecutor executor;
  executor.add_node(node);
  const Spinning spinning{executor};

  auto message = make_message<Sample>();
  set_text(message->frame_id, "out");
  resize(message->payload, 5);
  message->payload._buffer[4] = 9;
  publisher->publish(std::move(message));
  ASSERT_TRUE(have(1));
  void* samples[1] = {nullptr};
  dds_sample_info_t info{};
  ASSERT_EQ(dds_take(reader, samples, &info, 1, 1), 1);
  const auto* const taken = static_cast<const Sample*>(samples[0]);
  EXPECT_STREQ(taken->frame_id, "out");
  ASSERT_EQ(taken->payload._length, 5U);
  EXPECT_EQ(taken->payload._buffer[4], 9);
  dds_return_loan(reader, samples, 1);

  const auto back = make_message<Sample>();
  set_text(back->frame_id, "back");
  ASSERT_EQ(dds_write(writer, back.get()), DDS_RETCODE_OK);
  ASSERT_TRUE(have(2));
  EXPECT_STREQ(kept[0][1]->frame_id, "back");
  EXPECT_NE(kept[0][1], kept[1][1]);
}

TEST_F(Pointers, WithAForbiddenValueAreRefusedWhenSomebodyNeedsBytes) {
  std::atomic<int> seen{0};
  const auto subscription =
      node.create_subscription<Shift>("shift", QoS{KeepAll{}}, [&](const Shift&) { ++seen; });
  const auto publisher = node.create_publisher<Shift>("shift", QoS{KeepAll{}});
  const auto shift_to = [&](int gear) {
    auto message = make_message<Shift>();
    message->gear = static_cast<decltype(message->gear)>(gear);
    publisher->publish(std::move(message));
  };
  CallbackIsolatedExecutor executor;
  executor.add_node(node);
  const Spinning spinning{executor};
  EXPECT_NO_THROW(shift_to(17));
  EXPECT_TRUE(eventually([&] { return seen == 1; }));
  const Plain plain{context, MessageTraits<Shift>::descriptor(), "rt/shift"};
  const dds_entity_t reader = plain.reader();
  ASSERT_TRUE(eventually([&] { return publisher->subscription_count() == 2; }));
  EXPECT_THROW(shift_to(17), std::runtime_error);
  EXPECT_NO_THROW(shift_to(1));
  void* samples[2] = {nullptr};
  dds_sample_info_t infos[2];
  EXPECT_EQ(dds_take(reader, samples, infos, 2, 2), 1);
  EXPECT_EQ(static_cast<int>(static_cast<const Shift*>(samples[0])->gear), 1);
  dds_return_loan(reader, samples, 1);
}

TEST_F(Pointers, KeepTheLibraryLoadedWhoseCodeFreesThem) {
  const auto is_loaded = [] {
    void* const handle = dlopen(CIE_POINTER_LIBRARY, RTLD_LAZY | RTLD_NOLOAD);
    if (handle != nullptr) dlclose(handle);
    return handle != nullptr;
  };
  int freed = 0;
  const auto subscription = node.create_subscription<Sample>("data", 1, keep(0));
  void* const library = dlopen(CIE_POINTER_LIBRARY, RTLD_NOW | RTLD_LOCAL);
  ASSERT_NE(library, nullptr) << dlerror();
  const auto publish =
      reinterpret_cast<void (*)(Node&, int*)>(dlsym(library, "publish_from_library"));
  ASSERT_NE(publish, nullptr);
  publish(node, &freed);
  dlclose(library);
  EXPECT_TRUE(is_loaded());
  CallbackIsolatedExecutor executor;
  executor.add_node(node);
  Spinning spinning{executor};
  ASSERT_TRUE(eventually([&] {
    const std::lock_guard lock{mutex};
    return kept[0].size() == 1;
  }));
  spinning.cancel_and_wait();
  executor.remove_node(node);
  EXPECT_EQ(kept[0][0]->seq, 42U);
  EXPECT_EQ(freed, 0);
  kept[0].clear();
  EXPECT_EQ(freed, 1);
#ifndef CIE_ADDRESS_SANITIZER  // which keeps libraries for its reports
  EXPECT_FALSE(is_loaded());
#endif
}

}  // namespace
}  // namespace cie::test
