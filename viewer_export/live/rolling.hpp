// Counts and response times of the last seconds, in memory that does not depend on the rate.
#pragma once

#include <cie/analysis/rare.hpp>
#include <cie/analysis/statistics.hpp>
#include <cie/analysis/time.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace cie::live {

// Ten slices of a second: what is older than nine to ten seconds drops out slice by slice.
class Rolling {
 public:
  static constexpr std::size_t kSlices = 10;
  static constexpr std::int64_t kSliceNs = 1'000'000'000;
  static constexpr std::int64_t kWindowNs = static_cast<std::int64_t>(kSlices) * kSliceNs;

  struct Sum {
    std::uint64_t instances = 0;
    std::uint64_t late = 0;
    std::uint64_t missed = 0;
    analysis::Rare<analysis::Summary> response;
  };

  // An instance that ended at `end`. One older than the window is left out.
  void add(analysis::Timestamp end, analysis::Duration response, bool is_late,
           std::uint32_t missed) {
    const auto number = end.ns / kSliceNs;
    auto& slice = slices_[index(number)];
    if (slice.number > number) return;
    if (slice.number != number) {
      slice = Slice{};
      slice.number = number;
    }
    ++slice.instances;
    slice.late += is_late ? 1 : 0;
    slice.missed += missed;
    slice.response.add(response);
  }

  // How far the window that ends at `now` reaches back.
  static analysis::Duration covered(analysis::Timestamp now) noexcept {
    return {now.ns - (now.ns / kSliceNs - static_cast<std::int64_t>(kSlices) + 1) * kSliceNs};
  }
  // Of the window that ends at `now`.
  Sum sum(analysis::Timestamp now) const {
    Sum total;
    analysis::Statistics response;
    const auto newest = now.ns / kSliceNs;
    for (const auto& slice : slices_) {
      if (slice.number <= newest - static_cast<std::int64_t>(kSlices) || slice.number > newest) {
        continue;
      }
      total.instances += slice.instances;
      total.late += slice.late;
      total.missed += slice.missed;
      response.merge(slice.response);
    }
    total.response = response.summary();
    return total;
  }

 private:
  struct Slice {
    std::int64_t number = -1;
    std::uint64_t instances = 0;
    std::uint64_t late = 0;
    std::uint64_t missed = 0;
    analysis::Statistics response;
  };
  static std::size_t index(std::int64_t number) noexcept {
    return static_cast<std::uint64_t>(number) % kSlices;
  }

  std::array<Slice, kSlices> slices_{};
};

}  // namespace cie::live
