#include "recording.hpp"

#include <cie/tracepoints/ros2_profile.hpp>
#include <cie/tracepoints/schema.hpp>

#include "error.hpp"
#include "processes.hpp"
#include "stream_check.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <functional>
#include <future>
#include <iterator>
#include <thread>
#include <utility>

#include <sys/stat.h>
#include <unistd.h>

namespace cie::record {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr milliseconds kTick{100};
constexpr milliseconds kLookInterval{200};
constexpr seconds kCheckInterval{1};
constexpr std::uintmax_t kLowSpace = 64 << 20;
constexpr std::uintmax_t kNoSpace = 1 << 20;
constexpr seconds kPatience{150};
constexpr seconds kPatienceOnAFullDisk{5};

// What LTTng says at the end of a session.
struct Ending {
  std::vector<ChannelLoss> losses;
  std::vector<std::string> problems;
};

void attempt(std::vector<std::string>& problems, const std::function<void()>& step) {
  try {
    step();
  } catch (const std::exception& error) {
    problems.emplace_back(error.what());
  }
}

// Every step is tried whatever became of the one before: a partial recording is worth keeping.
Ending end(TracingSession& session) {
  Ending ending;
  attempt(ending.problems, [&] {
    if (!session.stop()) {
      ending.problems.emplace_back("the last buffers were not written within a minute");
    }
  });
  attempt(ending.problems, [&] { ending.losses = session.losses(); });
  attempt(ending.problems, [&] { session.destroy(); });
  return ending;
}

void add(const std::vector<ChannelLoss>& losses, std::vector<ChannelLoss>& sum) {
  for (const ChannelLoss& loss : losses) {
    const auto known = std::ranges::find(sum, loss.name, &ChannelLoss::name);
    if (known == sum.end()) {
      sum.push_back(loss);
    } else {
      known->discarded_events += loss.discarded_events;
      known->lost_packets += loss.lost_packets;
    }
  }
}

bool is_interrupt(int signal) {
  return signal == SIGINT || signal == SIGTERM || signal == SIGHUP || signal == SIGQUIT;
}

}  // namespace

std::string new_session_name(const Options& options) {
  const std::string kind = options.snapshot ? std::string(kSnapshotSession) : "cie-record";
  return kind + '-' + std::to_string(getpid()) + '-' + std::to_string(now().realtime_ns);
}

Recording::Recording(Options options) {
  manifest_.options = std::move(options);
  create_directory();
  try {
    if (manifest_.options.relay) {
      relay_ = std::make_unique<RelayLink>(*manifest_.options.relay);
    }
    daemon_ = std::make_unique<SessionDaemon>(manifest_.options.daemon);
    state_snapshot_cost();
    manifest_.session = new_session_name(manifest_.options);
    session_ = relay_ ? new_relayed_session()
                      : std::make_shared<TracingSession>(manifest_.session, manifest_.options);
    start_kernel();
    start_flight_recorder();
    manifest_.begin = now();
    session_->start();
    if (manifest_.options.rotate) {
      rotation_ = std::make_unique<Rotation>(manifest_.options, session_, kernel_.get());
    }
  } catch (...) {
    abandon();
    throw;
  }
}

Recording::~Recording() = default;

// Before the first user event, so that no instance begins without its thread's record.
void Recording::start_kernel() {
  const Options& options = manifest_.options;
  if (options.kernel == KernelChoice::no || options.snapshot) {
    return;
  }
  try {
    kernel_ = std::make_unique<KernelRecording>(
        options.rotate ? kernel_part_directory(options.directory, 1) : options.directory / "kernel",
        open_kernel_source(options.kernel_route, options.kernel_buffer_size),
        options.flush_interval);
  } catch (const RecordError& error) {
    if (options.kernel == KernelChoice::yes) {
      throw RecordError(std::string("--kernel=yes: ") + error.what());
    }
    drop_kernel(error.what());
  }
}

void Recording::create_directory() {
  const fs::path& directory = manifest_.options.directory;
  std::error_code error;
  if (fs::exists(fs::symlink_status(directory, error))) {
    if (!fs::is_directory(directory, error) || !fs::is_empty(directory, error) || error) {
      throw UsageError(in_quotes(directory) +
                       " exists already: a recording never overwrites; choose another -o DIR");
    }
  } else {
    fs::create_directories(directory.parent_path(), error);
    if (error || mkdir(directory.c_str(), 0777) != 0) {
      throw system_error("cannot create " + in_quotes(directory), error ? error.value() : errno);
    }
    is_directory_ours_ = true;
  }
  if (access(directory.c_str(), W_OK | X_OK) != 0) {
    throw system_error("cannot write to " + in_quotes(directory), errno);
  }
}

void Recording::abandon() noexcept {
  rotation_.reset();
  flight_.reset();
  kernel_.reset();
  session_.reset();
  daemon_.reset();
  std::error_code ignored;  // the reason for the removal is what the user is told
  if (is_directory_ours_) {
    fs::remove_all(manifest_.options.directory, ignored);
  }
}

bool Recording::run() {
  began_ = Clock::now();
  if (manifest_.options.is_attach()) {
    wait_attached();
  } else {
    try {
      run_command();
    } catch (const RecordError&) {  // the command could not be run: there is nothing to keep
      abandon();
      throw;
    }
  }
  finish();
  print_summary();
  return manifest_.problems.empty();
}

void Recording::run_command() {
  ChildOptions child_options;
  // LTTng's default gives up after 3 s and lets the application run untraced.
  child_options.environment.emplace_back("LTTNG_UST_REGISTER_TIMEOUT", "-1");
  if (manifest_.options.has_ros2_profile) {
    child_options.environment.emplace_back(kProfileVariable, kRos2Profile);
  }
  ChildProcess command(manifest_.options.command, child_options);
  start_reading();
  while (!command.poll()) {
    const auto signal = signals_.wait(kTick);
    if (signal && is_interrupt(signal->number) && !signal->is_from_terminal) {
      command.kill(signal->number);
    }
    serve_flight_recorder(signal && signal->number == SIGUSR1);
    serve_rotation();
    look_for_applications(began_, true);
    for (const TracedProcess& process : manifest_.processes) {
      if (!has_warned_of_others_ && !descends_from(process.pid, command.pid()) &&
          parent_of(process.pid) != 0) {
        has_warned_of_others_ = true;
        warn("this session daemon serves other traced processes too, e.g. " + process.name +
             " (pid " + std::to_string(process.pid) + "): they are recorded as well");
      }
    }
    watch_health();
    show_progress();
  }
  manifest_.exit = command.poll();
  end_flight();
}

void Recording::start_reading() {
  if (kernel_) {
    kernel_->start_reading();
  }
  if (flight_) {
    flight_->start_reading();
  }
}

void Recording::wait_attached() {
  start_reading();
  const auto& duration = manifest_.options.duration;
  while (!is_daemon_lost_ && !(duration && Clock::now() - began_ >= *duration)) {
    const auto left =
        duration ? std::chrono::ceil<milliseconds>(*duration - (Clock::now() - began_)) : kTick;
    const auto signal = signals_.wait(std::min(kTick, left));
    if (signal && is_interrupt(signal->number)) {
      break;
    }
    serve_flight_recorder(signal && signal->number == SIGUSR1);
    serve_rotation();
    look_for_applications(began_, false);
    watch_health();
    show_progress();
  }
  end_flight();
}

// Asks until somebody has registered; each question costs every application some time.
void Recording::look_for_applications(Clock::time_point since, bool has_command) {
  if (!manifest_.processes.empty() || is_daemon_lost_ || !session_ || Clock::now() < next_look_) {
    return;
  }
  next_look_ = Clock::now() + kLookInterval;
  try {
    manifest_.processes = session_->traced_processes();
  } catch (const RecordError&) {
    return;  // the daemon's own state is watched elsewhere
  }
  if (manifest_.processes.empty() && !has_warned_of_registration_ &&
      Clock::now() - since > manifest_.options.registration_timeout) {
    has_warned_of_registration_ = true;
    warn(has_command
             ? "no traced application has registered yet: does the command use cie::executor, and "
               "was it built with CIE_WITH_LTTNG?"
             : "no traced application is running: waiting for one");
  }
}

void Recording::watch_health() {
  if (is_daemon_lost_ || Clock::now() < next_check_) {
    return;
  }
  next_check_ = Clock::now() + kCheckInterval;
  if (kernel_) {
    attempt(manifest_.problems, [this] { kernel_->adopt_clock(manifest_.options.directory); });
  }
  if (!daemon_->is_alive()) {
    is_daemon_lost_ = true;
    warn("the session daemon ended: nothing more is recorded");
    problem("the session daemon ended during the recording: what was not yet written is lost");
    return;
  }
  watch_relay();
  std::error_code error;
  const fs::space_info space = fs::space(manifest_.options.directory, error);
  if (!error && !relay_ && space.available < kLowSpace && !has_warned_of_space_) {
    has_warned_of_space_ = true;
    warn("only " + std::to_string(space.available >> 20) + " MiB left for " +
         manifest_.options.directory.string());
  }
}

void Recording::finish() {
  if (relay_) {
    finish_relayed();
  } else if (!is_daemon_lost_) {
    std::ranges::move(end_session(), std::back_inserter(manifest_.problems));
  }
  manifest_.end = now();
  end_kernel();
  const bool was_flight_recorder = flight_ != nullptr;
  if (was_flight_recorder) {
    snapshots_ = flight_->saved();
    left_out_ = flight_->left_out();
    flight_.reset();
  }
  session_.reset();
  daemon_.reset();
  if (relay_) {  // the files are elsewhere
    attempt(manifest_.problems, [this] { write_manifest(manifest_); });
    return;
  }
  if (was_flight_recorder) {
    return;  // every snapshot has its own manifest
  }
  attempt(manifest_.problems, [this] { rotation_ ? end_rotation() : check_files(); });
  attempt(manifest_.problems, [this] { write_manifest(manifest_); });
}

void Recording::end_kernel() {
  if (!kernel_) {
    return;
  }
  attempt(manifest_.problems, [this] { manifest_.kernel = kernel_->finish(); });
  attempt(manifest_.problems, [this] { kernel_->adopt_clock(manifest_.options.directory); });
  kernel_.reset();
  const auto untold = manifest_.kernel ? manifest_.kernel->untold_switches : 0;
  if (manifest_.options.kernel == KernelChoice::automatic && untold > 0) {
    // What was not asked for must not cost the verifier its verdicts.
    drop_kernel("this kernel did not tell " + std::to_string(untold) +
                " switches of threads; --kernel=yes keeps what it told");
  }
}

void Recording::drop_kernel(const std::string& reason) {
  manifest_.kernel.reset();
  manifest_.no_kernel_because = reason;
  std::error_code ignored;
  fs::remove_all(manifest_.options.directory / "kernel", ignored);
}

// liblttng-ctl waits without limit, and on a full disk a consumer daemon may spin instead of
// answering. So a thread waits for LTTng, and this one for the thread, but not for ever.
std::vector<std::string> Recording::end_session() {
  std::error_code error;
  const fs::space_info space = fs::space(manifest_.options.directory, error);
  const bool is_full = !relay_ && !error && space.available < kNoSpace;
  const seconds patience = is_full ? kPatienceOnAFullDisk : kPatience;
  std::packaged_task<Ending()> task([session = session_] { return end(*session); });
  std::future<Ending> ending = task.get_future();
  std::thread worker(std::move(task));
  if (ending.wait_for(patience) == std::future_status::ready) {
    worker.join();
    Ending result = ending.get();
    add(result.losses, manifest_.losses);
    return std::move(result.problems);
  }
  daemon_->abandon();
  is_daemon_lost_ = true;
  worker.detach();  // it has its share of the session, and ends with its connection or this process
  return {"LTTng did not end the session within " + std::to_string(patience.count()) + " s (" +
          (relay_ ? "is the network cut?" : "is the disk full?") + ')'};
}

void Recording::note_nothing_recorded() {
  problem("nothing was recorded: no application with events of " + manifest_.options.events[0] +
          " registered with the session daemon");
}

void Recording::check_files() {
  const fs::path& directory = manifest_.options.directory;
  for (const fs::path& file : empty_metadata(directory)) {
    problem(in_quotes(file) + " is empty: its streams cannot be read (is the disk full?)");
  }
  for (const StreamSummary& stream : check_streams(directory)) {
    if (stream.file.parent_path() != directory / "kernel") {
      packets_ += stream.packets;
    }
    if (stream.is_damaged) {
      problem(in_quotes(stream.file) + " ends within a packet (is the disk full?)");
    }
    if (stream.lost_packets > 0) {
      problem(in_quotes(stream.file) + " lacks " + std::to_string(stream.lost_packets) +
              " packets");
    }
  }
  if (packets_ == 0) {
    note_nothing_recorded();
  }
}

}  // namespace cie::record
