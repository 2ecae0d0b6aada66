// Numbers and stamps the messages of one writer: both rise together, whoever publishes.
#pragma once

#include <algorithm>
#include <cstdint>

namespace cie::trace {

struct MessageStamp {
  std::uint64_t seq;                          // contiguous from 0
  std::int64_t source_timestamp_realtime_ns;  // strictly increasing
};

// Sequence number and timestamp are one 16-byte word changed by compare-and-swap, so that no thread
// can take a later number with an earlier timestamp. Lock-free on x86-64 (cmpxchg16b, which the
// including file is compiled for) and AArch64.
class MessageClock {
 public:
  // The next number, stamped with `now` or, if that is not later than the last one, the next
  // nanosecond after it.
  MessageStamp next(std::int64_t now) noexcept {
    const auto [last, next] = advance([now](MessageStamp stamp) {
      return MessageStamp{stamp.seq + 1, after(stamp.source_timestamp_realtime_ns, now)};
    });
    return {last.seq, next.source_timestamp_realtime_ns};
  }

  // The next number alone; `timestamp` is the caller's and raises what the next stamp must exceed.
  std::uint64_t next_seq_at(std::int64_t timestamp) noexcept {
    return advance([timestamp](MessageStamp stamp) {
             return MessageStamp{stamp.seq + 1,
                                 std::max(stamp.source_timestamp_realtime_ns, timestamp)};
           })
        .last.seq;
  }

  // A stamp without a number.
  std::int64_t next_timestamp(std::int64_t now) noexcept {
    return advance([now](MessageStamp stamp) {
             return MessageStamp{stamp.seq, after(stamp.source_timestamp_realtime_ns, now)};
           })
        .next.source_timestamp_realtime_ns;
  }

  // How many numbers were given, which is the next one.
  std::uint64_t count() const noexcept {
    return __atomic_load_n(&value_.stamp.seq, __ATOMIC_ACQUIRE);
  }

 private:
  union Value {
    MessageStamp stamp;
    __extension__ unsigned __int128 word;
  };
  struct Step {
    MessageStamp last;
    MessageStamp next;
  };

  static std::int64_t after(std::int64_t last, std::int64_t now) noexcept {
    return std::max(now, last + 1);
  }

  // The two halves are read one by one: a mixture of two states fails the exchange that follows.
  template <typename Change>
  Step advance(Change change) noexcept {
    Value last{};
    Value next{};
    do {
      last.stamp.seq = __atomic_load_n(&value_.stamp.seq, __ATOMIC_RELAXED);
      last.stamp.source_timestamp_realtime_ns =
          __atomic_load_n(&value_.stamp.source_timestamp_realtime_ns, __ATOMIC_RELAXED);
      next.stamp = change(last.stamp);
    } while (!__sync_bool_compare_and_swap(&value_.word, last.word, next.word));
    return {last.stamp, next.stamp};
  }

  alignas(16) Value value_{};
};

}  // namespace cie::trace
