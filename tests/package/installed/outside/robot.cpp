// A timer's callback publishes, a subscription's callback counts, a service answers; each on a thread
// of its own.
#include <cie/executor/executor.hpp>
#include <cie/executor/node.hpp>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <future>
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

  using outside_msgs::Double_Request;
  using outside_msgs::Double_Response;
  const auto service = node.create_service<Double_Request, Double_Response>(
      "double", [](const Double_Request& request, Double_Response& response) {
        response.doubled = 2 * request.number;
      });
  const auto client = node.create_client<Double_Request, Double_Response>("double");
  auto doubled = client->async_send_request({.number = 21});
  const auto is_answered = [&doubled] {
    return doubled.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  };

  const auto publisher = node.create_publisher<outside_msgs::Ping>("ping", cie::QoS(10));
  const auto subscription = node.create_subscription<outside_msgs::Ping>(
      "ping", cie::QoS(10), [&](const outside_msgs::Ping&) {
        receiving = gettid();
        if (++received >= 5 && is_answered()) executor.cancel();
      });
  const auto timer = node.create_wall_timer(std::chrono::milliseconds(2), [&] {
    publishing = gettid();
    auto ping = cie::make_message<outside_msgs::Ping>();
    cie::set_text(ping->header.frame_id, "outside");
    publisher->publish(std::move(ping));
  });
  executor.add_node(node);
  executor.spin_for(std::chrono::seconds(30));

  const bool is_isolated =
      publishing != receiving && publishing != getpid() && receiving != getpid();
  const bool is_doubled = is_answered() && doubled.get()->doubled == 42;
  std::printf("%d pings from thread %d to thread %d, %s\n", received.load(), publishing.load(),
              receiving.load(), is_doubled ? "answered" : "not answered");
  return received >= 5 && is_isolated && is_doubled ? 0 : 1;
}
