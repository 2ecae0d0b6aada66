#include "endpoint_events.hpp"

namespace cie {
namespace executor {
namespace {

using Told = std::function<void()> EndpointEvents::*;

template <Told kTold, typename Status>
void tell(dds_entity_t, const Status, void* events) noexcept {
  (static_cast<const EndpointEvents*>(events)->*kTold)();
}

template <typename Status>
void tell_incompatible(dds_entity_t, const Status status, void* events) noexcept {
  static_cast<const EndpointEvents*>(events)->incompatible_qos(policy_kind(status.last_policy_id));
}

ListenerPtr new_listener(const EndpointEvents& events) {
  return ListenerPtr{dds_create_listener(const_cast<EndpointEvents*>(&events))};
}

}  // namespace

ListenerPtr reader_listener(const EndpointEvents& events) {
  using Events = EndpointEvents;
  auto listener = new_listener(events);
  if (events.deadline_missed) {
    dds_lset_requested_deadline_missed(
        listener.get(), tell<&Events::deadline_missed, dds_requested_deadline_missed_status_t>);
  }
  if (events.liveliness) {
    dds_lset_liveliness_changed(listener.get(),
                                tell<&Events::liveliness, dds_liveliness_changed_status_t>);
  }
  if (events.matched) {
    dds_lset_subscription_matched(listener.get(),
                                  tell<&Events::matched, dds_subscription_matched_status_t>);
  }
  if (events.incompatible_qos) {
    dds_lset_requested_incompatible_qos(listener.get(),
                                        tell_incompatible<dds_requested_incompatible_qos_status_t>);
  }
  return listener;
}

ListenerPtr writer_listener(const EndpointEvents& events) {
  using Events = EndpointEvents;
  auto listener = new_listener(events);
  if (events.deadline_missed) {
    dds_lset_offered_deadline_missed(
        listener.get(), tell<&Events::deadline_missed, dds_offered_deadline_missed_status_t>);
  }
  if (events.liveliness) {
    dds_lset_liveliness_lost(listener.get(),
                             tell<&Events::liveliness, dds_liveliness_lost_status_t>);
  }
  if (events.matched) {
    dds_lset_publication_matched(listener.get(),
                                 tell<&Events::matched, dds_publication_matched_status_t>);
  }
  if (events.incompatible_qos) {
    dds_lset_offered_incompatible_qos(listener.get(),
                                      tell_incompatible<dds_offered_incompatible_qos_status_t>);
  }
  return listener;
}

QosPolicyKind policy_kind(std::uint32_t dds_policy_id) noexcept {
  switch (dds_policy_id) {
    case DDS_DURABILITY_QOS_POLICY_ID:
      return QosPolicyKind::durability;
    case DDS_DEADLINE_QOS_POLICY_ID:
      return QosPolicyKind::deadline;
    case DDS_LIVELINESS_QOS_POLICY_ID:
      return QosPolicyKind::liveliness;
    case DDS_RELIABILITY_QOS_POLICY_ID:
      return QosPolicyKind::reliability;
    case DDS_DATA_REPRESENTATION_QOS_POLICY_ID:
      return QosPolicyKind::data_representation;
    default:
      return QosPolicyKind::other;
  }
}

}  // namespace executor

std::string_view label(QosPolicyKind kind) noexcept {
  switch (kind) {
    case QosPolicyKind::durability:
      return "durability";
    case QosPolicyKind::deadline:
      return "deadline";
    case QosPolicyKind::liveliness:
      return "liveliness";
    case QosPolicyKind::reliability:
      return "reliability";
    case QosPolicyKind::data_representation:
      return "data representation";
    case QosPolicyKind::other:
      break;
  }
  return "another policy";
}

}  // namespace cie
