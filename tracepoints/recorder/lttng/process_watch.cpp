#include "lttng/process_watch.hpp"

#include "base/machine.hpp"
#include "system/processes.hpp"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <tuple>

namespace cie::record {
namespace {

// Places of what is captured.
enum : std::size_t { kPid, kName, kStart, kTime, kMoment };
constexpr std::int64_t kStarts = 0;  // `moment` of a process that begins

auto key(const RecordedProcess& process) { return std::tie(process.pid, process.start_ns); }

bool is_same(const RecordedProcess& a, const RecordedProcess& b) { return key(a) == key(b); }

// Of its program while it runs; the tracer tells only the name of the thread that spoke.
std::string name_of(const std::vector<Captured>& event) {
  const auto pid = static_cast<pid_t>(number_of(event[kPid]));
  const auto start = start_ns(std::to_string(pid));
  // The pid is that of the process's own pid namespace; it may be another one's here.
  if (start && std::abs(*start - number_of(event[kStart])) < 1'000'000) return process_name(pid);
  const auto* thread = std::get_if<std::string>(&event[kName]);
  return thread != nullptr && number_of(event[kMoment]) == kStarts ? *thread : std::string();
}

}  // namespace

ProcessWatch::ProcessWatch(const std::string& name) {
  const std::vector<Capture> captures{{.name = "vpid", .is_context = true},
                                      {.name = "procname", .is_context = true},
                                      {.name = "process_start_ns"},
                                      {.name = "monotonic_ns"},
                                      {.name = "moment"}};
  begins_.emplace(name + "-processes", "cie:run_begin", captures, "watch for processes that begin");
}

bool ProcessWatch::poll() {
  bool is_any = false;
  while (const auto event = begins_ ? begins_->poll() : std::nullopt) {
    is_any = true;
    known_.push_back({.time_ns = number_of((*event)[kTime]),
                      .process = {.pid = number_of((*event)[kPid]),
                                  .name = name_of(*event),
                                  .start_ns = number_of((*event)[kStart])}});
  }
  has_missed_ = has_missed_ || (begins_ && begins_->has_missed());
  return is_any;
}

void ProcessWatch::stop() noexcept { begins_.reset(); }

std::vector<RecordedProcess> ProcessWatch::begun(std::int64_t from_ns, std::int64_t to_ns) const {
  std::vector<RecordedProcess> processes;
  for (const Begin& begin : known_) {
    if (begin.time_ns >= from_ns && begin.time_ns < to_ns) processes.push_back(begin.process);
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
