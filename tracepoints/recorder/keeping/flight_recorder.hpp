// Saves what a session keeps in memory: on command, and unasked when something happened.
#pragma once

#include <cie/tracepoints/recording_manifest.hpp>

#include "base/directory.hpp"
#include "base/file_descriptor.hpp"
#include "ctf/stream_check.hpp"
#include "keeping/kernel_snapshots.hpp"
#include "lttng/deadline_watch.hpp"
#include "lttng/process_watch.hpp"
#include "lttng/tracing_session.hpp"

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <string>

namespace cie::record {

// Memory that a session of these options takes for its buffers, in bytes.
struct SnapshotCost {
  double event_rate = 0;  // events per second and CPU that it lasts for
  std::uint64_t bytes_per_cpu = 0;
  std::uint64_t bytes = 0;       // on all CPUs
  std::uint64_t free_bytes = 0;  // where LTTng puts them, /dev/shm
};
SnapshotCost snapshot_cost(const Options& options);

// One snapshot that was saved: a recording of its own.
struct SavedSnapshot {
  std::filesystem::path directory;
  std::string reason;
  HeldTime held;  // of the time before it
};

// Snapshots are DIR/snapshot-001, -002, …; each appears when it is complete. They are saved one after
// the other on a thread of their own, so that nobody waits for LTTng. Meanwhile the session and the
// process watch are that thread's.
class FlightRecorder {
 public:
  // Whoever asks `cie record --save DIR` finds this process by a lock in `directory`, which is
  // borrowed. `kernel` is null where no kernel events are kept; `processes`, borrowed, where nobody
  // tells which there are. Throws RecordError.
  FlightRecorder(const Options& options, const Directory& directory,
                 std::shared_ptr<TracingSession> session, std::unique_ptr<KernelSnapshots> kernel,
                 const std::string& name, ProcessWatch* processes);
  ~FlightRecorder();
  FlightRecorder(const FlightRecorder&) = delete;
  FlightRecorder& operator=(const FlightRecorder&) = delete;

  // Starts the thread that reads kernel events. Apart from the constructor, so that a command can
  // be started in between, from a process of one thread.
  void start_reading();
  // Somebody asks for a snapshot (ask_to_save(), SIGUSR1): it is saved whatever the limits are.
  void request() noexcept { ++requested_; }
  // Begins to save what was asked for, or if a deadline was missed, a moment later, so that what
  // follows it is there too. Returns what is saved by now, once. `about` is what the snapshot's
  // manifest says besides. Throws RecordError if it could not be saved.
  std::optional<SavedSnapshot> poll(const RecordingManifest& about);
  bool is_saving() const noexcept { return saving_.valid(); }
  // Waits for what is being saved: poll() returns it then.
  void settle() const noexcept {
    if (saving_.valid()) saving_.wait();
  }
  // At the end: the next of what is being saved, was asked for, has `failure` as its reason (unless
  // that is empty), or is due as a deadline was missed shortly before. Waits for it; empty: nothing
  // is left. Throws as poll() does.
  std::optional<SavedSnapshot> finish(const RecordingManifest& about, const std::string& failure);

  std::uint64_t saved() const noexcept { return saved_; }
  // How often something happened for which the limits let nothing be saved.
  std::uint64_t left_out() const noexcept { return left_out_; }
  // Snapshots hold the kernel's events, too.
  bool has_kernel_events() const noexcept { return kernel_ != nullptr; }

 private:
  using Clock = std::chrono::steady_clock;
  struct Due {
    Clock::time_point time;
    std::string reason;
  };

  bool may_save_unasked() const;
  void look_for_misses();
  void begin_unasked(const std::string& reason, const RecordingManifest& about);
  void begin_asked(const RecordingManifest& about);
  void begin(const std::string& reason, const RecordingManifest& about);
  SavedSnapshot end();
  SavedSnapshot save(const std::string& reason, RecordingManifest manifest,
                     const std::string& name);

  SnapshotOptions options_;
  SnapshotPace pace_;
  const Directory& directory_;
  std::shared_ptr<TracingSession> session_;
  std::unique_ptr<KernelSnapshots> kernel_;
  ProcessWatch* processes_;
  FileDescriptor lock_;
  DeadlineWatch deadlines_;
  std::optional<Due> due_;
  std::optional<Clock::time_point> last_;
  std::uint64_t requested_ = 0;
  bool is_asked_ = false;    // what is being saved
  bool has_failed_ = false;  // `failure` of finish() is dealt with
  std::uint64_t saved_ = 0;
  std::uint64_t unasked_ = 0;
  std::uint64_t left_out_ = 0;
  std::future<SavedSnapshot> saving_;  // last: its thread uses the others
};

// Has the recorder that keeps snapshots in `directory` save one, and returns where it is. `reason`
// is for its manifest; empty: none. Throws RecordError if there is no recorder, or it does not do
// it within half a minute; UsageError if others could have made the directory what it is.
std::filesystem::path ask_to_save(const std::filesystem::path& directory,
                                  const std::string& reason);

}  // namespace cie::record
