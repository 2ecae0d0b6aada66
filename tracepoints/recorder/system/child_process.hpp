// A program started by the recorder, without a shell.
#pragma once

#include <cie/tracepoints/recording_manifest.hpp>

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <sys/types.h>

namespace cie::record {

// How a process ended.
using ExitStatus = RecordedExit;

struct ChildOptions {
  std::vector<std::pair<std::string, std::string>> environment;  // added to the recorder's
  bool is_detached = false;       // own session, so that the terminal's Ctrl-C passes it by
  bool dies_with_parent = false;  // gets SIGTERM when the recorder is gone, however it went
  // Ignores SIGXFSZ: a write beyond the limit of a file's size fails, and does not end it.
  bool outlives_file_limit = false;
  std::filesystem::path log_file;  // for its output; empty: the recorder's output
};

// A child that has not been waited for yet is left alone by the destructor.
class ChildProcess {
 public:
  // Throws RecordError naming the program if it cannot be executed. Signals are unblocked in it.
  ChildProcess(const std::vector<std::string>& command, const ChildOptions& options);

  pid_t pid() const noexcept { return pid_; }
  // Empty while it runs. Never blocks.
  std::optional<ExitStatus> poll();
  // Sends a signal unless it has ended.
  void kill(int signal) noexcept;

  // The same as poll() tells, without waiting for it: its number, which is its group's if it is
  // detached, stays its own.
  bool has_ended() const noexcept;
  // Of a detached one that poll() has not seen end: waits for its end and that of the whole group
  // that it leads, for so long, and ends by force what is left then.
  void end_group(std::chrono::milliseconds patience) noexcept;

 private:
  pid_t pid_ = -1;
  std::optional<ExitStatus> status_;
};

}  // namespace cie::record
