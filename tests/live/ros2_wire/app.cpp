// An application of ours, for wire_test.py, which tells it line by line what to make and do. With
// the argument "serialized" Cyclone serialises every message.
//
//   node NAME NAMESPACE   publisher|subscription|service|client NAME   drop WHAT
//   offering|asking NAME (a publisher, a subscription with deadline and lease)
//   parameter NAME INTEGER   say TEXT   shout TEXT (by pointer)   call A B
#include <cie/executor/executor.hpp>
#include <cie/executor/node.hpp>

#include <chrono>
#include <cstdint>
#include <iostream>
#include <memory>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>
#include <utility>

#include <cie_ros_messages.hpp>
#include <example_interfaces.hpp>

namespace {

using Request = example_interfaces::srv::AddTwoInts_Request;
using Response = example_interfaces::srv::AddTwoInts_Response;
using String = std_msgs::msg::String;

void print(const std::string& line) {
  static std::mutex mutex;
  const std::lock_guard lock{mutex};
  std::cout << line << std::endl;
}

cie::Context::Options warning_options(bool pass_pointers) {
  auto options = cie::Context::Options::from_environment();
  options.pass_pointers = pass_pointers;
  options.on_warning = [](const std::string& text) { print("warning " + text); };
  return options;
}

class App {
 public:
  explicit App(bool pass_pointers) : context_{warning_options(pass_pointers)} {}
  void obey(const std::string& line) {
    std::istringstream words{line};
    std::string verb;
    std::string first;
    std::string second;
    words >> verb >> first >> second;
    if (verb == "node") {
      node_ = std::make_unique<cie::Node>(context_, first, second);
      executor_.add_node(*node_);
    } else if (verb == "publisher") {
      publisher_ = node_->create_publisher<String>(first, 10);
    } else if (verb == "latched") {
      latched_ = node_->create_publisher<std_msgs::msg::Header>(
          first, cie::QoS{cie::KeepLast{3}}.transient_local().best_effort());
    } else if (verb == "subscription") {
      subscription_ = node_->create_subscription<String>(
          first, 10, [](const String& message) { print("heard " + std::string{message.data}); });
    } else if (verb == "offering") {
      publisher_ = node_->create_publisher<String>(first, demanding());
    } else if (verb == "asking") {
      subscription_ = node_->create_subscription<String>(
          first, demanding(),
          [](const String& message) { print("heard " + std::string{message.data}); }, telling());
    } else if (verb == "service") {
      service_ = node_->create_service<Request, Response>(
          first,
          [](const Request& request, Response& response) { response.sum = request.a + request.b; });
    } else if (verb == "client") {
      client_ = node_->create_client<Request, Response>(first);
    } else if (verb == "parameter") {
      node_->declare_parameter<std::int64_t>(first, std::stoll(second));
    } else if (verb == "say" || verb == "shout") {
      say(first, verb == "shout");
    } else if (verb == "call") {
      Request request{};
      request.a = std::stoll(first);
      request.b = std::stoll(second);
      client_->wait_for_service(std::chrono::seconds{20});
      client_->async_send_request(request, [](const std::shared_ptr<const Response>& response) {
        print("sum " + std::to_string(response->sum));
      });
    } else if (verb == "drop") {
      if (first == "publisher") publisher_.reset();
      if (first == "node") node_.reset();
    }
    print("done " + line);
  }
  void spin() { executor_.spin(); }
  void end() { executor_.cancel(); }

 private:
  static cie::QoS demanding() {
    return cie::QoS{10}
        .deadline(std::chrono::milliseconds{250})
        .lifespan(std::chrono::seconds{4})
        .liveliness(cie::Liveliness::manual_by_topic)
        .liveliness_lease_duration(std::chrono::milliseconds{1500});
  }
  // Every event is a line, with what it changed.
  static cie::SubscriptionOptions telling() {
    cie::SubscriptionOptions options;
    auto& events = options.event_callbacks;
    const auto counts = [](const auto& info) {
      return std::to_string(info.total_count_change) + " of " + std::to_string(info.total_count);
    };
    events.deadline_callback = [counts](const auto& info) { print("missed " + counts(info)); };
    events.matched_callback = [counts](const auto& info) {
      print("matched " + counts(info) + ", now " + std::to_string(info.current_count));
    };
    events.message_lost_callback = [counts](const auto& info) { print("lost " + counts(info)); };
    events.incompatible_qos_callback = [counts](const auto& info) {
      print("incompatible " + std::string{label(info.last_policy_kind)} + " " + counts(info));
    };
    events.liveliness_callback = [](const auto& info) {
      print("alive " + std::to_string(info.alive_count) + ", not " +
            std::to_string(info.not_alive_count));
    };
    return options;
  }

  void say(const std::string& text, bool by_pointer) {
    while (publisher_->subscription_count() == 0)
      std::this_thread::sleep_for(std::chrono::milliseconds{1});
    auto message = cie::make_message<String>();
    cie::set_text(message->data, text);
    if (by_pointer) {
      publisher_->publish(std::move(message));
    } else {
      publisher_->publish(*message);
    }
  }

  cie::Context context_;
  cie::CallbackIsolatedExecutor executor_;
  std::unique_ptr<cie::Node> node_;
  std::shared_ptr<cie::Publisher<String>> publisher_;
  std::shared_ptr<cie::Publisher<std_msgs::msg::Header>> latched_;
  std::shared_ptr<cie::Subscription<String>> subscription_;
  std::shared_ptr<cie::Service<Request, Response>> service_;
  std::shared_ptr<cie::Client<Request, Response>> client_;
};

}  // namespace

int main(int argc, char** argv) {
  App app{argc != 2 || std::string{argv[1]} != "serialized"};
  std::thread spinning{[&app] { app.spin(); }};
  for (std::string line; std::getline(std::cin, line);)
    app.obey(line);
  app.end();
  spinning.join();
}
