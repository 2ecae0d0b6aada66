// A component that hears greetings, and says how many at its end.
#include <cie/executor/component.hpp>

#include <cstdint>
#include <cstdio>
#include <iterator>
#include <memory>

#include <example_messages.hpp>

namespace example {

class Listener {
 public:
  explicit Listener(const cie::ComponentOptions& options) : node_(options) {
    subscription_ = node_.create_subscription<example_msgs::Greeting>(
        "greetings", 10, [this](const example_msgs::Greeting& message) {
          if (heard_ > 0 && message.seq != last_ + 1) ++gaps_;
          last_ = message.seq;
          ++heard_;
        });
  }
  ~Listener() {
    std::printf("%s: heard %lu greetings with %lu gaps\n", node_.fully_qualified_name().c_str(),
                static_cast<unsigned long>(heard_), static_cast<unsigned long>(gaps_));
    std::fflush(stdout);
  }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  cie::Node& node() { return node_; }

 private:
  // Of the subscription's callback alone; the container destroys when that no longer runs.
  std::uint64_t heard_ = 0;
  std::uint64_t gaps_ = 0;
  std::uint64_t last_ = 0;
  cie::Node node_;
  std::shared_ptr<cie::Subscription<example_msgs::Greeting>> subscription_;
};

constexpr cie::ComponentClass kClasses[] = {cie::component_class<Listener>("example::Listener")};
constexpr cie::ComponentLibrary kLibrary{.count = std::size(kClasses), .classes = kClasses};

}  // namespace example

extern "C" const cie::ComponentLibrary* cie_component_library() { return &example::kLibrary; }
