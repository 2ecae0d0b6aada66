// A timer's callback publishes, a subscription's callback counts; each on a thread of its own.
#include <cie/executor/executor.hpp>
#include <cie/executor/node.hpp>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <utility>

#include <outside_messages.hpp>
#include <unistd.h>

int main() {
  cie::Context context;
  cie::Node node(context, "outside");
  cie::CallbackIsolatedExecutor executor;
  std::atomic<int> received = 0;
  std::atomic<pid_t> publishing{0};
  std::atomic<pid_t> receiving{0};

  const auto publisher = node.create_publisher<outside_msgs::Ping>("ping", cie::QoS(10));
  const auto subscription = node.create_subscription<outside_msgs::Ping>(
      "ping", cie::QoS(10), [&](const outside_msgs::Ping&) {
        receiving = gettid();
        if (++received == 5) executor.cancel();
      });
  const auto timer = node.create_wall_timer(std::chrono::milliseconds(2), [&] {
    publishing = gettid();
    auto ping = cie::make_message<outside_msgs::Ping>();
    cie::set_text(ping->header.frame_id, "outside");
    publisher->publish(std::move(ping));
  });
  executor.add_node(node);
  executor.spin_for(std::chrono::seconds(30));

  std::printf("%d pings from thread %d to thread %d\n", received.load(), publishing.load(),
              receiving.load());
  const bool is_isolated =
      publishing != receiving && publishing != getpid() && receiving != getpid();
  return received >= 5 && is_isolated ? 0 : 1;
}
