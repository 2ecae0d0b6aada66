// A component that greets periodically.
#include <cie/executor/component.hpp>

#include <chrono>
#include <cstdint>
#include <iterator>
#include <memory>
#include <string>

#include <example_messages.hpp>

namespace example {

class Talker final {
 public:
  explicit Talker(const cie::ComponentOptions& options)
      : node_(options),
        publisher_(node_.create_publisher<example_msgs::Greeting>("greetings", 10)),
        message_(cie::make_message<example_msgs::Greeting>()) {
    const std::chrono::milliseconds period{options.parameter<std::int64_t>("period_ms", 100)};
    cie::set_text(message_->text, options.parameter<std::string>("text", "hi"));
    timer_ = node_.create_wall_timer(period, [this] {
      ++message_->seq;
      publisher_->publish(*message_);
    });
    cie::check_member_order(*this, timer_);
  }
  cie::Node& node() { return node_; }

 private:
  cie::Node node_;
  std::shared_ptr<cie::Publisher<example_msgs::Greeting>> publisher_;
  cie::MessagePtr<example_msgs::Greeting> message_;
  std::shared_ptr<cie::Timer> timer_;  // goes before what it uses
};

constexpr cie::ComponentClass kClasses[] = {cie::component_class<Talker>("example::Talker")};
constexpr cie::ComponentLibrary kLibrary{.count = std::size(kClasses), .classes = kClasses};

}  // namespace example

extern "C" const cie::ComponentLibrary* cie_component_library() { return &example::kLibrary; }
