#include "keeping/tracing.hpp"

#include <cie/tracepoints/schema.hpp>

#include "base/text.hpp"
#include "keeping/attempt.hpp"
#include "keeping/manifest.hpp"
#include "lttng/session_channels.hpp"
#include "system/disk_room.hpp"
#include "system/error.hpp"
#include "system/long_call.hpp"
#include "system/processes.hpp"

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

namespace cie::record {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;

constexpr seconds kCheckInterval{1};
constexpr std::uintmax_t kLowSpace = 64 << 20;
constexpr std::uintmax_t kNoSpace = 1 << 20;
constexpr seconds kSessionPatience{150};
constexpr seconds kSessionPatienceOnFullDisk{5};

// A name that no session of this machine has had.
std::string new_session_name(const Options& options) {
  return fmt::format("{}-{}-{}", options.snapshot ? kSnapshotSession : "cie-record", getpid(),
                     now().realtime_ns);
}

// What LTTng says at the end of a session.
struct Ending {
  std::vector<RecordedChannel> losses;
  std::vector<std::string> problems;
};

Ending end_of(TracingSession& session) {
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

void add(const std::vector<RecordedChannel>& losses, std::vector<RecordedChannel>& sum) {
  for (const RecordedChannel& loss : losses) {
    const auto known = std::ranges::find(sum, loss.name, &RecordedChannel::name);
    if (known == sum.end()) {
      sum.push_back(loss);
    } else {
      known->discarded_events += loss.discarded_events;
      known->lost_packets += loss.lost_packets;
    }
  }
}

}  // namespace

Tracing::Tracing(const Options& options, Console& output)
    : manifest(manifest_of(options)),
      console(output),
      options_(options),
      claim_(options.directory),
      registration_(output, options) {}

void Tracing::start_daemon() { daemon_ = std::make_unique<SessionDaemon>(options().daemon); }

void Tracing::create_session() {
  manifest.session.name = new_session_name(options());
  session_ = std::make_shared<TracingSession>(manifest.session.name, options());
  consumers_ = ConsumerDaemons(daemon_->pid());
}

void Tracing::create_session(const RelayDestination& destination) {
  manifest.session.name = new_session_name(options());
  session_ = std::make_shared<TracingSession>(SessionKind::relayed, manifest.session.name,
                                              options(), destination);
  consumers_ = ConsumerDaemons(daemon_->pid());
}

// A recording without this is worth as much, so it does not fail.
void Tracing::watch_processes() {
  try {
    processes_ = std::make_unique<ProcessWatch>(
        manifest.session.name, options().ros2 == Ros2Events::applications, daemon_->pid());
  } catch (const RecordError& error) {
    manifest.names_all_processes = false;
    console.warn(error.what());
  }
}

void Tracing::start() {
  manifest.begin = now();
  session_->start();
}

void Tracing::abandon() noexcept {
  processes_.reset();
  session_.reset();
  if (daemon_) daemon_->give_up();
  daemon_.reset();
  claim_.withdraw();
}

bool Tracing::poll_processes() {
  if (!processes_ || is_daemon_lost_) return false;
  const bool is_any = ending_ ? processes_->catch_up() : processes_->poll();
  told_ = processes_->count();
  return is_any;
}

void Tracing::note_processes() {
  const std::int64_t until = ending_.value_or(now()).monotonic_ns;
  if (poll_processes()) {
    manifest.processes = merged(std::move(manifest.processes),
                                processes_->begun(manifest.begin.monotonic_ns, until));
    processes_->forget(until);
  }
}

void Tracing::look_for_applications(Target& target) {
  if (session_ && !is_daemon_lost_) {
    const bool is_any_told = processes_ && processes_->count() != 0;
    registration_.look(session_, target, is_any_told);
  }
  if (registration_.is_anybody() && !has_noted_first_) {
    has_noted_first_ = true;
    target.note_registered();
    note_running(target);
    // Not later: the command's own children may lose their parents.
    if (target.is_command()) registration_.warn_of_others(target);
  }
}

// Applications of ROS 2 that run already do not say so again.
void Tracing::note_running(const Target& target) {
  if (target.is_command() || options().ros2 != Ros2Events::applications) return;
  std::vector<RecordedProcess> running;
  for (const auto& process : registration_.first())
    running.push_back({.pid = process.pid,
                       .name = process.name,
                       .start_ns = std::nullopt,
                       .monotonic_offset_ns = other_clock(process.pid)});
  manifest.processes = merged(std::move(manifest.processes), running);
}

bool Tracing::has_checked_daemon() {
  if (is_daemon_lost_ || is_asking() || Clock::now() < next_check_) {
    return false;
  }
  next_check_ = Clock::now() + kCheckInterval;
  if (!daemon_->is_alive()) {
    is_daemon_lost_ = true;
    note_end_of("session daemon");
    return false;
  }
  if (!is_consumer_lost_ && consumers_.have_ended()) {
    is_consumer_lost_ = true;
    note_end_of("consumer daemon");
  }
  return true;
}

void Tracing::note_end_of(const std::string& daemon) {
  console.warn(
      fmt::format("the {} ended: nothing more is recorded; {}", daemon,
                  options().is_attach() ? "record again" : "end the command, and record it again"));
  manifest.problems.emplace_back("the " + daemon +
                                 " ended during the recording: what was not yet written is lost");
}

void Tracing::check_space() {
  std::error_code error;
  const fs::space_info space = fs::space(options().directory, error);
  if (error) return;
  if (space.available < kLowSpace && !has_warned_of_space_) {
    has_warned_of_space_ = true;
    console.warn(fmt::format("only {} MiB left for {}", space.available >> 20U,
                             options().directory.string()));
  }
  // A stream that the consumer daemon could not write once it does not write any more, and tells
  // nobody. Snapshots are written when they are saved, which tells how that went.
  const bool is_written_all_the_time = !options().snapshot;
  if (is_written_all_the_time && is_full(space, geteuid() == 0) && !has_noted_full_disk_) {
    has_noted_full_disk_ = true;
    manifest.problems.emplace_back(
        "the disk was full: what LTTng could not write is missing, also where there was room "
        "again later");
  }
}

void Tracing::end_tick(Target& target) {
  if (const auto news = target.take_news()) console.warn(*news);
  console.show_progress(target.age(),
                        std::max({registration_.count(), manifest.processes.size(), told_}),
                        target.is_command());
  if ((is_daemon_lost_ || is_consumer_lost_) && !target.is_command()) {
    target.interrupt(SIGTERM);
  }
}

void Tracing::refuse_snapshot() {
  console.warn(
      "SIGUSR1 has a snapshot saved; this recorder, started without --snapshot, keeps everything");
}

seconds Tracing::patience() const {
  std::error_code error;
  const fs::space_info space = fs::space(options().directory, error);
  const bool is_full = !options().relay && !error && space.available < kNoSpace;
  return is_full ? kSessionPatienceOnFullDisk : kSessionPatience;
}

std::string Tracing::give_up_daemon(std::string_view what, seconds patience) {
  daemon_->abandon();
  is_daemon_lost_ = true;
  return fmt::format("LTTng did not {} within {} s ({})", what, patience.count(),
                     options().relay ? "is the network cut?" : "is the disk full?");
}

std::vector<std::string> Tracing::end_session() {
  const seconds patience = this->patience();
  LongCall<Ending> ending([session = session_] { return end_of(*session); });
  if (!ending.is_done(patience)) return {give_up_daemon("end the session", patience)};
  Ending result = ending.get();
  add(result.losses, manifest.channels);
  return std::move(result.problems);
}

void Tracing::settle() {
  if (is_daemon_lost_) return;
  const seconds patience = this->patience();
  if (!registration_.settle(patience)) {
    add_problem(manifest.problems, give_up_daemon("tell of applications", patience));
  }
}

void Tracing::end() {
  begin_end();
  settle();
  if (!is_daemon_lost_) {
    add_problems(manifest.problems, end_session());
  }
  manifest.end = now();
}

bool Tracing::is_nobody_told_of() {
  if (!processes_ || is_daemon_lost_) return false;
  processes_->catch_up();
  // Who emits other events than cie's does not describe itself, and applications of ROS 2 that run
  // already do not do it again.
  const bool may_be_silent = options().events.size() > 1 ||
                             (options().is_attach() && options().ros2 == Ros2Events::applications);
  return processes_->count() == 0 && !processes_->has_missed() &&
         !(may_be_silent && registration_.is_anybody());
}

void Tracing::note_nothing_recorded() {
  record::note_nothing_recorded(options(), registration_.is_anybody(), manifest);
}

bool Tracing::is_directory_there() {
  if (claim_.is_in_place()) return true;
  add_problem(
      manifest.problems,
      in_quotes(options().directory) +
          " was removed or renamed while it was recorded into: what LTTng wrote is where it "
          "is now");
  return false;
}

void Tracing::close() {
  if (processes_) {
    manifest.names_all_processes = !processes_->has_missed() && !is_daemon_lost_;
    processes_->stop();
  }
  session_.reset();
  daemon_.reset();
}

}  // namespace cie::record
