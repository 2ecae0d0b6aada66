// Whether latencies rose for good: from some one on, all lie above those before.
#pragma once

#include <cie/analysis/time.hpp>

#include <algorithm>
#include <cstdint>

namespace cie::analysis {

class LatencyStep {
 public:
  // A step is higher than `least`.
  explicit LatencyStep(Duration least) noexcept : least_(least) {}

  void add(Duration latency) noexcept {
    if (is_measured_ && latency > limit_) {
      above_.add(latency);
      return;
    }
    current_.add(above_);
    above_ = {};
    current_.add(latency);
    if (current_.count < kEnough) return;
    limit_ = current_.highest + std::max(least_, current_.highest - current_.lowest);
    is_measured_ = true;
    current_ = {};
  }
  // Whether the last latencies, enough of them, were all above enough consecutive ones before, by
  // more than these scatter: a single one as low as those shows that latencies vary, and no step.
  bool is_open() const noexcept { return above_.count >= kEnough; }

  static constexpr std::uint64_t kEnough = 16;

 private:
  struct Range {
    Duration lowest{};
    Duration highest{};
    std::uint64_t count = 0;

    void add(Duration latency) noexcept { add(Range{latency, latency, 1}); }
    void add(const Range& other) noexcept {
      if (other.count == 0) return;
      lowest = count == 0 ? other.lowest : std::min(lowest, other.lowest);
      highest = std::max(highest, other.highest);
      count += other.count;
    }
  };

  Duration least_;
  bool is_measured_ = false;  // `limit_` is that of the latest kEnough that were no step
  Duration limit_{};
  Range current_{};
  Range above_{};
};

}  // namespace cie::analysis
