// A component container whose components run isolated: load, unload and list as in any other.
#include <cstdio>
#include <exception>
#include <memory>
#include <stop_token>

#include <cie_rclcpp/callback_isolated_executor.hpp>
#include <rclcpp/executors/single_threaded_executor.hpp>
#include <rclcpp/utilities.hpp>
#include <rclcpp_components/component_manager.hpp>

// The manager's own services run in an executor of rclcpp's, on a worker thread that cie's events name: they
// are none of the components' callbacks.
int main(int argc, char* argv[]) {
  rclcpp::init(argc, argv);
  int status = 0;
  try {
    rclcpp::executors::SingleThreadedExecutor manager;
    const auto components = std::make_shared<cie_rclcpp::CallbackIsolatedExecutor>();
    const auto node = std::make_shared<rclcpp_components::ComponentManager>(components);
    manager.add_node(node);
    const struct ShutdownAtEnd {  // before the worker is joined, whichever way this ends
      ~ShutdownAtEnd() { rclcpp::shutdown(); }
    } shutdown_at_end;
    components->spawn_thread("cie-container", [&manager](const std::stop_token&) {
      manager.spin();
      rclcpp::shutdown();
    });
    components->spin();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cie_component_container: %s\n", error.what());
    status = 4;
  }
  return status;
}
