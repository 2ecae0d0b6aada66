// Writes the recording's kernel trace: CTF 1.8, one stream per CPU and the metadata for all.
#pragma once

#include "base/directory.hpp"
#include "base/file_descriptor.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace cie::record {

using TraceUuid = std::array<std::uint8_t, 16>;
TraceUuid random_uuid();

// How CLOCK_MONOTONIC relates to others, in the words of CTF.
struct TraceClock {
  std::string uuid;             // the boot id
  std::uint64_t offset_ns = 0;  // CLOCK_REALTIME - CLOCK_MONOTONIC
};

// The TSDL text that describes streams of CtfStream with events of KernelEventEncoder.
// `route`: whence they came, as KernelSource::name().
std::string kernel_metadata(const TraceUuid& trace, const TraceClock& clock,
                            std::string_view route);

// The clock of LTTng's metadata, given the file's bytes (text or packets); false if there is none.
// What both traces call the offset must be one number, or readers shift them against each other.
bool read_clock(std::string_view metadata, TraceClock& clock);

// The packets of one CPU. Each begins where the one before ended, so that together they say what
// time the stream covers. Functions throw RecordError when the file cannot be written; whole
// packets are all it then holds.
class CtfStream {
 public:
  // Its file in `directory`, which is borrowed, appears with the first packet. `begin`: from when on
  // nothing was missed.
  CtfStream(const Directory& directory, const TraceUuid& trace, std::uint32_t cpu,
            std::uint64_t begin);

  // An event with its header, in order of time.
  void add(std::uint64_t time, std::string_view event);
  // Events before `time`, and after the last one added, were lost: `total` in this stream so far.
  void lose(std::uint64_t time, std::uint64_t total);
  // Writes what was added as a packet; nothing if that is nothing.
  void flush();
  // The last packet says until when nothing more came, even if no event is in it.
  void finish(std::uint64_t end, std::uint64_t total_lost);
  // After flush(), and when the directory is another one: what comes now is written to a file there,
  // as the same stream.
  void go_on();

  std::uint64_t events() const noexcept { return events_; }
  std::uint64_t lost() const noexcept { return lost_; }

 private:
  void write_packet();

  const Directory* directory_;
  FileDescriptor file_;
  TraceUuid trace_;
  std::uint32_t cpu_;
  std::uint64_t begin_;
  std::uint64_t end_;
  std::uint64_t lost_ = 0;
  std::uint64_t packets_ = 0;
  std::uint64_t events_ = 0;
  std::uint64_t size_ = 0;  // of the file
  std::string packet_;      // room for the header, then events
};

}  // namespace cie::record
