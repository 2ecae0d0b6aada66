// A component that greets periodically.
#include <cie/executor/component.hpp>

#include <chrono>
#include <cstdint>
#include <iterator>
#include <memory>
#include <string>

#include <cie_messages.hpp>

namespace example {

class Talker {
 public:
  explicit Talker(const cie::ComponentOptions& options)
      : node_(options),
        publisher_(node_.create_publisher<cie_msgs::Sample>("greetings", 10)),
        message_(cie::make_message<cie_msgs::Sample>()) {
    const std::chrono::milliseconds period{options.parameter<std::int64_t>("period_ms", 100)};
    cie::set_text(message_->frame_id, options.parameter<std::string>("text", "hi"));
    timer_ = node_.create_wall_timer(period, [this] {
      ++message_->seq;
      publisher_->publish(*message_);
    });
  }
  cie::Node& node() { return node_; }

 private:
  cie::Node node_;
  std::shared_ptr<cie::Publisher<cie_msgs::Sample>> publisher_;
  cie::MessagePtr<cie_msgs::Sample> message_;
  std::shared_ptr<cie::Timer> timer_;  // goes before what it uses
};

constexpr cie::ComponentClass kClasses[] = {cie::component_class<Talker>("example::Talker")};
constexpr cie::ComponentLibrary kLibrary{.count = std::size(kClasses), .classes = kClasses};

}  // namespace example

extern "C" const cie::ComponentLibrary* cie_component_library() { return &example::kLibrary; }
