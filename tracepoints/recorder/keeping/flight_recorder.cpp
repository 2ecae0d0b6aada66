#include "keeping/flight_recorder.hpp"

#include <cie/tracepoints/recording_layout.hpp>

#include "base/text.hpp"
#include "ctf/stream_check.hpp"
#include "keeping/chunk_names.hpp"
#include "keeping/manifest.hpp"
#include "system/error.hpp"
#include "system/instant.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <exception>
#include <fstream>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/statvfs.h>
#include <unistd.h>

namespace cie::record {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

constexpr const char* kLockFile = "recorder.pid";
constexpr const char* kReasonFile = ".reason";
constexpr const char* kRefusalFile = ".refusal";  // why nothing was saved
constexpr std::size_t kLongestReason = 500;
constexpr const char* kSharedMemory = "/dev/shm";
// Between an event that has something saved and the saving.
constexpr milliseconds kAftermath{250};
// What processes take to describe themselves. A description that comes later is in the next
// snapshot; the one made at their start is in this one unless a great many followed it.
constexpr milliseconds kDescription{200};
constexpr std::chrono::seconds kSnapshotPatience{30};
constexpr milliseconds kLook{20};

// The last one that is there; 0: none.
std::uint64_t last_number(const fs::path& directory) {
  std::uint64_t number = 0;
  while (fs::exists(snapshot_directory(directory, number + 1))) {
    ++number;
  }
  return number;
}

std::string in_words(const DeadlineMiss& miss) {
  return fmt::format(
      "callback {} missed its deadline: responded after {:.3f} ms instead of {:.3f} ms",
      miss.callback_id, static_cast<double>(miss.response_ns) * 1e-6,
      static_cast<double>(miss.deadline_ns) * 1e-6);
}

FileDescriptor take_lock(const fs::path& directory) {
  FileDescriptor file(
      open((directory / kLockFile).c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644));
  if (!file.is_open() || flock(file.get(), LOCK_EX | LOCK_NB) != 0) {
    throw system_error("cannot write " + in_quotes(directory / kLockFile), errno);
  }
  const std::string text = fmt::format("{}\n", getpid());
  if (write(file.get(), text.data(), text.size()) != static_cast<ssize_t>(text.size())) {
    throw system_error("cannot write " + in_quotes(directory / kLockFile), errno);
  }
  return file;
}

// Whole when it is there.
void put_file(const fs::path& file, const std::string& text) {
  const fs::path draft = file.string() + std::to_string(getpid());
  if (!(std::ofstream(draft) << text << std::flush)) {
    throw RecordError("cannot write " + in_quotes(draft));
  }
  fs::rename(draft, file);
}

// Whoever asks says why in a file that is there when the signal comes.
void leave_reason(const fs::path& directory, const std::string& reason) {
  std::error_code error;
  fs::remove(directory / kReasonFile, error);  // of somebody whose signal did not come
  if (reason.empty()) {
    return;
  }
  put_file(directory / kReasonFile, reason);
}

// One printable line, and not a long one.
std::string take_line(const fs::path& file) {
  std::string reason;
  std::getline(std::ifstream(file), reason);
  std::error_code ignored;
  fs::remove(file, ignored);
  reason.resize(std::min(reason.size(), kLongestReason));
  std::ranges::replace_if(
      reason, [](unsigned char c) { return c < ' ' || c == 0x7f; }, '?');
  return reason;
}

}  // namespace

SnapshotCost snapshot_cost(const Options& options) {
  const auto cpus = static_cast<std::uint64_t>(std::max(1L, sysconf(_SC_NPROCESSORS_CONF)));
  // One sub-buffer is always being emptied for the next events.
  const auto kept = static_cast<double>(options.subbuf_size * (options.num_subbuf - 1));
  SnapshotCost cost;
  cost.event_rate = kept / kBytesPerEvent /
                    std::chrono::duration<double>(options.snapshot.value().length).count();
  cost.bytes_per_cpu = buffer_bytes_per_cpu(options);
  cost.bytes = cost.bytes_per_cpu * cpus;
  struct statvfs space {};
  if (statvfs(kSharedMemory, &space) == 0) {
    cost.free_bytes = std::uint64_t{space.f_bavail} * space.f_frsize;
  }
  return cost;
}

FlightRecorder::FlightRecorder(const Options& options, std::shared_ptr<TracingSession> session,
                               std::unique_ptr<KernelSnapshots> kernel, const std::string& name,
                               ProcessWatch* processes)
    : options_(options.snapshot.value()),
      directory_(options.directory),
      session_(std::move(session)),
      kernel_(std::move(kernel)),
      processes_(processes),
      lock_(take_lock(directory_)),
      deadlines_(name) {}

FlightRecorder::~FlightRecorder() {
  std::error_code ignored;
  fs::remove(directory_ / kLockFile, ignored);
  fs::remove(directory_ / kRefusalFile, ignored);
}

void FlightRecorder::start_reading() {
  if (kernel_) kernel_->start_reading();
}

void FlightRecorder::look_for_misses() {
  if (const auto miss = deadlines_.poll()) {
    if (!due_ && may_save_unasked()) {
      due_ = Due{.time = Clock::now() + kAftermath, .reason = in_words(*miss)};
    } else if (!due_) {
      ++left_out_;
    }
  }
}

std::optional<SavedSnapshot> FlightRecorder::finish(const RecordingManifest& about) {
  look_for_misses();
  if (!due_) {
    return std::nullopt;
  }
  const Due due = *std::exchange(due_, std::nullopt);
  return save_unasked(due.reason, about);
}

std::optional<SavedSnapshot> FlightRecorder::poll(const RecordingManifest& about) {
  look_for_misses();
  if (!due_ || Clock::now() < due_->time) {
    return std::nullopt;
  }
  const Due due = *std::exchange(due_, std::nullopt);
  return save_unasked(due.reason, about);
}

bool FlightRecorder::may_save_unasked() const {
  return unasked_ < options_.most && (!last_ || Clock::now() - *last_ >= options_.least_interval);
}

std::optional<SavedSnapshot> FlightRecorder::save_unasked(const std::string& reason,
                                                          const RecordingManifest& about) {
  if (!may_save_unasked()) {
    ++left_out_;
    return std::nullopt;
  }
  ++unasked_;
  return save(reason, about);
}

SavedSnapshot FlightRecorder::save_on_command(const RecordingManifest& about) {
  const std::string why = take_line(directory_ / kReasonFile);
  try {
    return save(why.empty() ? "on command" : "on command: " + why, about);
  } catch (const std::exception& error) {
    put_file(directory_ / kRefusalFile, error.what());
    throw;
  }
}

SavedSnapshot FlightRecorder::save(const std::string& reason, const RecordingManifest& about) {
  last_ = Clock::now();
  const std::int64_t asked_ns = now().monotonic_ns;
  session_->describe_again();
  std::this_thread::sleep_for(kDescription);
  const fs::path draft = directory_ / ".saving";
  fs::remove_all(draft);
  RecordingManifest manifest = about;
  // Of those that ended, the buffers may hold nothing any more. Who did describe itself is there.
  manifest.processes.clear();
  if (processes_ != nullptr) {
    processes_->catch_up();
    manifest.processes = processes_->begun(asked_ns, now().monotonic_ns);
    manifest.names_all_processes = !processes_->has_missed();
  }
  try {
    // LTTng makes a directory of its own naming below the one it is given.
    session_->save_snapshot(draft);
    const auto inside = fs::directory_iterator(draft);
    const bool is_any = inside != fs::end(inside);
    const auto streams = is_any ? check_streams(draft) : std::vector<StreamSummary>();
    const bool is_anybody = processes_ != nullptr && processes_->count() > 0;
    if (streams.empty() || (!is_anybody && std::ranges::none_of(streams, has_events))) {
      throw RecordError("the snapshot is empty: nothing was recorded so far");
    }
    const fs::path written = inside->path();
    if (kernel_) {
      note_kernel(kernel_->save(written), manifest);
    }
    manifest.end = now();
    SavedSnapshot saved{.directory = snapshot_directory(directory_, saved_ + 1),
                        .reason = reason,
                        .held = held_by(streams)};
    manifest.snapshot = RecordedSnapshot{.reason = reason, .held_ns = saved.held.common.count()};
    write_manifest(written, manifest);
    fs::rename(written, saved.directory);
    fs::remove_all(draft);
    ++saved_;
    return saved;
  } catch (...) {
    std::error_code ignored;
    fs::remove_all(draft, ignored);
    throw;
  }
}

fs::path ask_to_save(const fs::path& directory, const std::string& reason) {
  const auto nobody = [&directory](const std::string& why) {
    return RecordError("nobody keeps snapshots in " + in_quotes(directory) + ": " + why);
  };
  const FileDescriptor lock(open((directory / kLockFile).c_str(), O_RDONLY | O_CLOEXEC));
  if (!lock.is_open()) {
    throw nobody("start `cie record --snapshot SECONDS -o DIR` first");
  }
  if (flock(lock.get(), LOCK_SH | LOCK_NB) == 0) {
    throw nobody("the recorder that did was killed");
  }
  leave_reason(directory, reason);
  pid_t pid = 0;
  std::ifstream(directory / kLockFile) >> pid;
  const std::uint64_t before = last_number(directory);
  std::error_code ignored;
  fs::remove(directory / kRefusalFile, ignored);  // of a signal that nobody waited for
  if (pid <= 0 || kill(pid, SIGUSR1) != 0) {
    throw system_error(fmt::format("cannot signal the recorder, process {}", pid), errno);
  }
  const auto deadline = std::chrono::steady_clock::now() + kSnapshotPatience;
  while (!fs::exists(snapshot_directory(directory, before + 1))) {
    if (fs::exists(directory / kRefusalFile)) {
      throw RecordError(fmt::format("the recorder, process {}, saved nothing: {}", pid,
                                    take_line(directory / kRefusalFile)));
    }
    if (std::chrono::steady_clock::now() > deadline) {
      throw RecordError(
          fmt::format("the recorder, process {}, saved nothing within half a minute", pid));
    }
    std::this_thread::sleep_for(kLook);
  }
  return snapshot_directory(directory, before + 1);
}

}  // namespace cie::record
