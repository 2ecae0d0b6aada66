// A recording of one isolated process, written as LTTng-UST 2.13 would, of any size.
#pragma once

#include <cstdint>
#include <filesystem>

namespace bench {

struct TraceSize {
  std::uint64_t events = 20'000'000;  // about
  std::uint32_t streams = 64;         // one per CPU
  std::uint32_t applications = 1;     // on each CPU, one after the other
  std::uint32_t packet_bytes = 512U << 10U;
};

// In every application a timer publishes and a subscription takes the message: per round eight events
// (wake-up, start, publish, release, end; wake-up, start, end). Returns how many events there are.
std::uint64_t write_trace(const std::filesystem::path& directory, const TraceSize& size);

}  // namespace bench
