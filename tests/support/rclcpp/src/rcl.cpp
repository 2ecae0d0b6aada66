#include "arguments.hpp"

#include <algorithm>
#include <charconv>
#include <deque>
#include <string>
#include <utility>
#include <vector>

#include <rcl/arguments.h>
#include <rcl/client.h>
#include <rcl/event.h>
#include <rcl/service.h>
#include <rcl/subscription.h>
#include <rcl/timer.h>
#include <time.h>

// --- clocks ---------------------------------------------------------------------------------------

namespace {

// With the clock's mutex held: who listens hears of it before and after.
template <typename Change>
void jump(rcl_clock_t& clock, const rcl_time_jump_t& jumped, Change change) {
  const auto concerns = [&jumped](const rcl_jump_threshold_t& threshold) {
    const std::int64_t by = jumped.delta.nanoseconds;
    if (jumped.clock_change != RCL_ROS_TIME_NO_CHANGE) return threshold.on_clock_change;
    return by >= 0 ? by >= threshold.min_forward.nanoseconds
                   : by <= threshold.min_backward.nanoseconds;
  };
  const auto tell = [&](bool is_before) {
    for (const auto& [number, listener] : clock.listeners) {
      if (concerns(listener.threshold)) listener.told(jumped, is_before);
    }
  };
  tell(true);
  change();
  tell(false);
}

rcl_ret_t set_override(rcl_clock_t& clock, bool is_overridden) {
  if (clock.type != RCL_ROS_TIME) return RCL_RET_INVALID_ARGUMENT;
  const std::lock_guard lock{clock.mutex};
  const auto change = is_overridden ? RCL_ROS_TIME_ACTIVATED : RCL_ROS_TIME_DEACTIVATED;
  jump(clock, {change, {0}}, [&] { clock.is_overridden = is_overridden; });
  return RCL_RET_OK;
}

std::int64_t read(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

}  // namespace

rcl_ret_t rcl_clock_get_now(rcl_clock_t* clock, std::int64_t* now) {
  if (clock->type == RCL_STEADY_TIME) {
    *now = read(CLOCK_MONOTONIC);
    return RCL_RET_OK;
  }
  const std::lock_guard lock{clock->mutex};
  *now = clock->is_overridden ? clock->ros_now : read(CLOCK_REALTIME);
  return RCL_RET_OK;
}

rcl_ret_t rcl_enable_ros_time_override(rcl_clock_t* clock) { return set_override(*clock, true); }
rcl_ret_t rcl_disable_ros_time_override(rcl_clock_t* clock) { return set_override(*clock, false); }
rcl_ret_t rcl_is_enabled_ros_time_override(rcl_clock_t* clock, bool* is_enabled) {
  const std::lock_guard lock{clock->mutex};
  *is_enabled = clock->is_overridden;
  return RCL_RET_OK;
}
rcl_ret_t rcl_set_ros_time_override(rcl_clock_t* clock, std::int64_t now) {
  const std::lock_guard lock{clock->mutex};
  const auto change = [&] { clock->ros_now = now; };
  if (clock->is_overridden) {
    jump(*clock, {RCL_ROS_TIME_NO_CHANGE, {now - clock->ros_now}}, change);
  } else {
    change();
  }
  return RCL_RET_OK;
}

int add_jump_listener(rcl_clock_t& clock, JumpListener listener) {
  const std::lock_guard lock{clock.mutex};
  clock.listeners.emplace(clock.next_listener, std::move(listener));
  return clock.next_listener++;
}
void remove_jump_listener(rcl_clock_t& clock, int listener) {
  const std::lock_guard lock{clock.mutex};
  clock.listeners.erase(listener);
}

// --- timers ---------------------------------------------------------------------------------------

// The next expiry is one period after the last, or the first on that grid which is not over.
rcl_ret_t rcl_timer_call(rcl_timer_t* timer) {
  if (timer->canceled.load()) return RCL_RET_TIMER_CANCELED;
  std::int64_t now = 0;
  rcl_clock_get_now(timer->clock, &now);
  timer->last_call_time.store(now);
  std::int64_t next = timer->next_call_time.load() + timer->period;
  if (next < now) {
    next = timer->period == 0
               ? now
               : next + (now - next + timer->period - 1) / timer->period * timer->period;
  }
  timer->next_call_time.store(next);
  return RCL_RET_OK;
}
rcl_ret_t rcl_timer_cancel(rcl_timer_t* timer) {
  timer->canceled.store(true);
  return RCL_RET_OK;
}
rcl_ret_t rcl_timer_reset(rcl_timer_t* timer) {
  std::int64_t now = 0;
  rcl_clock_get_now(timer->clock, &now);
  timer->next_call_time.store(now + timer->period);
  timer->canceled.store(false);
  const std::lock_guard lock{timer->mutex};
  if (timer->on_reset != nullptr) timer->on_reset(timer->on_reset_data, 1);
  return RCL_RET_OK;
}
rcl_ret_t rcl_timer_set_on_reset_callback(rcl_timer_t* timer, rcl_event_callback_t callback,
                                          const void* user_data) {
  const std::lock_guard lock{timer->mutex};
  timer->on_reset = callback;
  timer->on_reset_data = user_data;
  return RCL_RET_OK;
}
rcl_ret_t rcl_timer_is_canceled(const rcl_timer_t* timer, bool* is_canceled) {
  *is_canceled = timer->canceled.load();
  return RCL_RET_OK;
}
rcl_ret_t rcl_timer_get_period(const rcl_timer_t* timer, std::int64_t* period) {
  *period = timer->period;
  return RCL_RET_OK;
}
// The expiry that waits stays where it is.
rcl_ret_t rcl_timer_exchange_period(const rcl_timer_t* timer, std::int64_t period,
                                    std::int64_t* former) {
  *former = const_cast<rcl_timer_t*>(timer)->period.exchange(period);
  return RCL_RET_OK;
}
rcl_ret_t rcl_timer_clock(rcl_timer_t* timer, rcl_clock_t** clock) {
  *clock = timer->clock;
  return RCL_RET_OK;
}
rcl_ret_t rcl_timer_get_time_until_next_call(const rcl_timer_t* timer, std::int64_t* until) {
  if (timer->canceled.load()) return RCL_RET_TIMER_CANCELED;
  std::int64_t now = 0;
  rcl_clock_get_now(timer->clock, &now);
  *until = timer->next_call_time.load() - now;
  return RCL_RET_OK;
}

// --- messages on loan -----------------------------------------------------------------------------

rcl_ret_t rcl_take_loaned_message(const rcl_subscription_t* subscription, void** message,
                                  rmw_message_info_t* info, void*) {
  const auto sample = subscription->reader->take();
  if (!sample) return RCL_RET_SUBSCRIPTION_TAKE_FAILED;
  auto& holder = const_cast<rcl_subscription_t&>(*subscription);
  const std::lock_guard lock{holder.mutex};
  holder.loans.emplace(sample->data.get(), sample->data);
  *message = const_cast<void*>(sample->data.get());
  *info = sample->info;
  return RCL_RET_OK;
}
rcl_ret_t rcl_return_loaned_message_from_subscription(const rcl_subscription_t* subscription,
                                                      void* message) {
  auto& holder = const_cast<rcl_subscription_t&>(*subscription);
  const std::lock_guard lock{holder.mutex};
  return holder.loans.erase(message) == 1 ? RCL_RET_OK : RCL_RET_ERROR;
}

// --- who is called of what is new ------------------------------------------------------------------

rcl_ret_t rcl_subscription_set_on_new_message_callback(const rcl_subscription_t* subscription,
                                                       rcl_event_callback_t callback,
                                                       const void* user_data) {
  subscription->reader->set_on_new(callback, user_data);
  return RCL_RET_OK;
}
rcl_ret_t rcl_service_set_on_new_request_callback(const rcl_service_t* service,
                                                  rcl_event_callback_t callback,
                                                  const void* user_data) {
  service->reader->set_on_new(callback, user_data);
  return RCL_RET_OK;
}
rcl_ret_t rcl_client_set_on_new_response_callback(const rcl_client_t* client,
                                                  rcl_event_callback_t callback,
                                                  const void* user_data) {
  client->reader->set_on_new(callback, user_data);
  return RCL_RET_OK;
}

// --- requests and responses -----------------------------------------------------------------------

rcl_ret_t rcl_take_request_with_info(const rcl_service_t* service, rmw_service_info_t* info,
                                     void* request) {
  const auto sample = service->reader->take();
  if (!sample) return RCL_RET_SERVICE_TAKE_FAILED;
  service->copy(sample->data.get(), request);
  *info = {sample->info.source_timestamp, 0, sample->request};
  return RCL_RET_OK;
}
rcl_ret_t rcl_take_response_with_info(const rcl_client_t* client, rmw_service_info_t* info,
                                      void* response) {
  auto sample = client->reader->take();
  while (sample && sample->request.client != client->gid)
    sample = client->reader->take();
  if (!sample) return RCL_RET_CLIENT_TAKE_FAILED;
  client->copy(sample->data.get(), response);
  *info = {sample->info.source_timestamp, 0, sample->request};
  return RCL_RET_OK;
}

// --- lost messages --------------------------------------------------------------------------------

rcl_ret_t rcl_subscription_event_init(rcl_event_t* event, const rcl_subscription_t* subscription,
                                      rcl_subscription_event_type_t type) {
  if (type != RCL_SUBSCRIPTION_MESSAGE_LOST) return RCL_RET_INVALID_ARGUMENT;
  event->impl = {subscription->reader, &subscription->reader->lost};
  return RCL_RET_OK;
}
rcl_ret_t rcl_event_set_callback(const rcl_event_t* event, rcl_event_callback_t callback,
                                 const void* user_data) {
  if (callback == nullptr) {
    event->impl->notice.clear();
  } else {
    event->impl->notice.set(
        [callback, user_data](std::size_t count) { callback(user_data, count); });
  }
  return RCL_RET_OK;
}
rcl_ret_t rcl_take_event(const rcl_event_t* event, void* status) {
  const auto count = event->impl->take().value_or(rmw_double::Event::Count{});
  *static_cast<rmw_message_lost_status_t*>(status) = {static_cast<std::size_t>(count.total),
                                                      static_cast<std::size_t>(count.change)};
  return RCL_RET_OK;
}
rcl_ret_t rcl_event_fini(rcl_event_t* event) {
  event->impl.reset();
  return RCL_RET_OK;
}

// --- parameters of the command line ---------------------------------------------------------------

namespace {

// Parameters as C has them, and what owns them.
struct Overrides : rcl_params_t {
  struct OfNode {
    std::vector<char*> names{};
    std::vector<rcl_variant_t> values{};
  };
  std::deque<std::string> texts{};
  std::deque<bool> bools{};
  std::deque<std::int64_t> integers{};
  std::vector<char*> nodes_{};
  std::deque<OfNode> of_nodes{};
  std::vector<rcl_node_params_t> params_{};

  char* text(const std::string& value) { return texts.emplace_back(value).data(); }
  rcl_variant_t variant(const std::string& value) {
    rcl_variant_t made{};
    std::int64_t number = 0;
    const char* const end = value.data() + value.size();
    if (value == "true" || value == "false") {
      made.bool_value = &bools.emplace_back(value == "true");
    } else if (!value.empty() && std::from_chars(value.data(), end, number).ptr == end) {
      made.integer_value = &integers.emplace_back(number);
    } else {
      made.string_value = text(value);
    }
    return made;
  }
};

}  // namespace

rcl_ret_t rcl_arguments_get_param_overrides(const rcl_arguments_t* arguments,
                                            rcl_params_t** overrides) {
  *overrides = nullptr;
  if (arguments->impl->overrides.empty()) return RCL_RET_OK;
  auto* const made = new Overrides;
  std::vector<std::string> names;
  for (const auto& each : arguments->impl->overrides) {
    auto at = static_cast<std::size_t>(std::ranges::find(names, each.node) - names.begin());
    if (at == names.size()) {
      names.push_back(each.node);
      made->nodes_.push_back(made->text(each.node));
      made->of_nodes.emplace_back();
    }
    made->of_nodes[at].names.push_back(made->text(each.name));
    made->of_nodes[at].values.push_back(made->variant(each.value));
  }
  for (auto& node : made->of_nodes)
    made->params_.push_back({node.names.data(), node.values.data(), node.names.size()});
  made->node_names = made->nodes_.data();
  made->params = made->params_.data();
  made->num_nodes = made->nodes_.size();
  *overrides = made;
  return RCL_RET_OK;
}

void rcl_yaml_node_struct_fini(rcl_params_t* parameters) {
  delete static_cast<Overrides*>(parameters);
}
