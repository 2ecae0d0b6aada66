// CPU time of threads: from /proc for processes of this machine, from the kernel's events for
// others.
#pragma once

#include <cie/analysis/report.hpp>

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace cie::live {

class CpuUsage {
 public:
  explicit CpuUsage(std::string proc = "/proc");

  // Begins a round; `report` is what the analysis says now.
  void begin(const analysis::Report& report, std::chrono::steady_clock::time_point now);
  // Per cent of one CPU since the round before; empty where it is unknown, or for the first time.
  std::optional<double> of(const analysis::ThreadReport& thread);
  // The process is one of this machine and pid namespace.
  bool is_local(analysis::ProcessIndex process) const;
  // A process of this machine that has ended, whatever it told of that.
  bool is_gone(analysis::ProcessIndex process) const;
  // A thread of this machine that has ended.
  bool is_gone(const analysis::ThreadReport& thread) const;
  // Ends the round: forgets threads that were not asked for.
  void end();

 private:
  struct Sample {
    std::int64_t busy_ns = 0;
    std::chrono::steady_clock::time_point time;
    std::uint64_t round = 0;
  };
  // Of a local one.
  std::string task(const analysis::ThreadReport& thread) const;
  std::optional<std::int64_t> busy(const analysis::ThreadReport& thread) const;

  std::string proc_;
  std::string boot_id_;
  std::uint64_t pid_ns_ = 0;
  std::map<analysis::ProcessIndex, std::int64_t> local_;  // pids of those that are
  std::map<analysis::ThreadIndex, Sample> samples_;
  std::chrono::steady_clock::time_point now_;
  std::uint64_t round_ = 0;
};

}  // namespace cie::live
