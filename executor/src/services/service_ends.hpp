// The two ends of a service, each a reader and a writer that know each other.
#pragma once

#include <cie/executor/qos.hpp>
#include <cie/executor/service.hpp>
#include <cie/tracepoints/schema.hpp>

#include "dds/graph.hpp"
#include "dds/reader.hpp"
#include "dds/writer.hpp"
#include "replier.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <dds/dds.h>

namespace cie::executor {

class ContextState;

// Of which service, and whose an end of it is. Used while the end is made.
struct ServicePlan {
  const std::shared_ptr<ContextState>& context;
  const Graph::Member& graph_node;
  std::optional<NodeId> node{};  // empty: its messages are not traced
  std::string name;              // absolute
  const QoS& qos;
  const dds_topic_descriptor& request;
  const dds_topic_descriptor& response;
};

struct ServerEnd {
  std::unique_ptr<Reader> requests;
  std::unique_ptr<Replier> replier;
};

struct ClientEnd {
  std::unique_ptr<Writer> requests;
  std::unique_ptr<Reader> responses;
  std::uint64_t guid = 0;  // in the header of each request
};

// Throw dds::Error, std::system_error, std::logic_error (QoS).
ServerEnd make_server_end(const ServicePlan& plan, ErasedServiceFunction function);
ClientEnd make_client_end(const ServicePlan& plan);

}  // namespace cie::executor
