#include "parameter_services.hpp"

#include "dds/context_state.hpp"
#include "dds/names.hpp"
#include "services/service_ends.hpp"

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
  const ServicesQoS qos;
  for (const ParameterService& each : parameter_services()) {
    auto end = make_server_end({.context = context,
                                .graph_node = graph_node,
                                .name = node_ + "/" + std::string{each.name},
                                .qos = qos,
                                .request = *each.request,
                                .response = *each.response},
                               [&store, &each](const void* request, void* response) {
                                 each.answer(store, request, response);
                               });
    end.requests->delivery().set_wakeup(&server_.wakeup());
    auto messages = std::make_unique<MessagePool>(end.requests->layout());
    services_.push_back({std::move(end), std::move(messages)});
  }
  server_.add(*this);
}

ParameterServices::~ParameterServices() {
  server_.remove(*this);
  for (const Service& service : services_)
    service.end.requests->delivery().set_wakeup(nullptr);
}

void ParameterServices::serve() noexcept {
  for (const Service& service : services_) {
    try {
      service.end.replier->send_waiting();
      MessagePool::Loan request{*service.messages};
      MessageInfo info;
      while (service.end.requests->take(request, info))
        service.end.replier->answer(request.get(), info.writer_gid);
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
