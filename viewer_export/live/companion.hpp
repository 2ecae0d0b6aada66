// cie-record, started to trace a command or what runs already and to offer it as a live session.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include <sys/types.h>

namespace cie::live {

class Companion {
 public:
  // Forks and calls `become`, which must replace the process by cie-record with the socket's number
  // as "--live-socket"; it may throw. `is_silent`: what it and the command print is kept (its last
  // part: output()); otherwise all of it goes to standard error. Create it before any thread.
  // Throws std::system_error.
  Companion(const std::function<void(int socket)>& become, bool is_silent);
  ~Companion() { end(); }
  Companion(const Companion&) = delete;
  Companion& operator=(const Companion&) = delete;

  // Waits for the session. Throws std::runtime_error if there will be none.
  std::string wait_for_url();
  // The reader is about to connect, or has: the tracing and the command may begin.
  void start();
  void signal(int number) const noexcept;
  // Ends it, and the command, and receives its last words. It is killed if that takes long.
  void end() noexcept;

  // To poll for; -1 when there is nothing to wait for.
  int socket() const noexcept { return socket_; }
  int output_descriptor() const noexcept { return output_; }
  void receive();

  // What it told: how many applications are traced; how the command ended; what was lost.
  std::optional<std::uint64_t> applications() const noexcept { return applications_; }
  const std::string& command_end() const noexcept { return command_end_; }
  // What the user should know, as it comes; empty if there is nothing new.
  std::optional<std::string> take_note();
  // Why it cannot go on; empty if it can, or ended as it should.
  const std::string& failure() const noexcept { return failure_; }
  const std::string& losses() const noexcept { return losses_; }
  // The last part of what it printed, if it is silent.
  const std::string& output() const noexcept { return printed_; }

 private:
  void receive_output();
  void take_lines();
  void take(std::string_view line);

  pid_t pid_ = -1;
  int socket_ = -1;
  int output_ = -1;
  std::string buffer_;
  std::string url_;
  std::string printed_;
  std::optional<std::uint64_t> applications_;
  std::string command_end_;
  std::string losses_;
  std::string failure_;
  std::deque<std::string> notes_;
};

}  // namespace cie::live
