// What a node with parameters offers to the network.
#pragma once

#include <cie/scheduling/background_server.hpp>

#include "dds/graph.hpp"
#include "dds/message_pool.hpp"
#include "dds/writer.hpp"
#include "parameter_messages.hpp"
#include "scheduling_names.hpp"
#include "services/service_ends.hpp"

#include <memory>
#include <string>
#include <vector>

namespace cie::executor {

class ContextState;

// The six services and the publisher of /parameter_events, from construction on.
class ParameterServices final : public BackgroundServer::Endpoint {
 public:
  // Throws dds::Error, std::system_error.
  ParameterServices(const std::shared_ptr<ContextState>& context, std::string node, NodeId node_id,
                    const Graph::Member& graph_node, ParameterStore& store);
  // Waits for the answer that is being given.
  ~ParameterServices() override;

  void serve() noexcept override;
  void tell(ParameterStore::Change change, const std::vector<Parameter>& parameters);

 private:
  struct Service {
    ServerEnd end;
    std::unique_ptr<MessagePool> messages;
  };

  std::string node_;
  BackgroundServer& server_;
  std::vector<Service> services_;
  Writer events_;
};

}  // namespace cie::executor
