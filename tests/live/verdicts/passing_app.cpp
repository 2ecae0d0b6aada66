// Callbacks that come and go while an isolated executor spins: dropped by others, by themselves,
// with their node, and removed. One has samples waiting before it is there.
#include <cie/executor/executor.hpp>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <exception>
#include <memory>
#include <thread>

#include <cie_messages.hpp>

namespace {

using namespace std::chrono_literals;
using cie_msgs::Sample;

void run() {
  cie::Context context;
  cie::Node node{context, "stays", "/passing"};
  const auto publisher = node.create_publisher<Sample>("data", 10);
  const auto source = node.create_wall_timer(2ms, [&] { publisher->publish(Sample{}); });
  const auto kept = cie::QoS{3}.transient_local();
  const auto writer = node.create_publisher<Sample>("map", kept);
  for (int i = 0; i < 3; ++i)
    writer->publish(Sample{});
  std::atomic<int> maps{0};
  const auto map = node.create_subscription<Sample>("map", kept, [&](const Sample&) { ++maps; });
  cie::CallbackIsolatedExecutor executor;
  executor.add_node(node);
  std::jthread spinning{[&] { executor.spin(); }};
  for (int round = 0; round < 20; ++round) {
    std::atomic<int> received{0};
    std::atomic<int> expired{0};
    std::atomic<int> triggered{0};
    auto passing = std::make_unique<cie::Node>(context, "goes", "/passing");
    executor.add_node(*passing);
    std::atomic<int> matched{0};
    cie::SubscriptionOptions options;
    options.event_callbacks.matched_callback = [&](const auto&) { ++matched; };
    auto subscription = passing->create_subscription<Sample>(
        "data", 10, [&](const Sample&) { ++received; }, options);
    const auto timer = passing->create_wall_timer(3ms, [&] { ++expired; });
    const auto removed = node.create_guard_condition("go", [&] { ++triggered; });
    const auto echo = node.create_publisher<Sample>("echo", 1);
    std::shared_ptr<cie::Timer> once;
    std::atomic<bool> has_ended{false};
    once = node.create_one_shot_timer(1ms, [&] {
      echo->publish(Sample{});
      removed->trigger();
      once.reset();
      has_ended = true;
    });
    while (received == 0 || matched == 0 || expired == 0 || triggered == 0 || !has_ended)
      std::this_thread::sleep_for(1ms);
    subscription.reset();
    node.remove(removed);
    passing.reset();
  }
  while (maps < 3)
    std::this_thread::sleep_for(1ms);
  executor.cancel();
}

}  // namespace

int main() {
  try {
    run();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "passing_app: %s\n", error.what());
  } catch (...) {
    std::fputs("passing_app: unknown exception\n", stderr);
  }
  return 1;
}
