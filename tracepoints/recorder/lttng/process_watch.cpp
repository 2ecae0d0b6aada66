#include "lttng/process_watch.hpp"

#include "base/machine.hpp"
#include "system/processes.hpp"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <iterator>
#include <thread>
#include <tuple>
#include <utility>

namespace cie::record {
namespace {

// Places of what is captured.
enum : std::size_t { kPid, kName, kStart, kTime, kMoment };
constexpr std::int64_t kStarts = 0;  // `moment` of a process that begins

constexpr std::chrono::seconds kPassingOn{5};  // what the daemon may take to do so
constexpr std::chrono::milliseconds kLook{2};
constexpr std::chrono::milliseconds kQuiet{200};  // if one cannot see what it does

// Those whose begin is known first.
auto key(const RecordedProcess& process) {
  return std::tuple(process.pid, !process.start_ns, process.start_ns.value_or(0));
}

// One that emits both events is told by `run_begin`, which says when it began.
bool is_same(const RecordedProcess& a, const RecordedProcess& b) {
  return a.pid == b.pid && (a.start_ns == b.start_ns || !a.start_ns || !b.start_ns);
}

// Of its program while it runs; the tracer tells only the name of the thread that spoke.
std::string name_of(const std::vector<Captured>& event) {
  const auto pid = static_cast<pid_t>(pid_of(event[kPid]));
  const auto start = start_ns(std::to_string(pid));
  // The pid is that of the process's own pid namespace; it may be another one's here.
  if (start && std::abs(*start - number_of(event[kStart])) < 1'000'000) return process_name(pid);
  const auto* thread = std::get_if<std::string>(&event[kName]);
  return thread != nullptr && number_of(event[kMoment]) == kStarts ? *thread : std::string();
}

}  // namespace

ProcessWatch::ProcessWatch(const std::string& name, bool is_ros2, pid_t daemon) : daemon_(daemon) {
  const std::vector<Capture> captures{{.name = "vpid", .is_context = true},
                                      {.name = "procname", .is_context = true},
                                      {.name = "process_start_ns"},
                                      {.name = "monotonic_ns"},
                                      {.name = "moment"}};
  constexpr const char* kPurpose = "watch for processes that begin";
  begins_.emplace(name + "-processes", "cie:run_begin", captures, kPurpose);
  if (!is_ros2) return;
  const std::vector<Capture> who{{.name = "vpid", .is_context = true},
                                 {.name = "procname", .is_context = true}};
  ros2_begins_.emplace(name + "-ros2-processes", "ros2:rcl_init", who, kPurpose);
}

bool ProcessWatch::poll() {
  bool is_any = false;
  while (const auto event = begins_ ? begins_->poll() : std::nullopt) {
    is_any = true;
    known_.push_back({.time_ns = number_of((*event)[kTime]),
                      .process = {.pid = pid_of((*event)[kPid]),
                                  .name = name_of(*event),
                                  .start_ns = number_of((*event)[kStart])}});
    pids_.insert(known_.back().process.pid);
  }
  // It says neither when it was emitted nor when its process began.
  while (const auto event = ros2_begins_ ? ros2_begins_->poll() : std::nullopt) {
    is_any = true;
    const auto pid = pid_of((*event)[kPid]);
    const auto* thread = std::get_if<std::string>(&(*event)[kName]);
    auto name = process_name(static_cast<pid_t>(pid));
    if (name.empty() && thread != nullptr) name = *thread;
    known_.push_back({.time_ns = std::nullopt,
                      .process = {.pid = pid,
                                  .name = std::move(name),
                                  .start_ns = std::nullopt,
                                  .monotonic_offset_ns = other_clock(static_cast<pid_t>(pid))}});
    pids_.insert(pid);
  }
  note_losses();
  return is_any;
}

void ProcessWatch::note_losses() noexcept {
  has_missed_ = has_missed_ || (begins_ && begins_->has_missed()) ||
                (ros2_begins_ && ros2_begins_->has_missed());
}

// Who emits an event writes it into a pipe of the daemon's, of which one thread passes it to the next.
// Each is woken before the one that wakes it sleeps: when all sleep, all was passed on.
bool ProcessWatch::catch_up() {
  if (!begins_) return false;
  const auto deadline = std::chrono::steady_clock::now() + kPassingOn;
  bool is_any = false;
  for (auto quiet = kQuiet;;) {
    const bool has_passed_on = daemon_ > 0 ? is_asleep(daemon_) : quiet <= kQuiet.zero();
    const bool has_come = poll();
    is_any = is_any || has_come;
    if (has_passed_on && !has_come) break;
    if (std::chrono::steady_clock::now() > deadline) {
      has_missed_ = true;
      break;
    }
    quiet = has_come ? kQuiet : quiet - kLook;
    std::this_thread::sleep_for(kLook);
  }
  begins_->look_for_losses();
  if (ros2_begins_) ros2_begins_->look_for_losses();
  note_losses();
  return is_any;
}

void ProcessWatch::stop() noexcept {
  begins_.reset();
  ros2_begins_.reset();
}

std::vector<RecordedProcess> ProcessWatch::begun(std::int64_t from_ns, std::int64_t to_ns) const {
  std::vector<RecordedProcess> processes;
  for (const Begin& begin : known_) {
    if (!begin.time_ns || (*begin.time_ns >= from_ns && *begin.time_ns < to_ns))
      processes.push_back(begin.process);
  }
  return merged({}, processes);
}

void ProcessWatch::forget(std::int64_t before_ns) {
  std::erase_if(known_, [before_ns](const Begin& begin) { return begin.time_ns < before_ns; });
}

std::vector<RecordedProcess> merged(std::vector<RecordedProcess> processes,
                                    const std::vector<RecordedProcess>& more) {
  std::ranges::copy(more, std::back_inserter(processes));
  std::ranges::stable_sort(processes, {}, key);
  processes.erase(std::unique(processes.begin(), processes.end(), is_same), processes.end());
  return processes;
}

}  // namespace cie::record
