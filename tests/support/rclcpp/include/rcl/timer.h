#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>

#include <rcl/event_callback.h>
#include <rcl/time.h>

struct rcl_timer_t {
  rcl_clock_t* clock = nullptr;
  std::atomic<std::int64_t> period{0};
  std::atomic<std::int64_t> last_call_time{0};
  std::atomic<std::int64_t> next_call_time{0};
  std::atomic<std::int64_t> time_credit{0};
  std::atomic<bool> canceled{false};
  std::mutex mutex{};  // of what follows
  rcl_event_callback_t on_reset = nullptr;
  const void* on_reset_data = nullptr;
};

rcl_ret_t rcl_timer_call(rcl_timer_t* timer);
rcl_ret_t rcl_timer_cancel(rcl_timer_t* timer);
rcl_ret_t rcl_timer_reset(rcl_timer_t* timer);
rcl_ret_t rcl_timer_set_on_reset_callback(rcl_timer_t* timer, rcl_event_callback_t callback,
                                          const void* user_data);
rcl_ret_t rcl_timer_is_canceled(const rcl_timer_t* timer, bool* is_canceled);
rcl_ret_t rcl_timer_get_period(const rcl_timer_t* timer, std::int64_t* period);
rcl_ret_t rcl_timer_exchange_period(const rcl_timer_t* timer, std::int64_t period,
                                    std::int64_t* former);
rcl_ret_t rcl_timer_clock(rcl_timer_t* timer, rcl_clock_t** clock);
rcl_ret_t rcl_timer_get_time_until_next_call(const rcl_timer_t* timer, std::int64_t* until);
