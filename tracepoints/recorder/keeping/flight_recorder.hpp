// Saves what a session keeps in memory: on command, and unasked when something happened.
#pragma once

#include <cie/tracepoints/recording_manifest.hpp>

#include "base/file_descriptor.hpp"
#include "ctf/stream_check.hpp"
#include "keeping/kernel_snapshots.hpp"
#include "lttng/deadline_watch.hpp"
#include "lttng/process_watch.hpp"
#include "lttng/tracing_session.hpp"

#include <chrono>
#include <cstdint>
#include <filesystem>
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

// Snapshots are DIR/snapshot-001, -002, …; each appears when it is complete.
class FlightRecorder {
 public:
  // DIR exists; whoever asks `cie record --save DIR` finds this process by it. `kernel` is null
  // where no kernel events are kept; `processes`, borrowed, where nobody tells which there are.
  // Throws RecordError.
  FlightRecorder(const Options& options, std::shared_ptr<TracingSession> session,
                 std::unique_ptr<KernelSnapshots> kernel, const std::string& name,
                 ProcessWatch* processes);
  ~FlightRecorder();
  FlightRecorder(const FlightRecorder&) = delete;
  FlightRecorder& operator=(const FlightRecorder&) = delete;

  // Starts the thread that reads kernel events. Apart from the constructor, so that a command can
  // be started in between, from a process of one thread.
  void start_reading();
  // Saves if a deadline was missed, a moment later, so that what follows it is there too. `about`
  // is what the snapshot's manifest says besides. Throws RecordError.
  std::optional<SavedSnapshot> poll(const RecordingManifest& about);
  // Once, at the end: saves if a deadline was missed shortly before.
  std::optional<SavedSnapshot> finish(const RecordingManifest& about);
  // Because it was asked for (ask_to_save(), SIGUSR1), whatever the limits are.
  SavedSnapshot save_on_command(const RecordingManifest& about);
  // Unasked, unless the limits forbid it.
  std::optional<SavedSnapshot> save_unasked(const std::string& reason,
                                            const RecordingManifest& about);

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
  SavedSnapshot save(const std::string& reason, const RecordingManifest& about);

  SnapshotOptions options_;
  std::filesystem::path directory_;
  std::shared_ptr<TracingSession> session_;
  std::unique_ptr<KernelSnapshots> kernel_;
  ProcessWatch* processes_;
  FileDescriptor lock_;
  DeadlineWatch deadlines_;
  std::optional<Due> due_;
  std::optional<Clock::time_point> last_;
  std::uint64_t saved_ = 0;
  std::uint64_t unasked_ = 0;
  std::uint64_t left_out_ = 0;
};

// Has the recorder that keeps snapshots in `directory` save one, and returns where it is. `reason`
// is for its manifest; empty: none. Throws RecordError if there is no recorder, or it does not do
// it within half a minute.
std::filesystem::path ask_to_save(const std::filesystem::path& directory,
                                  const std::string& reason);

}  // namespace cie::record
