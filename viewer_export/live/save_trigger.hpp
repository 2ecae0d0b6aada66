// Decides when what a live view sees is worth a flight recorder's snapshot.
#pragma once

#include "snapshot.hpp"
#include "verdict_log.hpp"

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

namespace cie::live {

struct SaveLimits {
  std::uint64_t most = 10;                           // snapshots asked for
  std::chrono::milliseconds least_interval{10'000};  // from one to the next
};

// Reasons are violations that begin, each rule and subject once; and instances beyond a deadline
// that stands in the spec. (Of deadlines that the application declares the flight recorder knows by
// itself, as soon as an instance ends; so one that has not ended is a reason, too.) What comes too
// early is told with what comes next.
class SaveTrigger {
 public:
  using Clock = std::chrono::steady_clock;

  explicit SaveTrigger(const SaveLimits& limits) : limits_(limits) {}

  void see(const Snapshot& snapshot);
  // The reason, if a snapshot is to be saved now. `is_end`: nothing will come any more, so it is
  // not too early.
  std::optional<std::string> take(Clock::time_point now, bool is_end);
  // Reasons for which the limit lets nothing be saved.
  std::uint64_t left_out() const noexcept { return left_out_; }

 private:
  void see_violations(const Snapshot& snapshot);
  void see_deadlines(const Snapshot& snapshot);
  // `kind`: the rule, for when there are several.
  void add(const std::string& kind, std::string reason);

  SaveLimits limits_;
  std::set<VerdictKey> told_;
  std::map<std::uint32_t, std::uint64_t> late_;  // by CallbackView::index
  std::string reason_;  // the first of those since the last one saved; empty: there was none
  std::set<std::string> others_;  // what kind the further ones are
  std::optional<Clock::time_point> last_;
  std::uint64_t taken_ = 0;
  std::uint64_t left_out_ = 0;
};

}  // namespace cie::live
