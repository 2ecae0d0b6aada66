// Loads two components into the container, lets them run for a second, lists them, unloads one, and lets
// the other run on for half a second. Says "loaded 2, unloaded 1", and exits with 0 if that is so.
#include <chrono>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>

#include <composition_interfaces/srv/list_nodes.hpp>
#include <composition_interfaces/srv/load_node.hpp>
#include <composition_interfaces/srv/unload_node.hpp>
#include <rclcpp/rclcpp.hpp>

namespace {

using namespace std::chrono_literals;
using composition_interfaces::srv::ListNodes;
using composition_interfaces::srv::LoadNode;
using composition_interfaces::srv::UnloadNode;

template <typename Service>
typename Service::Response::SharedPtr call(const rclcpp::Node::SharedPtr& node,
                                           const std::string& name,
                                           const typename Service::Request::SharedPtr& request) {
  const auto client = node->create_client<Service>("/ComponentManager/_container/" + name);
  if (!client->wait_for_service(20s)) throw std::runtime_error{name + ": no such service"};
  auto future = client->async_send_request(request);
  if (rclcpp::spin_until_future_complete(node, future, 20s) != rclcpp::FutureReturnCode::SUCCESS) {
    throw std::runtime_error{name + ": no answer"};
  }
  return future.get();
}

std::uint64_t load(const rclcpp::Node::SharedPtr& node, const std::string& name) {
  const auto request = std::make_shared<LoadNode::Request>();
  request->package_name = "test_components";
  request->plugin_name = "test_components::Echo";
  request->node_name = name;
  const auto answer = call<LoadNode>(node, "load_node", request);
  if (!answer->success) throw std::runtime_error{answer->error_message};
  return answer->unique_id;
}

}  // namespace

int main(int argc, char* argv[]) {
  rclcpp::init(argc, argv);
  try {
    const auto node = std::make_shared<rclcpp::Node>("loader");
    const std::uint64_t first = load(node, "first");
    load(node, "second");
    std::this_thread::sleep_for(1s);
    const auto before = call<ListNodes>(node, "list_nodes", std::make_shared<ListNodes::Request>());
    const auto unload = std::make_shared<UnloadNode::Request>();
    unload->unique_id = first;
    if (!call<UnloadNode>(node, "unload_node", unload)->success) throw std::runtime_error{"unload"};
    const auto after = call<ListNodes>(node, "list_nodes", std::make_shared<ListNodes::Request>());
    std::this_thread::sleep_for(500ms);
    std::printf("loaded %zu, unloaded %zu\n", before->unique_ids.size(),
                before->unique_ids.size() - after->unique_ids.size());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  rclcpp::shutdown();
  return 0;
}
