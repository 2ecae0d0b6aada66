// A node whose two timers share a callback group, under the isolated executor, for a second.
#include <cie/executor/executor.hpp>

#include <chrono>
#include <cstdio>
#include <exception>
#include <thread>

int main() {
  using namespace std::chrono_literals;
  try {
    const cie::Context context;
    cie::Node node{context, "app", "/grouped"};
    cie::TimerOptions together;
    together.group = node.create_callback_group(cie::GroupType::mutually_exclusive);
    const auto timer = node.create_wall_timer(
        20ms, [] {}, together);
    const auto second_timer = node.create_wall_timer(
        30ms, [] {}, together);
    const auto third_timer = node.create_wall_timer(40ms, [] {});
    cie::CallbackIsolatedExecutor executor;
    executor.add_node(node);
    const std::jthread ender([&executor] {
      std::this_thread::sleep_for(2s);
      executor.cancel();
    });
    executor.spin();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "grouped_app: %s\n", error.what());
    return 1;
  }
}
