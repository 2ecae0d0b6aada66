// The comparison behind differences(): instances in expected.cpp, the report in
// expected_report.cpp.
#pragma once

#include "simulator/expected.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace cie::sim {

using analysis::InstanceState;
using analysis::ReleaseSource;
using analysis::Summary;
using Numbers = std::vector<Ns>;

template <typename Value>
std::string text(const std::optional<Value>& value) {
  return value ? std::to_string(*value) : "none";
}
std::string text(const std::map<std::int64_t, Ns>& by_tid);

class Comparison {
 public:
  Comparison(const System& system, const Simulation& simulation, const Recording& recording,
             const Observed& observed)
      : system_(system),
        truth_(simulation.truth),
        recording_(recording),
        observed_(observed),
        last_(simulation.tape.end() + 1) {}

  std::vector<std::string> run() {
    for (std::size_t i = 0; i < observed_.rows.size(); ++i) {
      const auto& row = observed_.rows[i];
      rows_[{row.instance.pid, row.logical_id, row.instance.seq}] = i;
    }
    figures_.resize(system_.callbacks.size());
    std::size_t seen = 0;
    for (const auto& instance : truth_.instances) {
      if (compare_instance(instance)) ++seen;
    }
    equal("rows of instances", observed_.rows.size(), seen);
    for (std::size_t i = 0; i < figures_.size(); ++i)
      compare_callback(i);
    if (is_whole()) {
      compare_threads();
      compare_chains();
    }
    return std::move(found_);
  }

 private:
  // What the report must say of a callback.
  struct Figures {
    std::uint64_t complete = 0;
    std::uint64_t open = 0;
    std::uint64_t cut = 0;
    std::uint64_t missed = 0;
    std::map<std::int64_t, std::uint64_t> by_thread;
    std::map<ReleaseSource, std::uint64_t> sources;
    Numbers response, lower, upper, latency, duration, arrival;
    Numbers execution, preempted, blocked, delay, wakeup;
    std::map<std::int64_t, Ns> instead;
    std::optional<std::pair<std::uint64_t, Ns>> last;  // seq and release
  };
  // An instance as the recording shows it.
  struct Shown {
    InstanceState state = InstanceState::complete;
    bool has_parts = false;
    ReleaseSource source = ReleaseSource::exact;
    Ns release = 0;
    std::optional<Ns> wakeup;
    std::optional<Ns> waking;
    std::optional<Ns> first_in;
    std::optional<Ns> upper;  // bound of the response time
  };

  template <typename A, typename B>
  void equal(const std::string& what, const A& said, const B& meant) {
    if (said == meant) return;
    std::ostringstream out;
    out << what << ": said " << said << ", is " << meant;
    found_.push_back(out.str());
  }
  void equal(const std::string& what, const std::optional<Ns>& said,
             const std::optional<Ns>& meant) {
    if (said != meant) found_.push_back(what + ": said " + text(said) + ", is " + text(meant));
  }

  bool is_whole() const { return recording_.user_begin.empty() && recording_.user_end.empty(); }
  Ns begin_of(std::int32_t cpu) const {
    return recording_.user_begin.empty() ? 0 : recording_.user_begin[static_cast<std::size_t>(cpu)];
  }
  Ns end_of(std::int32_t cpu) const {
    return recording_.user_end.empty() ? last_ : recording_.user_end[static_cast<std::size_t>(cpu)];
  }
  Ns window_begin() const {
    return recording_.user_begin.empty() ? 0 : std::ranges::max(recording_.user_begin);
  }
  Ns window_end() const {
    return recording_.user_end.empty() ? last_ : std::ranges::min(recording_.user_end);
  }
  Ns kernel_end() const { return recording_.kernel_end != 0 ? recording_.kernel_end : last_; }
  bool is_recorded(Ns time, std::int32_t cpu) const {
    return time >= begin_of(cpu) && time <= end_of(cpu);
  }
  bool is_end_recorded(const InstanceTruth& instance) const {
    return instance.end && is_recorded(*instance.end, instance.cpu_end);
  }

  std::optional<Shown> shown(const InstanceTruth& instance) const;
  bool compare_instance(const InstanceTruth& instance);
  void compare_row(const InstanceTruth& instance, const Shown& shown, const Observed::Row& row);
  void add(const InstanceTruth& instance, const Shown& shown);
  void compare_callback(std::size_t index);
  void compare_summary(const std::string& what, const Rare<Summary>& said, Numbers meant);
  void compare_queue(std::size_t index, const std::optional<std::uint64_t>& said);
  void compare_threads();
  void compare_chains();
  void compare_chain(const ChainTruth& chain);

  const System& system_;
  const Truth& truth_;
  const Recording& recording_;
  const Observed& observed_;
  Ns last_;
  std::map<std::tuple<std::int64_t, std::string, std::uint64_t>, std::size_t> rows_;
  std::vector<Figures> figures_;
  std::set<std::size_t> unended_;  // threads with an instance whose end was not recorded
  std::vector<std::string> found_;
};

}  // namespace cie::sim
