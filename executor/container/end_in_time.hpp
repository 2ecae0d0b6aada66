// A container that is asked to end does, whatever its components' libraries wait for.
#pragma once

#include <cie/tracepoints/background_thread.hpp>

#include "base/file_descriptor.hpp"

#include <array>
#include <atomic>
#include <csignal>
#include <optional>

namespace cie::container {

// From construction to destruction SIGINT and SIGTERM end the process a second later at the latest, by
// force and with kFailed, unless patience() is had. It passes them on to the handlers that were there, so
// make it after CancelOnSignals. Have one.
class EndInTime {
 public:
  // Throws std::system_error.
  EndInTime();
  ~EndInTime();
  EndInTime(const EndInTime&) = delete;
  EndInTime& operator=(const EndInTime&) = delete;

  // What lasts as long as it lasts: callbacks that run, and what is left when they have.
  class Patience {
   public:
    explicit Patience(EndInTime& end) : end_(end) { end_.is_patient_ = true; }
    ~Patience() { end_.is_patient_ = false; }
    Patience(const Patience&) = delete;
    Patience& operator=(const Patience&) = delete;

   private:
    EndInTime& end_;
  };

 private:
  static void on_signal(int number);
  void watch();

  FileDescriptor signalled_;
  FileDescriptor stop_;
  std::atomic<bool> is_patient_{false};
  std::array<struct sigaction, 2> former_{};
  std::optional<BackgroundThread> thread_;  // last: it uses the others
};

}  // namespace cie::container
