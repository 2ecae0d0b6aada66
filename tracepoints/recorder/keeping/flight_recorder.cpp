#include "keeping/flight_recorder.hpp"

#include <cie/tracepoints/recording_layout.hpp>

#include "base/file.hpp"
#include "base/text.hpp"
#include "ctf/stream_check.hpp"
#include "keeping/chunk_names.hpp"
#include "keeping/manifest.hpp"
#include "system/directory_claim.hpp"
#include "system/error.hpp"
#include "system/instant.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <exception>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/statvfs.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace cie::record {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

constexpr const char* kLockFile = "recorder.pid";
constexpr const char* kDraft = ".saving";
constexpr const char* kReasonFile = ".reason";
constexpr const char* kRefusalFile = ".refusal";  // why nothing was saved
constexpr std::size_t kLongestReason = 500;
constexpr const char* kEmpty = "the snapshot is empty: nothing was recorded so far";
constexpr const char* kSharedMemory = "/dev/shm";
constexpr std::chrono::seconds kSnapshotPatience{30};
constexpr milliseconds kLook{20};

// The last one that is there; 0: none.
std::uint64_t last_number(const Directory& directory) {
  std::uint64_t number = 0;
  while (directory.has(snapshot_directory({}, number + 1).string())) {
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

struct flock whole_file(short type) noexcept {
  struct flock lock {};
  lock.l_type = type;
  lock.l_whence = SEEK_SET;
  return lock;
}

// Of this process alone, and gone with it: unlike flock(), the kernel says who has it.
FileDescriptor take_lock(const Directory& directory) {
  FileDescriptor file = directory.create(kLockFile, 0644);
  const struct flock lock = whole_file(F_WRLCK);
  if (fcntl(file.get(), F_SETLK, &lock) != 0)
    throw system_error("cannot lock " + in_quotes(directory.path() / kLockFile), errno);
  write_all(file, fmt::format("{}\n", getpid()));  // for people
  return file;
}

// Of the process that has the lock; empty: none has. 0: it cannot be seen from this PID namespace.
std::optional<pid_t> owner_of(const FileDescriptor& lock_file) {
  struct flock lock = whole_file(F_RDLCK);
  if (fcntl(lock_file.get(), F_GETLK, &lock) != 0) throw system_error("fcntl", errno);
  return lock.l_type == F_UNLCK ? std::nullopt : std::optional(std::max(lock.l_pid, 0));
}

RecordError nobody_keeps(const fs::path& directory, const std::string& why) {
  return RecordError("nobody keeps snapshots in " + in_quotes(directory) + ": " + why);
}

constexpr const char* kStartOne = "start `cie record --snapshot SECONDS -o DIR` first";

// The recorder that keeps snapshots in a directory.
class Recorder {
 public:
  // Throws RecordError if there is none.
  explicit Recorder(const Directory& directory) {
    const FileDescriptor lock(
        openat(directory.get(), kLockFile, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
    if (!lock.is_open()) throw nobody_keeps(directory.path(), kStartOne);
    const auto owner = owner_of(lock);
    pid_ = owner.value_or(0);
    if (owner && pid_ == 0) {
      throw RecordError("the recorder that keeps snapshots in " + in_quotes(directory.path()) +
                        " is in another PID namespace: ask it there");
    }
    if (owner) process_ = FileDescriptor(static_cast<int>(syscall(SYS_pidfd_open, pid_, 0)));
    // Whoever has it after the process was opened is that process.
    if (!process_.is_open() || owner_of(lock) != owner) {
      throw nobody_keeps(directory.path(), "the recorder that did was killed");
    }
  }

  // Has it save something. Throws RecordError.
  void signal() const {
    if (syscall(SYS_pidfd_send_signal, process_.get(), SIGUSR1, nullptr, 0) != 0)
      throw system_error("cannot signal the recorder, " + name(), errno);
  }
  std::string name() const { return fmt::format("process {}", pid_); }

 private:
  pid_t pid_ = 0;
  FileDescriptor process_;
};

// One printable line, and not a long one; empty: there is none. Taken away.
std::string take_line(const Directory& directory, const char* name) {
  std::string line = directory.read(name, kLongestReason).value_or("");
  directory.remove(name);
  line.resize(std::min(line.size(), line.find('\n')));
  std::ranges::replace_if(
      line, [](unsigned char c) { return c < ' ' || c == 0x7f; }, '?');
  return line;
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

FlightRecorder::FlightRecorder(const Options& options, const Directory& directory,
                               std::shared_ptr<TracingSession> session,
                               std::unique_ptr<KernelSnapshots> kernel, const std::string& name,
                               ProcessWatch* processes)
    : options_(options.snapshot.value()),
      pace_(pace_of(options_.length)),
      directory_(directory),
      session_(std::move(session)),
      kernel_(std::move(kernel)),
      processes_(processes),
      lock_(take_lock(directory_)),
      deadlines_(name) {}

FlightRecorder::~FlightRecorder() {
  settle();
  for (const char* file : {kLockFile, kRefusalFile})
    static_cast<void>(!unlinkat(directory_.get(), file, 0));
}

void FlightRecorder::start_reading() {
  if (kernel_) kernel_->start_reading();
}

void FlightRecorder::look_for_misses() {
  if (const auto miss = deadlines_.poll()) {
    if (!due_ && may_save_unasked()) {
      due_ = Due{.time = Clock::now() + pace_.aftermath, .reason = in_words(*miss)};
    } else if (!due_) {
      ++left_out_;
    }
  }
}

std::optional<SavedSnapshot> FlightRecorder::poll(const RecordingManifest& about) {
  look_for_misses();
  if (is_saving()) {
    if (saving_.wait_for(milliseconds(0)) != std::future_status::ready) return std::nullopt;
    return end();
  }
  if (requested_ > 0) {
    begin_asked(about);
  } else if (due_ && Clock::now() >= due_->time) {
    begin_unasked(std::exchange(due_, std::nullopt)->reason, about);
  }
  return std::nullopt;
}

std::optional<SavedSnapshot> FlightRecorder::finish(const RecordingManifest& about,
                                                    const std::string& failure) {
  if (!is_saving() && requested_ > 0) begin_asked(about);
  if (!is_saving() && !failure.empty() && !std::exchange(has_failed_, true)) {
    due_.reset();  // it is in there, too
    begin_unasked(failure, about);
  }
  if (!is_saving() && failure.empty()) {
    look_for_misses();
    if (due_) begin_unasked(std::exchange(due_, std::nullopt)->reason, about);
  }
  return is_saving() ? std::optional(end()) : std::nullopt;
}

bool FlightRecorder::may_save_unasked() const {
  return unasked_ < options_.most && (!last_ || Clock::now() - *last_ >= options_.least_interval);
}

void FlightRecorder::begin_unasked(const std::string& reason, const RecordingManifest& about) {
  if (!may_save_unasked()) {
    ++left_out_;
    return;
  }
  ++unasked_;
  begin(reason, about);
}

void FlightRecorder::begin_asked(const RecordingManifest& about) {
  --requested_;
  const std::string why = take_line(directory_, kReasonFile);
  begin(why.empty() ? "on command" : "on command: " + why, about);
  is_asked_ = true;
}

void FlightRecorder::begin(const std::string& reason, const RecordingManifest& about) {
  last_ = Clock::now();
  is_asked_ = false;
  saving_ = std::async(std::launch::async, &FlightRecorder::save, this, reason, about,
                       snapshot_directory({}, saved_ + 1).string());
}

SavedSnapshot FlightRecorder::end() {
  try {
    SavedSnapshot saved = saving_.get();
    ++saved_;
    return saved;
  } catch (const std::exception& error) {
    if (is_asked_) directory_.put(kRefusalFile, error.what());
    throw;
  }
}

SavedSnapshot FlightRecorder::save(const std::string& reason, RecordingManifest manifest,
                                   const std::string& name) {
  const std::int64_t asked_ns = now().monotonic_ns;
  session_->describe_again();
  std::this_thread::sleep_for(pace_.description);
  const std::int64_t until_ns = now().monotonic_ns;
  const fs::path draft = directory_.way() / kDraft;
  fs::remove_all(draft);
  try {
    // LTTng makes a directory of its own naming below the one it is given.
    session_->save_snapshot(directory_.path() / kDraft);
    const auto inside = fs::directory_iterator(draft);
    const bool is_any = inside != fs::end(inside);
    const auto streams = is_any ? check_streams(draft) : std::vector<StreamSummary>();
    if (streams.empty()) throw RecordError(kEmpty);
    const Directory written = directory_.below(kDraft).below(inside->path().filename().string());
    if (kernel_) note_kernel(kernel_->save(written), manifest);  // of the same moment
    // Of those that ended, the buffers may hold nothing any more. Who did describe itself is there.
    manifest.processes.clear();
    if (processes_ != nullptr) {
      processes_->catch_up();
      manifest.processes = processes_->begun(asked_ns, until_ns);
      manifest.names_all_processes = !processes_->has_missed();
    }
    const bool is_anybody = processes_ != nullptr && processes_->count() > 0;
    if (!is_anybody && std::ranges::none_of(streams, has_events)) throw RecordError(kEmpty);
    manifest.end = now();
    SavedSnapshot saved{
        .directory = directory_.path() / name, .reason = reason, .held = held_by(streams)};
    manifest.snapshot = RecordedSnapshot{.reason = reason, .held_ns = saved.held.common.count()};
    write_manifest(written, std::move(manifest));
    fs::rename(inside->path(), directory_.way() / name);
    fs::remove_all(draft);
    return saved;
  } catch (...) {
    std::error_code ignored;
    fs::remove_all(draft, ignored);
    throw;
  }
}

fs::path ask_to_save(const fs::path& path, const std::string& reason) {
  std::error_code ignored;
  if (!fs::exists(path, ignored)) throw nobody_keeps(path, kStartOne);
  const Directory directory = open_own(path);
  const Recorder recorder(directory);
  directory.remove(kReasonFile);  // of somebody whose signal did not come
  // There when the signal comes.
  if (!reason.empty()) directory.put(kReasonFile, reason);
  const std::uint64_t before = last_number(directory);
  directory.remove(kRefusalFile);  // of a signal that nobody waited for
  recorder.signal();
  const fs::path wanted = snapshot_directory({}, before + 1);
  const auto deadline = std::chrono::steady_clock::now() + kSnapshotPatience;
  while (!directory.has(wanted.string())) {
    if (directory.has(kRefusalFile)) {
      throw RecordError(fmt::format("the recorder, {}, saved nothing: {}", recorder.name(),
                                    take_line(directory, kRefusalFile)));
    }
    if (std::chrono::steady_clock::now() > deadline) {
      throw RecordError(
          fmt::format("the recorder, {}, saved nothing within half a minute", recorder.name()));
    }
    std::this_thread::sleep_for(kLook);
  }
  return path / wanted;
}

}  // namespace cie::record
