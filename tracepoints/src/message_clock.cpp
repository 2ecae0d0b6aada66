#include "message_clock.hpp"

#include <algorithm>

namespace cie::trace {
namespace {

std::int64_t after(std::int64_t last, std::int64_t now) noexcept { return std::max(now, last + 1); }

}  // namespace

// Reads the two halves one by one: a mixture of two states fails the exchange that follows, and
// count() looks at one half only.
MessageClock::Value MessageClock::load() const noexcept {
  Value value{};
  value.stamp.seq = __atomic_load_n(&value_.stamp.seq, __ATOMIC_RELAXED);
  value.stamp.source_timestamp_realtime_ns =
      __atomic_load_n(&value_.stamp.source_timestamp_realtime_ns, __ATOMIC_RELAXED);
  return value;
}

bool MessageClock::exchange(Value expected, Value desired) noexcept {
  return __sync_bool_compare_and_swap(&value_.word, expected.word, desired.word);
}

MessageStamp MessageClock::next(std::int64_t now) noexcept {
  Value last{};
  Value next{};
  do {
    last = load();
    next.stamp.seq = last.stamp.seq + 1;
    next.stamp.source_timestamp_realtime_ns = after(last.stamp.source_timestamp_realtime_ns, now);
  } while (!exchange(last, next));
  return {last.stamp.seq, next.stamp.source_timestamp_realtime_ns};
}

std::uint64_t MessageClock::next_seq_at(std::int64_t timestamp) noexcept {
  Value last{};
  Value next{};
  do {
    last = load();
    next.stamp.seq = last.stamp.seq + 1;
    next.stamp.source_timestamp_realtime_ns =
        std::max(last.stamp.source_timestamp_realtime_ns, timestamp);
  } while (!exchange(last, next));
  return last.stamp.seq;
}

std::int64_t MessageClock::next_timestamp(std::int64_t now) noexcept {
  Value last{};
  Value next{};
  do {
    last = load();
    next.stamp.seq = last.stamp.seq;
    next.stamp.source_timestamp_realtime_ns = after(last.stamp.source_timestamp_realtime_ns, now);
  } while (!exchange(last, next));
  return next.stamp.source_timestamp_realtime_ns;
}

std::uint64_t MessageClock::count() const noexcept {
  return __atomic_load_n(&value_.stamp.seq, __ATOMIC_ACQUIRE);
}

}  // namespace cie::trace
