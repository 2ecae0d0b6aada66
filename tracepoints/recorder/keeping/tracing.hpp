// What every recording has, however it is kept: its directory, LTTng's daemon and session, and the
// processes that are recorded.
#pragma once

#include <cie/tracepoints/recording_manifest.hpp>

#include "lttng/consumer_daemons.hpp"
#include "lttng/process_watch.hpp"
#include "lttng/session_daemon.hpp"
#include "lttng/tracing_session.hpp"
#include "options/options.hpp"
#include "system/console.hpp"
#include "system/directory_claim.hpp"
#include "system/instant.hpp"
#include "target/registration.hpp"
#include "target/target.hpp"

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cie::record {

// Who keeps the recording says when each step is due. `manifest` collects what is to be said of it.
class Tracing {
 public:
  // Claims the directory. Throws UsageError if it is taken, RecordError if it cannot be written.
  Tracing(const Options& options, Console& console);
  Tracing(const Tracing&) = delete;
  Tracing& operator=(const Tracing&) = delete;

  // In this order, and throwing RecordError; abandon() then leaves nothing behind.
  void start_daemon();
  void create_session();  // which writes into the directory, or keeps snapshots in memory
  void create_session(const RelayDestination& destination);
  void watch_processes();
  void start();

  // Of a recording that cannot be: ends what there is and removes the directory.
  void abandon() noexcept;

  // While it goes on. Whether a process began since the last call; those are in processes().
  bool poll_processes();
  // The same; the manifest names them.
  void note_processes();
  // Whether anybody is recorded.
  void look_for_applications(Target& target);
  // LTTng has not answered that yet: nobody else may ask it.
  bool is_asking() const noexcept { return registration_.is_asking(); }
  // Whether the daemons are alive is looked at every second: true then, if the session daemon is.
  bool has_checked_daemon();
  // Warns of a disk that is almost full; a full one is a problem of the manifest.
  void check_space();
  // Shows how it goes on. What is attached to is over when nothing is recorded of it any more.
  void end_tick(Target& target);

  // Somebody asks for a snapshot of what is written anyway.
  void refuse_snapshot();

  // Waits for what LTTng was asked and did not answer: what is asked at the end would wait for it, too.
  // Its daemon is lost if it does not.
  void settle();
  // The end. From here on nobody is named who begins.
  void begin_end() { ending_ = now(); }
  // The same, and ends the session unless its daemon is lost. Problems are the manifest's.
  void end();
  // Stops and destroys the session. The manifest has what was lost; what went wrong is returned.
  std::vector<std::string> end_session();
  // How long to wait for LTTng's answer at the end: where it cannot write, there may be none.
  std::chrono::seconds patience() const;
  // LTTng did not answer for so long. Its daemon is lost then: what it did not write is. Returns what
  // is to be said of it.
  std::string give_up_daemon(std::string_view what, std::chrono::seconds patience);
  // LTTng told of no application that began, or described itself, while it went on. Waits until all is told
  // that there is to tell.
  bool is_nobody_told_of();
  void note_nothing_recorded();
  // Still the one that was claimed; a problem of the manifest, if not. Then nothing can be looked at or written there.
  bool is_directory_there();
  // Lets the daemon go, and the session if there still is one.
  void close();
  void release_directory() noexcept { claim_.release(); }

  RecordingManifest manifest;
  Console& console;

  const Options& options() const noexcept { return options_; }
  // That of the options, as it was claimed.
  const Directory& directory() const noexcept { return claim_.directory(); }
  // Shared with a thread that waits for LTTng; null while there is none.
  const std::shared_ptr<TracingSession>& session() const noexcept { return session_; }
  void drop_session() noexcept { session_.reset(); }
  ProcessWatch* processes() const noexcept { return processes_.get(); }  // null: LTTng refuses
  bool is_daemon_lost() const noexcept { return is_daemon_lost_; }
  // When begin_end() was called.
  const Instant& ending() const { return ending_.value(); }

 private:
  using Clock = std::chrono::steady_clock;

  void note_running(const Target& target);
  // A warning, and a problem of the manifest: that daemon ended, so nothing more is recorded.
  void note_end_of(const std::string& daemon);

  Options options_;
  DirectoryClaim claim_;
  std::unique_ptr<SessionDaemon> daemon_;
  ConsumerDaemons consumers_;
  std::unique_ptr<ProcessWatch> processes_;
  std::shared_ptr<TracingSession> session_;
  Registration registration_;
  std::optional<Instant> ending_;  // empty: it goes on
  bool has_noted_first_ = false;   // of those that registered
  std::size_t told_ = 0;           // how many processes LTTng told of when it was asked last
  bool is_daemon_lost_ = false;
  bool is_consumer_lost_ = false;  // the session daemon still answers
  bool has_warned_of_space_ = false;
  bool has_noted_full_disk_ = false;
  Clock::time_point next_check_ = Clock::now();
};

}  // namespace cie::record
