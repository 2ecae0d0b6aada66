// Watches an analysis while it runs and describes it at any moment.
#pragma once

#include <cie/analysis/analyzer.hpp>
#include <cie/analysis/instance.hpp>

#include "cpu_usage.hpp"
#include "rolling.hpp"
#include "snapshot.hpp"
#include "verdict_log.hpp"

#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <unordered_map>
#include <vector>

namespace cie::live {

// Numbers since the beginning are the report's; only what a report has not (windows, counts of
// late instances, classes) is kept here. Memory grows with the number of callbacks alone.
class Monitor final : public analysis::Observer {
 public:
  explicit Monitor(std::chrono::steady_clock::time_point begun = std::chrono::steady_clock::now())
      : described_(begun) {}

  // Instances that `recent` of a callback holds at most.
  static constexpr std::size_t kMaxRecent = 32;
  // Callbacks of a process that ended are shown this long after their last instance, or, where they
  // never ran, after its end was noticed.
  static constexpr std::int64_t kKeptAfterEndNs = 60'000'000'000;
  // An instance is open for long beyond its deadline or, without one, beyond this and whatever one of
  // its callback took.
  static constexpr std::int64_t kOpenLongNs = 1'000'000'000;

  bool waits_for_proof() const override { return false; }  // what is going on is shown now
  void on_instance(const analysis::Instance& instance) override;

  // What is known now. `result`: of the analyzer that this observes.
  Snapshot describe(const analysis::AnalysisResult& result,
                    std::chrono::steady_clock::time_point now);

 private:
  struct OfCallback {
    Rolling rolling;
    ResponseCounts counts{};
    std::int64_t response_sum_ns = 0;
    std::uint64_t late = 0;
    std::uint64_t late_told = 0;  // with those that were open; they may wait before they count
    bool is_exact = true;
    std::optional<std::int64_t> last_response_ns;
    std::optional<std::int64_t> last_end_ns;
    std::optional<std::chrono::steady_clock::time_point> end_seen;  // of its process
    std::deque<RecentInstance> recent;

    analysis::Duration age(analysis::Timestamp now,
                           std::chrono::steady_clock::time_point time) const;
  };
  // What the clock of a host shows: times of several hosts have nothing in common.
  struct HostClock {
    analysis::Timestamp first{};   // start of the first instance
    analysis::Timestamp latest{};  // end of an instance
    // Where it stood when an instance ended last, and ours when that was noticed.
    std::optional<std::pair<analysis::Timestamp, std::chrono::steady_clock::time_point>> seen;

    analysis::Timestamp present(std::chrono::steady_clock::time_point now);
  };
  void describe_callbacks(const analysis::AnalysisResult& result,
                          std::chrono::steady_clock::time_point now, Snapshot& snapshot);
  static void describe_open(const analysis::CallbackReport& known, CallbackView& view);
  void describe_threads(const analysis::Report& report, Snapshot& snapshot);

  std::unordered_map<analysis::CallbackIndex, OfCallback> callbacks_;
  VerdictLog verdicts_;
  CpuUsage cpu_;
  std::unordered_map<analysis::HostIndex, HostClock> clocks_;
  analysis::HostIndex heard_{};  // the host of which an instance came last
  std::uint64_t sequence_ = 0;
  std::uint64_t events_ = 0;
  std::chrono::steady_clock::time_point described_;  // the last time; at first when it began
};

}  // namespace cie::live
