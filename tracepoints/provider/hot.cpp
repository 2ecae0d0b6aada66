// The functions on the callback path. Each counts, then emits: a number is taken before the
// tracepoint looks whether it is enabled, so that an announcement which reads the counter after
// tracing began never misses a number that was not recorded (see tracepoints/README.md,
// "next_seq").
#include <cie/tracepoints/trace.hpp>

#include "base/clock.hpp"
#include "inherited.hpp"
#include "provider.h"
#include "ros2_profile.hpp"
#include "state.hpp"

#include <ctime>

namespace cie::trace {
namespace {

// Takes the next number of a counter. Without overlap there is one writer at a time, ordered by the
// executor, and an ordinary increment serves at a tenth of the cost.
std::uint64_t take(std::atomic<std::uint64_t>& counter, bool may_overlap) noexcept {
  if (may_overlap) {
    return counter.fetch_add(1, std::memory_order_relaxed);
  }
  const std::uint64_t value = counter.load(std::memory_order_relaxed);
  counter.store(value + 1, std::memory_order_relaxed);
  return value;
}

void raise_to(std::atomic<std::uint64_t>& counter, std::uint64_t value) noexcept {
  std::uint64_t seen = counter.load(std::memory_order_relaxed);
  while (value > seen && !counter.compare_exchange_weak(seen, value, std::memory_order_relaxed)) {
  }
}

void emit_publish(PublisherId publisher, std::uint64_t seq, std::int64_t timestamp) noexcept {
  if (!is_own(publisher)) [[unlikely]]
    return;
  emit::publish(publisher, seq, timestamp);
  if (const Ros2Profile* profile = ros2_profile()) [[unlikely]] {
    profile->publish(publisher, seq, timestamp);
  }
}

// Keeps the compiler from looking at the tracepoint before the count.
void count_before_emit() noexcept { std::atomic_signal_fence(std::memory_order_seq_cst); }

}  // namespace

void Callback::release(std::uint64_t overwritten) noexcept {
  CallbackState& state = *state_;
  const std::uint64_t seq = take(state.released, state.releases_may_overlap);
  raise_to(state.overwritten, overwritten);
  count_before_emit();
  if (!is_own(id_)) [[unlikely]]
    return;
  emit::callback_release(id_, seq, overwritten);
}

void Callback::overwritten(std::uint64_t total) noexcept { raise_to(state_->overwritten, total); }

std::uint64_t Callback::next_seq() const noexcept {
  return state_->started.load(std::memory_order_relaxed);
}

std::uint64_t Callback::start(const Release& release) noexcept {
  const std::uint64_t seq = take(state_->started, state_->may_overlap);
  count_before_emit();
  if (!is_own(id_)) [[unlikely]]
    return seq;
  emit::callback_start(id_, seq, release);
  if (const Ros2Profile* profile = ros2_profile()) [[unlikely]] {
    profile->callback_start(*state_, seq, release);
  }
  return seq;
}

// The clock is read before `callback_end`: what is told as missed was missed by that event too.
void Callback::end(std::uint64_t seq, CallbackStatus status, std::int64_t release_ns) noexcept {
  take(state_->ended, state_->may_overlap);
  count_before_emit();
  if (!is_own(id_)) [[unlikely]]
    return;
  std::int64_t response_ns = 0;
  const std::uint64_t deadline_ns = state_->info.deadline_ns;
  if (deadline_ns != 0 && release_ns >= 0 && emit::is_deadline_miss_enabled()) {
    response_ns = now_ns(CLOCK_MONOTONIC) - release_ns;
  }
  if (const Ros2Profile* profile = ros2_profile()) [[unlikely]] {
    profile->callback_end(*state_);
  }
  emit::callback_end(id_, seq, status);
  if (response_ns > 0 && static_cast<std::uint64_t>(response_ns) > deadline_ns) {
    emit::deadline_miss(id_, seq, response_ns, deadline_ns);
  }
}

void Callback::sample_lost(std::uint32_t count) noexcept {
  const std::uint64_t total = state_->lost.fetch_add(count, std::memory_order_relaxed) + count;
  count_before_emit();
  if (!is_own(id_)) [[unlikely]]
    return;
  emit::sample_lost(id_, count, total);
}

std::int64_t Publisher::publish() noexcept {
  const MessageStamp message = state_->messages.next(now_ns(CLOCK_REALTIME));
  count_before_emit();
  emit_publish(id_, message.seq, message.source_timestamp_realtime_ns);
  return message.source_timestamp_realtime_ns;
}

void Publisher::publish(std::int64_t source_timestamp_realtime_ns) noexcept {
  const std::uint64_t seq = state_->messages.next_seq_at(source_timestamp_realtime_ns);
  count_before_emit();
  emit_publish(id_, seq, source_timestamp_realtime_ns);
}

void Publisher::failed(std::int64_t source_timestamp_realtime_ns, std::uint64_t total) noexcept {
  if (!is_own(id_)) [[unlikely]]
    return;
  emit::publish_failed(id_, source_timestamp_realtime_ns, total);
}

std::int64_t Publisher::next_source_timestamp() noexcept {
  return state_->messages.next_timestamp(now_ns(CLOCK_REALTIME));
}

void thread_wait(std::int64_t deadline_ns) noexcept {
  if (!are_threads_own()) [[unlikely]]
    return;
  if (const Ros2Profile* profile = ros2_profile()) [[unlikely]] {
    profile->before_wait(deadline_ns);
  }
}

void thread_wakeup(CallbackId callback, WakeupReason reason) noexcept {
  if (!are_threads_own() || !is_own(callback)) [[unlikely]]
    return;
  emit::thread_wakeup(callback, reason);
  if (const Ros2Profile* profile = ros2_profile()) [[unlikely]] {
    profile->after_wait();
  }
}

}  // namespace cie::trace
