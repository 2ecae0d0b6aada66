// Whom a recording is of: a command that the recorder starts, or what runs already.
#pragma once

#include "options/options.hpp"
#include "system/child_process.hpp"
#include "system/group_witness.hpp"
#include "system/signals.hpp"
#include "target/escalation.hpp"

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include <sys/types.h>

namespace cie::record {

class Target {
 public:
  enum class Event { tick, request };  // request: SIGUSR1

  // Listens to signals from here on: create it before any thread.
  explicit Target(const Options& options);

  // Starts the command, if it is one. Throws RecordError if it cannot be executed.
  void start();
  // Waits for a signal, a tenth of a second at most (for short snapshots, less). A command is passed
  // the signals that end programs, unless its group was sent them (by the terminal, by killpg()); one
  // that goes on is made to end when it is asked again (Escalation). To what is attached to they mean
  // that it is over. Empty when it is: the command ended, a signal came, or the time is up.
  std::optional<Event> next();
  // Of a command that goes on though it was asked to end: what happens to it, once.
  std::optional<std::string> take_news() noexcept { return std::exchange(news_, std::nullopt); }
  // Passes a command the signal; what is attached to is over.
  void interrupt(int signal) noexcept;
  // Nobody waits for it any longer: sends a command SIGTERM, and later SIGKILL if it goes on. What
  // is attached to is over.
  void end() noexcept;

  bool is_command() const noexcept { return !options_.command.empty(); }
  // Of the command that was started.
  pid_t pid() const { return command_.value().pid(); }
  // Empty: it runs, or is no command.
  std::optional<ExitStatus> exit();
  // Somebody is recorded: what is attached to is recorded for its duration from now on, and at the
  // latest from when patience with applications that register ends.
  void note_registered() noexcept;
  // Since start().
  std::chrono::steady_clock::duration age() const noexcept {
    return std::chrono::steady_clock::now() - began_;
  }

 private:
  // By cie live, which keeps nothing.
  bool is_watched_live() const noexcept { return options_.live_socket >= 0; }
  void pass_on(const ReceivedSignal& signal);
  bool has_command_got(const ReceivedSignal& signal);
  void escalate(Escalation::Step step);

  Options options_;
  std::chrono::milliseconds tick_;
  Signals signals_;
  std::optional<GroupWitness> witness_;                           // of a command's group
  std::map<int, Escalation::Clock::time_point> group_signalled_;  // by signal, last
  std::optional<ChildProcess> command_;
  Escalation escalation_;  // of the command
  std::optional<std::string> news_;
  bool is_interrupted_ = false;  // what is attached to
  std::chrono::steady_clock::time_point began_{};
  std::optional<std::chrono::steady_clock::time_point> counted_from_{};
  std::chrono::steady_clock::duration left() const noexcept;  // of the duration
};

}  // namespace cie::record
