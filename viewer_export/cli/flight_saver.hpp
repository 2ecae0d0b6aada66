// Has a flight recorder (`cie record --snapshot`) save what it keeps, without waiting for it.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include <sys/types.h>

namespace cie::cli {

class FlightSaver {
 public:
  // `directory` is that of the recorder. Throws UsageError if nobody keeps snapshots there, or it is not this user's,
  // std::runtime_error if cie-record is not installed.
  explicit FlightSaver(std::string directory);
  ~FlightSaver();
  FlightSaver(const FlightSaver&) = delete;
  FlightSaver& operator=(const FlightSaver&) = delete;

  bool is_busy() const noexcept { return pid_ > 0; }
  // Asks for a snapshot; not while it is busy. Throws std::system_error.
  void ask(const std::string& reason);
  // What became of it, once: "saved PATH (REASON)" or what went wrong.
  std::optional<std::string> poll();
  // The same; waits for it, as long as cie-record does.
  std::optional<std::string> wait();

 private:
  void check() const;
  std::optional<std::string> reap(int flags);

  std::string directory_;
  std::string program_;
  std::string reason_;
  pid_t pid_ = -1;
  int output_ = -1;
};

}  // namespace cie::cli
