#include "parameter_services.hpp"

#include "dds/context_state.hpp"
#include "dds/names.hpp"
#include "services/service_endpoint.hpp"
#include "services/service_type.hpp"

#include <exception>
#include <utility>

namespace cie::executor {
namespace {

constexpr std::uint32_t kEventDepth = 1000;  // as in ROS 2

}  // namespace

ParameterServices::ParameterServices(const std::shared_ptr<ContextState>& context, std::string node,
                                     NodeId node_id, const Graph::Member& graph_node,
                                     ParameterStore& store)
    : node_(std::move(node)),
      server_(context->parameter_server()),
      events_(context, node_id, message_topic("/parameter_events"), QoS{KeepLast{kEventDepth}},
              parameter_event_type()) {
  events_.announce(graph_node);
  for (const ParameterService& each : parameter_services()) {
    const std::string name = node_ + "/" + std::string{each.name};
    const std::string identity = EndpointId{}.user_data("serviceid");
    Service service;
    // The writer first: a client that sees the reader can be answered.
    service.replier = std::make_unique<Replier>(
        std::make_unique<Writer>(context, std::nullopt, reply_topic(name), ServicesQoS{},
                                 ServiceType{*each.response}.descriptor(), identity),
        [&store, &each](const void* request, void* response) {
          each.answer(store, request, response);
        });
    service.requests = std::make_unique<Reader>(context, request_topic(name), ServicesQoS{},
                                                ServiceType{*each.request}.descriptor(), identity);
    service.messages = std::make_unique<MessagePool>(service.requests->layout());
    service.replier->listen_at(service.requests->entity());
    service.replier->announce(graph_node);
    service.requests->announce(graph_node);
    service.requests->delivery().set_wakeup(&server_.wakeup());
    services_.push_back(std::move(service));
  }
  server_.add(*this);
}

ParameterServices::~ParameterServices() {
  server_.remove(*this);
  for (const Service& service : services_)
    service.requests->delivery().set_wakeup(nullptr);
}

void ParameterServices::serve() noexcept {
  for (const Service& service : services_) {
    try {
      MessagePool::Loan request{*service.messages};
      MessageInfo info;
      while (service.requests->take(request, info))
        service.replier->answer(request.get(), info.writer_gid);
    } catch (const std::exception&) {
      // DDS or memory failed for this one request: whoever asked waits, as for a message lost.
    }
  }
}

void ParameterServices::tell(ParameterStore::Change change,
                             const std::vector<Parameter>& parameters) {
  MessagePool messages{events_.layout()};
  MessagePool::Loan event{messages};
  fill_parameter_event(event.memory(), node_, change, parameters);
  events_.publish(event.get());
}

}  // namespace cie::executor
