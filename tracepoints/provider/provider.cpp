// Defines the tracepoints of provider.h and their probes, and hooks into the tracer's own life.
#ifdef CIE_WITH_LTTNG
#define LTTNG_UST_TRACEPOINT_CREATE_PROBES
#define LTTNG_UST_TRACEPOINT_DEFINE
#include <lttng/ust-thread.h>
#endif

#include "provider.h"
#include "ros2_profile.hpp"

#include <atomic>

namespace cie::trace {
namespace {

using Hook = void (*)() noexcept;
std::atomic<Hook> on_session_start{nullptr};
std::atomic<Hook> on_process_exit{nullptr};

void call(const std::atomic<Hook>& hook) noexcept {
  if (const Hook function = hook.load(std::memory_order_acquire)) {
    function();
  }
}

// The loader finalizes libraries in order of dependency, so everything that uses this library is
// gone by now. Within a file destructor functions run last defined first: LTTng's own, in
// provider.h, which unregisters the tracepoints, comes after this one.
[[gnu::destructor]] void at_exit() noexcept { call(on_process_exit); }

}  // namespace

void at_process_exit(Hook on_exit) noexcept {
  on_process_exit.store(on_exit, std::memory_order_release);
}

#ifdef CIE_WITH_LTTNG

namespace {

// A probe of LTTng's internal tracepoint lttng_ust_statedump:start, which fires once for every
// session that starts on this process. It runs under LTTng's lock.
void statedump_start(void* /*data*/, lttng_ust_session* /*session*/) noexcept {
  call(on_session_start);
}

}  // namespace

bool is_compiled_in() noexcept { return true; }

std::uint32_t enabled_events() noexcept {
  const lttng_ust_tracepoint* const events[] = {
      &lttng_ust_tracepoint_cie___run_begin,      &lttng_ust_tracepoint_cie___run_end,
      &lttng_ust_tracepoint_cie___node_init,      &lttng_ust_tracepoint_cie___group_init,
      &lttng_ust_tracepoint_cie___callback_init,  &lttng_ust_tracepoint_cie___callback_fini,
      &lttng_ust_tracepoint_cie___publisher_init, &lttng_ust_tracepoint_cie___publisher_fini,
      &lttng_ust_tracepoint_cie___thread_init,    &lttng_ust_tracepoint_cie___thread_fini,
      &lttng_ust_tracepoint_cie___thread_sched,   &lttng_ust_tracepoint_cie___callback_release,
      &lttng_ust_tracepoint_cie___thread_wakeup,  &lttng_ust_tracepoint_cie___callback_start,
      &lttng_ust_tracepoint_cie___callback_end,   &lttng_ust_tracepoint_cie___publish,
      &lttng_ust_tracepoint_cie___sample_lost,    &lttng_ust_tracepoint_cie___publish_failed,
      &lttng_ust_tracepoint_cie___clock_sync};
  std::uint32_t mask = 0;
  std::uint32_t bit = 1;
  for (const lttng_ust_tracepoint* event : events) {
    mask |= __atomic_load_n(&event->state, __ATOMIC_RELAXED) != 0 ? bit : 0;
    bit <<= 1;
  }
  if (const Ros2Profile* profile = ros2_profile()) {
    mask |= profile->is_enabled() ? kRos2Events : 0;
  }
  return mask;
}

bool watch_session_starts(Hook on_start) noexcept {
  on_session_start.store(on_start, std::memory_order_release);
  static const bool is_registered =
      lttng_ust_tracepoint_provider_register("lttng_ust_statedump", "start",
                                             reinterpret_cast<void (*)()>(&statedump_start),
                                             nullptr, "struct lttng_ust_session *, session") == 0;
  return is_registered;
}

void touch_current_thread() noexcept {
  lttng_ust_init_thread();
  if (lttng_ust_tracepoint_dlopen_ptr && lttng_ust_tracepoint_dlopen_ptr->rcu_read_lock_sym) {
    lttng_ust_tp_rcu_read_lock();
    lttng_ust_tp_rcu_read_unlock();
  }
}

#else

bool is_compiled_in() noexcept { return false; }
std::uint32_t enabled_events() noexcept { return 0; }
bool watch_session_starts(Hook /*on_start*/) noexcept { return false; }
void touch_current_thread() noexcept {}

#endif

}  // namespace cie::trace
