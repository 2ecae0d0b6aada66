// Numbers and stamps the messages of one writer: both rise together, whoever publishes.
#pragma once

#include <cstdint>

namespace cie::trace {

struct MessageStamp {
  std::uint64_t seq;                          // contiguous from 0
  std::int64_t source_timestamp_realtime_ns;  // strictly increasing
};

// Sequence number and timestamp are one 16-byte word changed by compare-and-swap, so that no thread
// can take a later number with an earlier timestamp. Lock-free on x86-64 (cmpxchg16b) and AArch64.
class MessageClock {
 public:
  // The next number, stamped with `now` or, if that is not later than the last one, the next
  // nanosecond after it.
  MessageStamp next(std::int64_t now) noexcept;
  // The next number alone; `timestamp` is the caller's and raises what the next stamp must exceed.
  std::uint64_t next_seq_at(std::int64_t timestamp) noexcept;
  // A stamp without a number.
  std::int64_t next_timestamp(std::int64_t now) noexcept;
  // How many numbers were given, which is the next one.
  std::uint64_t count() const noexcept;

 private:
  __extension__ using Word = unsigned __int128;
  union Value {
    Word word;
    MessageStamp stamp;
  };

  Value load() const noexcept;
  bool exchange(Value expected, Value desired) noexcept;

  alignas(16) Value value_{.word = 0};
};

}  // namespace cie::trace
