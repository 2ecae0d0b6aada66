#include "deadline_watch.hpp"

#include "error.hpp"

#include <array>
#include <utility>

#include <lttng/lttng.h>

namespace cie::record {
namespace {

constexpr const char* kEvent = "cie:deadline_miss";
// What a notification carries, in this order.
constexpr std::array<const char*, 3> kFields{"callback_id", "response_ns", "deadline_ns"};

struct DestroyRule {
  void operator()(lttng_event_rule* rule) const noexcept { lttng_event_rule_destroy(rule); }
};
struct DestroyAction {
  void operator()(lttng_action* action) const noexcept { lttng_action_destroy(action); }
};
struct DestroyNotification {
  void operator()(lttng_notification* notification) const noexcept {
    lttng_notification_destroy(notification);
  }
};

void check(bool is_done, const char* operation) {
  if (!is_done) {
    throw RecordError(std::string("cannot watch for missed deadlines: LTTng refuses to ") +
                      operation);
  }
}

lttng_condition* make_condition() {
  const std::unique_ptr<lttng_event_rule, DestroyRule> rule(
      lttng_event_rule_user_tracepoint_create());
  check(rule && lttng_event_rule_user_tracepoint_set_name_pattern(rule.get(), kEvent) ==
                    LTTNG_EVENT_RULE_STATUS_OK,
        "make a rule for the event");
  lttng_condition* const condition = lttng_condition_event_rule_matches_create(rule.get());
  check(condition != nullptr, "make a condition");
  return condition;
}

std::uint64_t captured(const lttng_event_field_value* values, unsigned int index) {
  const lttng_event_field_value* value = nullptr;
  if (lttng_event_field_value_array_get_element_at_index(values, index, &value) !=
      LTTNG_EVENT_FIELD_VALUE_STATUS_OK) {
    return 0;
  }
  std::uint64_t number = 0;
  std::int64_t with_sign = 0;
  if (lttng_event_field_value_unsigned_int_get_value(value, &number) ==
      LTTNG_EVENT_FIELD_VALUE_STATUS_OK) {
    return number;
  }
  lttng_event_field_value_signed_int_get_value(value, &with_sign);
  return static_cast<std::uint64_t>(with_sign);
}

DeadlineMiss miss_of(lttng_notification& notification) {
  const lttng_event_field_value* values = nullptr;
  const lttng_evaluation* const evaluation = lttng_notification_get_evaluation(&notification);
  if (lttng_evaluation_event_rule_matches_get_captured_values(evaluation, &values) !=
      LTTNG_EVALUATION_EVENT_RULE_MATCHES_STATUS_OK) {
    return {};
  }
  return {.callback_id = captured(values, 0),
          .response_ns = captured(values, 1),
          .deadline_ns = captured(values, 2)};
}

}  // namespace

void DeadlineWatch::Destroy::operator()(lttng_condition* condition) const noexcept {
  lttng_condition_destroy(condition);
}
void DeadlineWatch::Destroy::operator()(lttng_notification_channel* channel) const noexcept {
  lttng_notification_channel_destroy(channel);
}
void DeadlineWatch::Destroy::operator()(lttng_trigger* trigger) const noexcept {
  lttng_trigger_destroy(trigger);
}

DeadlineWatch::DeadlineWatch(const std::string& name) : condition_(make_condition()) {
  for (const char* field : kFields) {
    lttng_event_expr* const expression = lttng_event_expr_event_payload_field_create(field);
    check(expression != nullptr && lttng_condition_event_rule_matches_append_capture_descriptor(
                                       condition_.get(), expression) == LTTNG_CONDITION_STATUS_OK,
          "capture its fields");
  }
  const std::unique_ptr<lttng_action, DestroyAction> action(lttng_action_notify_create());
  check(action != nullptr, "make an action");
  trigger_.reset(lttng_trigger_create(condition_.get(), action.get()));
  check(trigger_ != nullptr, "make a trigger");
  channel_.reset(lttng_notification_channel_create(lttng_session_daemon_notification_endpoint));
  check(channel_ != nullptr, "open a channel for notifications");
  check(lttng_notification_channel_subscribe(channel_.get(), condition_.get()) ==
            LTTNG_NOTIFICATION_CHANNEL_STATUS_OK,
        "subscribe to notifications");
  check(lttng_register_trigger_with_name(trigger_.get(), name.c_str()) == LTTNG_OK,
        "register the trigger");
  is_registered_ = true;
}

DeadlineWatch::~DeadlineWatch() {
  channel_.reset();
  if (is_registered_) {
    lttng_unregister_trigger(trigger_.get());
  }
}

std::optional<DeadlineMiss> DeadlineWatch::poll() {
  std::optional<DeadlineMiss> first;
  bool is_pending = false;
  while (lttng_notification_channel_has_pending_notification(channel_.get(), &is_pending) ==
             LTTNG_NOTIFICATION_CHANNEL_STATUS_OK &&
         is_pending) {
    lttng_notification* raw = nullptr;
    const auto status = lttng_notification_channel_get_next_notification(channel_.get(), &raw);
    const std::unique_ptr<lttng_notification, DestroyNotification> notification(raw);
    if (status == LTTNG_NOTIFICATION_CHANNEL_STATUS_NOTIFICATIONS_DROPPED) {
      continue;
    }
    if (status != LTTNG_NOTIFICATION_CHANNEL_STATUS_OK) {
      break;
    }
    if (!first) {
      first = miss_of(*notification);
    }
  }
  return first;
}

}  // namespace cie::record
