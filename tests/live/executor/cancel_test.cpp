// What a cancelled spin leaves to the next one.
#include "executors.hpp"
#include "support.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

using cie_msgs::Sample;

class Cancelling : public testing::TestWithParam<Kind> {
 protected:
  Context context{private_options()};
  Node node{context, "node"};
};

INSTANTIATE_TEST_SUITE_P(Executors, Cancelling, every_executor(), name_of);

// Each spin is cancelled by a callback in the middle of the others' messages: some have been taken
// by then. The pool of a reentrant group takes several at once.
TEST_P(Cancelling, LosesNoMessageAndRepeatsNone) {
  constexpr std::uint64_t kMessages = 2000;
  constexpr int kBetweenCancels = 40;
  const auto executor = make(GetParam(), {.reentrant_threads = 3});
  std::atomic<std::uint64_t> received{0};
  std::array<std::array<std::atomic<int>, kMessages>, 2> times{};
  const auto receiver = [&](std::size_t which) {
    return [&, which](const Sample& message) {
      ++times.at(which).at(message.seq);
      if (++received % kBetweenCancels == 0) executor->cancel();
    };
  };
  const auto publisher = node.create_publisher<Sample>("data", QoS{KeepAll{}});
  const auto exclusive = node.create_subscription<Sample>("data", QoS{KeepAll{}}, receiver(0));
  SubscriptionOptions together;
  together.group = node.create_callback_group(GroupType::reentrant);
  const auto reentrant =
      node.create_subscription<Sample>("data", QoS{KeepAll{}}, receiver(1), together);
  const auto message = make_message<Sample>();
  for (std::uint64_t seq = 0; seq < kMessages; ++seq) {
    message->seq = seq;
    publisher->publish(*message);
  }
  executor->add_node(node);
  const auto end = std::chrono::steady_clock::now() + 50s;
  while (received < 2 * kMessages && std::chrono::steady_clock::now() < end)
    executor->spin_for(1s);
  for (const auto& of_subscription : times) {
    for (const auto& count : of_subscription)
      ASSERT_EQ(count, 1);
  }
}

}  // namespace
}  // namespace cie::test
