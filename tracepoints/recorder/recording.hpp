// One recording from the first check to the manifest.
#pragma once

#include "flight_recorder.hpp"
#include "kernel_recording.hpp"
#include "manifest.hpp"
#include "options.hpp"
#include "relay_link.hpp"
#include "rotation.hpp"
#include "session_daemon.hpp"
#include "signals.hpp"
#include "tracing_session.hpp"

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace cie::record {

// A name that no session of this machine has had.
std::string new_session_name(const Options& options);

class Recording {
 public:
  // Creates the directory, finds or starts the daemon, starts the session. Throws UsageError if the
  // directory is taken, RecordError for the rest; leaves nothing behind then.
  explicit Recording(Options options);
  ~Recording();
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  // Runs the command, or waits for a signal; then stops, checks and writes the manifest. Prints
  // progress, warnings and the summary to standard error. True if everything was recorded or what
  // was lost is only discarded events, which are counted and printed.
  bool run();

 private:
  using Clock = std::chrono::steady_clock;

  void start_kernel();
  void start_reading();
  void state_snapshot_cost() const;
  void start_flight_recorder();
  void serve_flight_recorder(bool is_asked);
  void end_flight();
  void serve_rotation();
  void tell(const SavedSnapshot& snapshot);
  void create_directory();
  // Of a recording that cannot be: ends the session and removes the directory.
  void abandon() noexcept;
  void run_command();
  void wait_attached();
  void look_for_applications(Clock::time_point since, bool has_command);
  void watch_health();
  // Only with --to (recording_relay.cpp).
  std::shared_ptr<TracingSession> new_relayed_session();
  void watch_relay();
  void lose_relay();
  void find_relay_again();
  void finish_relayed();
  void finish();
  // What LTTng says of the session's end, but for its losses, which are added to the manifest's.
  std::vector<std::string> end_session();
  void end_kernel();
  void drop_kernel(const std::string& reason);
  void end_rotation();
  void note_nothing_recorded();
  void check_files();
  std::string kernel_in_words() const;
  void print_summary() const;
  std::string result_in_words() const;
  void show_progress();
  void warn(const std::string& text);
  void problem(const std::string& text);

  Signals signals_;
  Manifest manifest_;
  std::unique_ptr<SessionDaemon> daemon_;
  std::unique_ptr<RelayLink> relay_;         // null: not streamed
  std::shared_ptr<TracingSession> session_;  // shared with a thread that waits for LTTng; null
                                             // while the relay daemon is gone
  std::unique_ptr<KernelRecording> kernel_;  // null: no kernel events
  std::unique_ptr<FlightRecorder> flight_;   // null: everything is written
  std::unique_ptr<Rotation> rotation_;       // null: not divided
  bool is_directory_ours_ = false;
  bool is_daemon_lost_ = false;
  bool has_warned_of_registration_ = false;
  bool has_warned_of_others_ = false;
  bool has_warned_of_space_ = false;
  std::int64_t shown_seconds_ = -1;  // of the progress line; -1: none was shown
  std::uint64_t packets_ = 0;
  std::uint64_t snapshots_ = 0;  // saved by a flight recorder that has ended
  std::uint64_t left_out_ = 0;
  Clock::time_point began_ = Clock::now();
  Clock::time_point next_look_ = Clock::now();
  Clock::time_point next_check_ = Clock::now();
  Clock::time_point next_attempt_ = Clock::now();      // to find the relay daemon again
  Clock::time_point next_description_ = Clock::now();  // of traced processes, by themselves
};

}  // namespace cie::record
