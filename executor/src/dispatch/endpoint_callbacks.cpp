#include "endpoint_callbacks.hpp"

#include <cie/tracepoints/logical_id.hpp>
#include <cie/tracepoints/priority_mutex.hpp>

#include "dds/names.hpp"
#include "guard_condition_callback.hpp"
#include "node_state.hpp"

#include <cstdint>
#include <mutex>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace cie::executor {
namespace {

std::int32_t difference(std::uint32_t now, std::uint32_t before) noexcept {
  return static_cast<std::int32_t>(now - before);
}

template <typename Info, typename Status>
Info counts_since(const Status& before, const Status& now) noexcept {
  return {.total_count = now.total_count,
          .total_count_change = difference(now.total_count, before.total_count)};
}

template <typename Status>
IncompatibleQosInfo incompatible_since(const Status& before, const Status& now) noexcept {
  return {.total_count = now.total_count,
          .total_count_change = difference(now.total_count, before.total_count),
          .last_policy_kind = policy_kind(now.last_policy_id)};
}

template <typename Status>
MatchedInfo matches_since(const Status& before, const Status& now) noexcept {
  return {.total_count = now.total_count,
          .total_count_change = difference(now.total_count, before.total_count),
          .current_count = now.current_count,
          .current_count_change = difference(now.current_count, before.current_count)};
}

LivelinessChangedInfo liveliness_since(const dds_liveliness_changed_status_t& before,
                                       const dds_liveliness_changed_status_t& now) noexcept {
  return {.alive_count = now.alive_count,
          .not_alive_count = now.not_alive_count,
          .alive_count_change = difference(now.alive_count, before.alive_count),
          .not_alive_count_change = difference(now.not_alive_count, before.not_alive_count)};
}

MessageLostInfo lost_since(const std::uint64_t& before, const std::uint64_t& now) noexcept {
  return {.total_count = now, .total_count_change = now - before};
}

// Tells `handler` what changed since it was told last. Changes follow from the totals alone, so
// that none is lost to whoever else reads the status of DDS, which counts them only from then on.
template <typename Status, typename Info, typename Read>
std::function<void()> telling(Read read, Info (*since)(const Status& before, const Status& now),
                              std::function<void(const Info&)> handler) {
  struct LastTold {
    PriorityMutex mutex;  // instances of a reentrant group may overlap
    Status status{};
  };
  return [read = std::move(read), since, handler = std::move(handler),
          told = std::make_shared<LastTold>()] {
    Info info;
    {
      const std::lock_guard lock{told->mutex};
      Status now{};
      if (!read(now)) return;  // the endpoint goes
      info = since(std::exchange(told->status, now), now);
    }
    handler(info);
  };
}

class Builder {
 public:
  Builder(NodeState& node, std::string topic, const std::string& name,
          const std::shared_ptr<CallbackGroup>& group)
      : node_(node), topic_(std::move(topic)), name_(name.empty() ? topic_ : name), group_(group) {}

  // What releases the callback of `handler`; empty without one.
  template <typename Status, typename Info>
  std::function<void()> add(std::string_view kind, dds_return_t (*read)(dds_entity_t, Status*),
                            Info (*since)(const Status&, const Status&),
                            const std::function<void(const Info&)>& handler) {
    return add<Status>(
        kind,
        [read, entity = entity_](Status& now) { return read(*entity, &now) == DDS_RETCODE_OK; },
        since, handler);
  }
  template <typename Status, typename Read, typename Info>
  std::function<void()> add(std::string_view kind, Read read,
                            Info (*since)(const Status&, const Status&),
                            const std::function<void(const Info&)>& handler) {
    if (!handler) return {};
    auto group = node_.group_or_new(group_);
    trace::CallbackInfo info;
    info.group = group->id();
    info.node = node_.id();
    info.kind = CallbackKind::waitable;
    info.logical_id = trace::unique_logical_id(logical_id(node_.name(), kind, name_));
    info.source = topic_;
    info.symbol = demangled(handler.target_type());
    auto callback = std::make_shared<GuardConditionCallback>(
        std::move(group), std::move(info), telling<Status, Info>(std::move(read), since, handler));
    callbacks_.push_back(callback);
    return [callback] { callback->trigger(); };
  }

  // Without a handler the Context tells it.
  std::function<void(QosPolicyKind)> incompatible_qos(std::function<void()> trigger,
                                                      std::string_view endpoint,
                                                      std::string_view what,
                                                      std::string_view consequence) const {
    if (trigger) return [trigger = std::move(trigger)](QosPolicyKind) { trigger(); };
    return
        [warnings = node_.context()->warnings(),
         begin = fmt::format("{} of \"{}\" in node {}: {} (", endpoint, topic_, node_.name(), what),
         end = fmt::format("): {}", consequence)](QosPolicyKind kind) {
          warnings->tell(fmt::format("{}{}{}", begin, label(kind), end));
        };
  }

  EndpointCallbacks built(EndpointEvents events) {
    return {.callbacks = std::move(callbacks_),
            .events = std::make_shared<const EndpointEvents>(std::move(events)),
            .entity = entity_};
  }

 private:
  NodeState& node_;
  std::string topic_;
  std::string name_;
  std::shared_ptr<CallbackGroup> group_;
  std::shared_ptr<std::atomic<dds_entity_t>> entity_ =
      std::make_shared<std::atomic<dds_entity_t>>(0);
  std::vector<std::shared_ptr<Callback>> callbacks_;
};

// DDS says in its listener alone how many, and nothing of those that our readers refuse.
std::function<void(std::uint32_t)> lost_messages(Builder& builder,
                                                 const SubscriptionEventCallbacks& given) {
  auto total = std::make_shared<std::atomic<std::uint64_t>>(0);
  auto trigger = builder.add<std::uint64_t>(
      "MessageLost",
      [total](std::uint64_t& now) {
        now = *total;
        return true;
      },
      lost_since, given.message_lost_callback);
  if (!trigger) return {};
  return [total, trigger = std::move(trigger)](std::uint32_t count) {
    *total += count;
    trigger();
  };
}

}  // namespace

// The ids name events as DDS names statuses, which tells a publisher's from a subscription's.
EndpointCallbacks endpoint_callbacks(NodeState& node, const std::string& topic,
                                     const std::string& name,
                                     const SubscriptionEventCallbacks& given) {
  Builder builder{node, topic, name, given.group};
  EndpointEvents events;
  events.deadline_missed =
      builder.add("RequestedDeadlineMissed", dds_get_requested_deadline_missed_status,
                  counts_since<DeadlineMissedInfo, dds_requested_deadline_missed_status_t>,
                  given.deadline_callback);
  events.liveliness = builder.add("LivelinessChanged", dds_get_liveliness_changed_status,
                                  liveliness_since, given.liveliness_callback);
  events.matched =
      builder.add("SubscriptionMatched", dds_get_subscription_matched_status,
                  matches_since<dds_subscription_matched_status_t>, given.matched_callback);
  events.incompatible_qos = builder.incompatible_qos(
      builder.add("RequestedIncompatibleQos", dds_get_requested_incompatible_qos_status,
                  incompatible_since<dds_requested_incompatible_qos_status_t>,
                  given.incompatible_qos_callback),
      "subscription", "a publisher offers less than its QoS asks for", "no messages of it come");
  events.message_lost = lost_messages(builder, given);
  return builder.built(std::move(events));
}

EndpointCallbacks endpoint_callbacks(NodeState& node, const std::string& topic,
                                     const PublisherEventCallbacks& given) {
  Builder builder{node, topic, {}, given.group};
  EndpointEvents events;
  events.deadline_missed =
      builder.add("OfferedDeadlineMissed", dds_get_offered_deadline_missed_status,
                  counts_since<DeadlineMissedInfo, dds_offered_deadline_missed_status_t>,
                  given.deadline_callback);
  events.liveliness = builder.add("LivelinessLost", dds_get_liveliness_lost_status,
                                  counts_since<LivelinessLostInfo, dds_liveliness_lost_status_t>,
                                  given.liveliness_callback);
  events.matched =
      builder.add("PublicationMatched", dds_get_publication_matched_status,
                  matches_since<dds_publication_matched_status_t>, given.matched_callback);
  events.incompatible_qos = builder.incompatible_qos(
      builder.add("OfferedIncompatibleQos", dds_get_offered_incompatible_qos_status,
                  incompatible_since<dds_offered_incompatible_qos_status_t>,
                  given.incompatible_qos_callback),
      "publisher", "a subscription asks for more than its QoS offers", "no messages go to it");
  return builder.built(std::move(events));
}

}  // namespace cie::executor
