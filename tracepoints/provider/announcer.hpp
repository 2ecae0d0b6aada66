// The background thread that announces all state whenever tracing starts, and emits `clock_sync`.
#pragma once

#include <cie/tracepoints/background_thread.hpp>

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>

namespace cie::trace {

// Runs from construction to destruction. Not real-time, whatever its creator is: SCHED_OTHER,
// nice 10; all signals blocked; named "cie-announce".
//
// Sessions announce themselves through a probe (see provider.h), so the thread sleeps on a futex.
// It wakes by itself once a second while traced, for `clock_sync`; and every 800 ms while not
// traced, to see the one case the probe does not tell: events enabled in a session that already
// runs.
class Announcer {
 public:
  // All are called on the background thread, and only emit while a Run lasts.
  struct Actions {
    std::function<void()> announce;
    std::function<void()> sync_clocks;
    std::function<void()> forget_ros2_readers;  // nobody records the profile's events any longer
  };
  // Throws std::system_error.
  explicit Announcer(Actions actions);
  ~Announcer();
  Announcer(const Announcer&) = delete;
  Announcer& operator=(const Announcer&) = delete;

 private:
  void run() noexcept;
  bool try_announce() noexcept;

  Actions actions_;
  std::uint32_t seen_;  // session starts that were announced already
  std::atomic<bool> is_stopping_{false};
  std::optional<BackgroundThread> thread_;  // last: it uses all of them
};

}  // namespace cie::trace
