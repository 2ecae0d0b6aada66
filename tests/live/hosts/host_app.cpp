// One machine's part of an application that spans two: host_app robot|desk [READY].
//
// The robot's timer publishes /ping, the desk answers each with /pong. READY is created once the
// robot has had twenty answers, or the desk twenty questions. Until SIGTERM.
#include <cie/executor/executor.hpp>
#include <cie/executor/node.hpp>

#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <fstream>
#include <memory>
#include <string>

#include <cie_messages.hpp>

namespace {

using cie_msgs::Sample;

constexpr std::uint64_t kEnough = 20;

cie::Executor* running = nullptr;

struct Counter {
  std::string ready;
  std::uint64_t count = 0;

  void add() {
    if (++count == kEnough && !ready.empty()) std::ofstream(ready) << "ready\n";
  }
};

void run(const std::string& role, Counter& counter) {
  const cie::Context context;  // DDS finds the other machine by itself
  cie::Node node{context, role};
  const bool is_robot = role == "robot";
  const auto out = node.create_publisher<Sample>(is_robot ? "/ping" : "/pong", 10);
  std::uint64_t seq = 0;
  const auto send = [&out, &seq] {
    Sample message{};
    message.seq = seq++;
    out->publish(message);
  };
  const auto in = node.create_subscription<Sample>(is_robot ? "/pong" : "/ping", 10,
                                                   [&](const Sample& /*message*/) {
                                                     counter.add();
                                                     if (!is_robot) send();
                                                   });
  const auto timer =
      is_robot ? node.create_wall_timer(std::chrono::milliseconds{10}, send) : nullptr;
  cie::CallbackIsolatedExecutor executor;
  executor.add_node(node);
  running = &executor;
  std::signal(SIGTERM, [](int) { running->cancel(); });
  executor.spin();
  std::signal(SIGTERM, SIG_IGN);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    Counter counter{.ready = argc > 2 ? argv[2] : ""};
    run(argc > 1 ? argv[1] : "", counter);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "host_app: %s\n", error.what());
    return 1;
  }
}
