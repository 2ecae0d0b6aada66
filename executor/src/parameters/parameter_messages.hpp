// What the parameter services of ROS 2 ask and answer, as messages.
#pragma once

#include <cie/executor/parameters.hpp>

#include "parameter_store.hpp"

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <dds/dds.h>

namespace cie::executor {

// One of the services that a node with parameters has.
struct ParameterService {
  std::string_view name;  // behind the node's
  const dds_topic_descriptor_t* request;
  const dds_topic_descriptor_t* response;
  // Fills in the response, which is zeroed. Never throws for what a request contains.
  void (*answer)(ParameterStore& store, const void* request, void* response);
};
std::span<const ParameterService> parameter_services() noexcept;

// Message of the topic /parameter_events. `message` is zeroed.
const dds_topic_descriptor_t& parameter_event_type() noexcept;
void fill_parameter_event(void* message, std::string_view node, ParameterStore::Change change,
                          const std::vector<Parameter>& parameters);

}  // namespace cie::executor
