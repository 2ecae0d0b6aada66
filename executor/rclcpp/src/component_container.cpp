// A component container whose components run isolated: load, unload and list as in any other.
#include <cstdio>
#include <exception>
#include <memory>
#include <thread>

#include <cie_rclcpp/callback_isolated_executor.hpp>
#include <rclcpp/executors/single_threaded_executor.hpp>
#include <rclcpp/utilities.hpp>
#include <rclcpp_components/component_manager.hpp>

// The manager's own services run on the main thread, in an executor of rclcpp's: they create nodes,
// whose threads begin as the main thread was started.
int main(int argc, char* argv[]) {
  rclcpp::init(argc, argv);
  int status = 0;
  try {
    const auto components = std::make_shared<cie_rclcpp::CallbackIsolatedExecutor>();
    rclcpp::executors::SingleThreadedExecutor manager;
    const auto node = std::make_shared<rclcpp_components::ComponentManager>(components);
    manager.add_node(node);
    std::jthread spinning{[&components, &status] {
      try {
        components->spin();
      } catch (const std::exception& error) {
        std::fprintf(stderr, "cie_component_container: %s\n", error.what());
        status = 4;
      }
      rclcpp::shutdown();
    }};
    const struct CancelAtEnd {  // before the thread is joined, whichever way this ends
      cie_rclcpp::CallbackIsolatedExecutor& executor;
      ~CancelAtEnd() { executor.cancel(); }
    } cancel_at_end{*components};
    manager.spin();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cie_component_container: %s\n", error.what());
    status = 4;
  }
  rclcpp::shutdown();
  return status;
}
