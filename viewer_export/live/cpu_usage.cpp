#include "cpu_usage.hpp"

#include <fstream>
#include <utility>

#include <sys/stat.h>

namespace cie::live {

CpuUsage::CpuUsage(std::string proc) : proc_(std::move(proc)) {
  std::ifstream(proc_ + "/sys/kernel/random/boot_id") >> boot_id_;
  struct stat status {};
  if (::stat((proc_ + "/self/ns/pid").c_str(), &status) == 0) pid_ns_ = status.st_ino;
}

void CpuUsage::begin(const analysis::Report& report, std::chrono::steady_clock::time_point now) {
  now_ = now;
  ++round_;
  local_.clear();
  for (const auto& process : report.processes) {
    const bool is_here =
        !process.boot_id.empty() && process.boot_id == boot_id_ && process.pid_ns == pid_ns_;
    if (is_here) local_[process.index] = process.pid;
  }
}

bool CpuUsage::is_local(analysis::ProcessIndex process) const { return local_.contains(process); }

std::string CpuUsage::task(const analysis::ThreadReport& thread) const {
  return proc_ + '/' + std::to_string(local_.at(thread.process)) + "/task/" +
         std::to_string(thread.tid);
}

bool CpuUsage::is_gone(analysis::ProcessIndex process) const {
  struct stat status {};
  return is_local(process) &&
         ::stat((proc_ + '/' + std::to_string(local_.at(process))).c_str(), &status) != 0;
}

bool CpuUsage::is_gone(const analysis::ThreadReport& thread) const {
  struct stat status {};
  return is_local(thread.process) && ::stat(task(thread).c_str(), &status) != 0;
}

// The first number of schedstat is the time on a CPU, in nanoseconds.
std::optional<std::int64_t> CpuUsage::busy(const analysis::ThreadReport& thread) const {
  if (!is_local(thread.process)) return thread.busy_ns;
  std::int64_t value = 0;
  if (std::ifstream(task(thread) + "/schedstat") >> value) return value;
  return std::nullopt;
}

std::optional<double> CpuUsage::of(const analysis::ThreadReport& thread) {
  const auto value = busy(thread);
  if (!value) return std::nullopt;
  auto& sample = samples_[thread.index];
  const auto before =
      std::exchange(sample, Sample{.busy_ns = *value, .time = now_, .round = round_});
  const auto elapsed =
      std::chrono::duration_cast<std::chrono::nanoseconds>(now_ - before.time).count();
  if (before.round == 0 || elapsed <= 0 || *value < before.busy_ns) return std::nullopt;
  constexpr double kPercent = 100;
  return kPercent * static_cast<double>(*value - before.busy_ns) / static_cast<double>(elapsed);
}

void CpuUsage::end() {
  std::erase_if(samples_, [this](const auto& entry) { return entry.second.round != round_; });
}

}  // namespace cie::live
