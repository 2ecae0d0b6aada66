// How a recording is kept: in a directory, in chunks, in snapshots of what is in memory, at a relay
// daemon, or not at all, for who watches it live.
#pragma once

#include "keeping/outcome.hpp"
#include "system/child_process.hpp"
#include "target/target.hpp"

#include <optional>

namespace cie::record {

// Functions are called in this order. What they throw, RecordError but for what is said, ends the
// recording.
class Keeping {
 public:
  Keeping() = default;
  virtual ~Keeping() = default;
  Keeping(const Keeping&) = delete;
  Keeping& operator=(const Keeping&) = delete;

  // Starts daemons and session: recorded is from here on. False if nobody wants it any more.
  virtual bool begin() = 0;
  // The command runs: this process may have threads from here on.
  virtual void start_reading() {}
  // After a begin() or a start that failed: leaves nothing behind.
  virtual void abandon() noexcept {}

  // Ten times a second, or more often. Interrupts the target when nothing more can be kept of it.
  virtual void poll(Target& target) = 0;
  // The user asks for a snapshot.
  virtual void on_request(Target& target) = 0;
  // Once, when the target is over: ends the session and completes what is kept. `exit`: the
  // command's. What goes wrong with a recording is in its outcome.
  virtual Outcome finish(const std::optional<ExitStatus>& exit) = 0;
};

}  // namespace cie::record
