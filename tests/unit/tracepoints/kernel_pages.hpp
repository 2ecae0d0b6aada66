// Pages of the kernel's ring buffer and descriptions of its events, written byte by byte.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace cie::test {

inline constexpr std::uint16_t kSwitchNumber = 372;
inline constexpr std::uint16_t kForkNumber = 366;
inline constexpr std::uint16_t kExecNumber = 365;

// What the kernel says of some of its events (Linux 6.18, x86-64).
std::string switch_format();
std::string fork_format();
std::string exec_format();

struct SwitchRecord {
  std::string prev_comm;
  std::int32_t prev_pid = 0;
  std::int32_t prev_prio = 120;
  std::int64_t prev_state = 0;
  std::string next_comm;
  std::int32_t next_pid = 0;
  std::int32_t next_prio = 120;
};
std::string bytes_of(const SwitchRecord& record);

// A page is filled from its beginning; times are differences to the one before.
class PageText {
 public:
  explicit PageText(std::uint64_t time) : time_(time) {}

  PageText& record(std::uint32_t delta, const std::string& data);
  PageText& long_record(std::uint32_t delta,
                        const std::string& data);              // length in a word of its own
  PageText& discarded(std::uint32_t delta, std::size_t size);  // an event that was taken back
  PageText& time_extend(std::uint64_t delta);
  PageText& time_stamp(std::uint64_t time);
  PageText& padding();  // to the end of the page
  PageText& missed();   // events before it, not known how many
  PageText& missed(std::uint64_t count);

  std::vector<std::byte> bytes() const;

 private:
  PageText& put(std::uint32_t type, std::uint32_t delta);

  std::uint64_t time_;
  std::uint64_t flags_ = 0;
  std::uint64_t missed_ = 0;
  std::string data_;
};

}  // namespace cie::test
