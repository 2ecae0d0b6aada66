#include "service_ends.hpp"

#include "dds/names.hpp"
#include "service_endpoint.hpp"
#include "service_type.hpp"

#include <utility>

namespace cie::executor {
namespace {

std::unique_ptr<Writer> make_writer(const ServicePlan& plan, const TopicName& topic,
                                    const dds_topic_descriptor& type, const std::string& identity,
                                    std::shared_ptr<const EndpointEvents> events = {}) {
  return std::make_unique<Writer>(plan.context, plan.node, topic, plan.qos,
                                  ServiceType{type}.descriptor(), identity, std::move(events));
}

std::unique_ptr<Reader> make_reader(const ServicePlan& plan, const TopicName& topic,
                                    const dds_topic_descriptor& type, const std::string& identity,
                                    std::optional<Reader::Reply> reply = {}) {
  return std::make_unique<Reader>(plan.context, topic, plan.qos, ServiceType{type}.descriptor(),
                                  identity, reply);
}

}  // namespace

// The writer first: a client that sees the reader can be answered.
ServerEnd make_server_end(const ServicePlan& plan, ErasedServiceFunction function) {
  const std::string identity = EndpointId{}.user_data("serviceid");
  auto clients = std::make_shared<ServiceClients>();
  EndpointEvents events;
  events.matched = [clients] { clients->readers_changed(); };
  auto responses = make_writer(plan, reply_topic(plan.name), plan.response, identity,
                               std::make_shared<const EndpointEvents>(std::move(events)));
  auto requests = make_reader(plan, request_topic(plan.name), plan.request, identity);
  responses->announce(plan.graph_node);
  requests->announce(plan.graph_node);
  // The replier goes before the reader, and with it who uses these.
  clients->begin([reader = requests->entity(),
                  writer = responses->entity()] { return clients_of(reader, writer); },
                 [&requests = requests->delivery()] { requests.wake(); });
  auto replier = std::make_unique<Replier>(std::move(responses), std::move(clients),
                                           plan.qos.depth(), std::move(function));
  return {.requests = std::move(requests), .replier = std::move(replier)};
}

// The reader first: a service that sees the writer can answer.
ClientEnd make_client_end(const ServicePlan& plan) {
  const EndpointId id;
  const std::string identity = id.user_data("clientid");
  auto responses = make_reader(plan, reply_topic(plan.name), plan.response, identity,
                               Reader::Reply{.recipient = id.guid()});
  auto requests = make_writer(plan, request_topic(plan.name), plan.request, identity);
  responses->announce(plan.graph_node);
  requests->announce(plan.graph_node);
  return {.requests = std::move(requests), .responses = std::move(responses), .guid = id.guid()};
}

}  // namespace cie::executor
