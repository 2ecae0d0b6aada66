// The LTTng session daemon a recording talks to: found, or started and stopped.
#pragma once

#include "base/file_descriptor.hpp"
#include "options/options.hpp"
#include "system/child_process.hpp"
#include "system/temporary_directory.hpp"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include <sys/types.h>

namespace cie::record {

class SessionDaemon {
 public:
  // Own: starts a daemon with a run-time directory of its own, which the environment of this
  // process (LTTNG_HOME) then names, for liblttng-ctl and the command. LTTng has one fixed
  // directory for root: this process and the command then get a mount namespace in which that is
  // private. own_if_possible falls back to shared where the kernel forbids it.
  // Shared: uses the one that runs, or starts one. Several recorders may share it: the last one
  // stops it, if a recorder started it and nobody else has a session there.
  // Throws RecordError.
  explicit SessionDaemon(DaemonChoice choice);
  ~SessionDaemon();
  SessionDaemon(const SessionDaemon&) = delete;
  SessionDaemon& operator=(const SessionDaemon&) = delete;

  bool is_alive() const;
  // Of the daemon that answers; 0 where that cannot be told, as of one in another pid namespace.
  pid_t pid() const;

  // For a daemon that does not answer any more: kills it and its consumer daemons if this object
  // started them, and lets go of it otherwise. The destructor then leaves it alone.
  void abandon() noexcept;
  // Nothing was recorded that would have to be written out: the destructor does not wait long.
  void give_up() noexcept { has_given_up_ = true; }

 private:
  void start_own();
  void find_or_start_shared();
  void start(const std::filesystem::path& log_file, bool is_own);
  void yield_to_another();
  void stop() noexcept;
  void abandon_process() noexcept;
  void stop_if_unused() noexcept;

  DaemonChoice choice_;
  std::optional<TemporaryDirectory> home_;  // own
  std::optional<ChildProcess> process_;
  bool has_given_up_ = false;
  FileDescriptor lock_;
};

}  // namespace cie::record
