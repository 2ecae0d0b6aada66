#include "lttng/event_watch.hpp"

#include "system/error.hpp"

#include <lttng/error-query.h>
#include <lttng/lttng.h>

namespace cie::record {
namespace {

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

struct DestroyQuery {
  void operator()(lttng_error_query* query) const noexcept { lttng_error_query_destroy(query); }
};
struct DestroyResults {
  void operator()(lttng_error_query_results* results) const noexcept {
    lttng_error_query_results_destroy(results);
  }
};

// How much the daemon counted as lost; what it does not tell is not counted.
std::uint64_t losses(lttng_error_query* asked) {
  const std::unique_ptr<lttng_error_query, DestroyQuery> query(asked);
  lttng_error_query_results* told = nullptr;
  if (!query || lttng_error_query_execute(query.get(), lttng_session_daemon_command_endpoint,
                                          &told) != LTTNG_OK) {
    return 0;
  }
  const std::unique_ptr<lttng_error_query_results, DestroyResults> results(told);
  std::uint64_t sum = 0;
  unsigned int count = 0;
  static_cast<void>(lttng_error_query_results_get_count(told, &count));
  for (unsigned int i = 0; i < count; ++i) {
    const lttng_error_query_result* result = nullptr;
    std::uint64_t value = 0;
    if (lttng_error_query_results_get_result(told, &result, i) ==
            LTTNG_ERROR_QUERY_RESULTS_STATUS_OK &&
        lttng_error_query_result_counter_get_value(result, &value) ==
            LTTNG_ERROR_QUERY_RESULT_STATUS_OK) {
      sum += value;
    }
  }
  return sum;
}

// Names what LTTng refuses.
class Check {
 public:
  explicit Check(const char* purpose) : purpose_(purpose) {}
  void operator()(bool is_done, const char* operation) const {
    if (is_done) return;
    throw RecordError(std::string("cannot ") + purpose_ + ": LTTng refuses to " + operation);
  }

 private:
  const char* purpose_;
};

lttng_condition* make_condition(const char* event, const Check& check) {
  const std::unique_ptr<lttng_event_rule, DestroyRule> rule(
      lttng_event_rule_user_tracepoint_create());
  check(rule && lttng_event_rule_user_tracepoint_set_name_pattern(rule.get(), event) ==
                    LTTNG_EVENT_RULE_STATUS_OK,
        "make a rule for the event");
  lttng_condition* const condition = lttng_condition_event_rule_matches_create(rule.get());
  check(condition != nullptr, "make a condition");
  return condition;
}

Captured value_at(const lttng_event_field_value* values, unsigned int index) {
  const lttng_event_field_value* value = nullptr;
  if (lttng_event_field_value_array_get_element_at_index(values, index, &value) !=
      LTTNG_EVENT_FIELD_VALUE_STATUS_OK) {
    return {};
  }
  std::uint64_t number = 0;
  std::int64_t with_sign = 0;
  const char* text = nullptr;
  constexpr auto kOk = LTTNG_EVENT_FIELD_VALUE_STATUS_OK;
  if (lttng_event_field_value_unsigned_int_get_value(value, &number) == kOk) {
    return static_cast<std::int64_t>(number);
  }
  if (lttng_event_field_value_signed_int_get_value(value, &with_sign) == kOk) return with_sign;
  if (lttng_event_field_value_string_get_value(value, &text) == kOk) return std::string(text);
  return {};
}

}  // namespace

std::int64_t number_of(const Captured& value) noexcept {
  const auto* number = std::get_if<std::int64_t>(&value);
  return number != nullptr ? *number : 0;
}

std::int64_t pid_of(const Captured& value) noexcept {
  constexpr std::int64_t kMost = std::int64_t{1} << 22U;  // linux/threads.h, PID_MAX_LIMIT
  const auto is_pid = [](std::int64_t number) { return number > 0 && number <= kMost; };
  const auto number = number_of(value);
  const auto reversed =
      static_cast<std::int64_t>(__builtin_bswap64(static_cast<std::uint64_t>(number)));
  return !is_pid(number) && is_pid(reversed) ? reversed : number;
}

void EventWatch::Destroy::operator()(lttng_condition* condition) const noexcept {
  lttng_condition_destroy(condition);
}
void EventWatch::Destroy::operator()(lttng_notification_channel* channel) const noexcept {
  lttng_notification_channel_destroy(channel);
}
void EventWatch::Destroy::operator()(lttng_trigger* trigger) const noexcept {
  lttng_trigger_destroy(trigger);
}

EventWatch::EventWatch(const std::string& trigger, const char* event,
                       const std::vector<Capture>& captures, const char* purpose)
    : captures_(captures.size()), condition_(make_condition(event, Check(purpose))) {
  const Check check(purpose);
  for (const auto& [name, is_context] : captures) {
    lttng_event_expr* const expression = is_context
                                             ? lttng_event_expr_channel_context_field_create(name)
                                             : lttng_event_expr_event_payload_field_create(name);
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
  check(lttng_register_trigger_with_name(trigger_.get(), trigger.c_str()) == LTTNG_OK,
        "register the trigger");
  is_registered_ = true;
}

EventWatch::~EventWatch() {
  channel_.reset();
  if (is_registered_) {
    lttng_unregister_trigger(trigger_.get());
  }
}

void EventWatch::look_for_losses() {
  has_missed_ = has_missed_ || losses(lttng_error_query_condition_create(trigger_.get())) > 0 ||
                losses(lttng_error_query_trigger_create(trigger_.get())) > 0;
}

std::optional<std::vector<Captured>> EventWatch::poll() {
  bool is_pending = false;
  while (lttng_notification_channel_has_pending_notification(channel_.get(), &is_pending) ==
             LTTNG_NOTIFICATION_CHANNEL_STATUS_OK &&
         is_pending) {
    lttng_notification* raw = nullptr;
    const auto status = lttng_notification_channel_get_next_notification(channel_.get(), &raw);
    const std::unique_ptr<lttng_notification, DestroyNotification> notification(raw);
    if (status == LTTNG_NOTIFICATION_CHANNEL_STATUS_NOTIFICATIONS_DROPPED) {
      has_missed_ = true;
      continue;
    }
    if (status != LTTNG_NOTIFICATION_CHANNEL_STATUS_OK) {
      break;
    }
    std::vector<Captured> captured(captures_);
    const lttng_event_field_value* values = nullptr;
    const lttng_evaluation* const evaluation = lttng_notification_get_evaluation(raw);
    if (lttng_evaluation_event_rule_matches_get_captured_values(evaluation, &values) ==
        LTTNG_EVALUATION_EVENT_RULE_MATCHES_STATUS_OK) {
      for (std::size_t i = 0; i < captured.size(); ++i)
        captured[i] = value_at(values, static_cast<unsigned int>(i));
    }
    return captured;
  }
  return std::nullopt;
}

}  // namespace cie::record
