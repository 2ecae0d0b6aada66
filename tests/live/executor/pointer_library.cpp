// A component, as far as pointers_test.cpp needs one: it publishes a message that only its own code
// can free.
#include <cie/executor/node.hpp>

#include <memory>

#include <cie_messages.hpp>

extern "C" void publish_from_library(cie::Node& node, int* freed) {
  const auto publisher = node.create_publisher<cie_msgs::Sample>("data", 1);
  auto* const message = new cie_msgs::Sample{};
  message->seq = 42;
  const auto free = [freed](const cie_msgs::Sample* gone) {
    delete gone;
    ++*freed;
  };
  publisher->publish(std::shared_ptr<const cie_msgs::Sample>{message, free});
}
