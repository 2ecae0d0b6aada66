// Changes of single callbacks, and what a comparison of them looks like as text.
#pragma once

#include <cie/viewer_export/diff_writers.hpp>

#include <cstdint>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace cie::viewer_export {

inline std::string diff_text_of(const analysis::Comparison& comparison, const TextStyle& style = {},
                                bool is_all = false) {
  std::ostringstream out;
  write_diff_text(out, comparison,
                  {.before = "old",
                   .after = "new",
                   .tolerance = 0.05,
                   .isolation_before = {.own_thread = 3, .ran = 3},
                   .isolation_after = {.own_thread = 2, .ran = 3},
                   .is_all = is_all,
                   .arguments = "old new",
                   .view_arguments = "new"},
                  style);
  return out.str();
}

// Of complete records.
inline analysis::Comparison comparison_of(const std::vector<analysis::CallbackChange>& changes) {
  analysis::Comparison comparison;
  comparison.before.is_complete = true;
  comparison.after.is_complete = true;
  comparison.callbacks = changes;
  return comparison;
}

inline std::string diff_text_of(const std::vector<analysis::CallbackChange>& changes,
                                const TextStyle& style = {}) {
  return diff_text_of(comparison_of(changes), style);
}

inline analysis::CallbackChange change_of(const std::string& id, const std::string& quantity,
                                          unsigned per_mille, std::int64_t before,
                                          std::int64_t after) {
  const auto around = [](std::int64_t value) {
    return analysis::QuantileInterval{
        .lower = value - value / 10, .estimate = {.ns = value}, .upper = value + value / 10};
  };
  analysis::CallbackChange change;
  change.logical_id = id;
  change.is_before = true;
  change.is_after = true;
  change.instances_before = 100;
  change.instances_after = 100;
  change.quantities = {{.quantity = quantity,
                        .per_mille = per_mille,
                        .before = around(before),
                        .after = around(after),
                        .change = after > before   ? analysis::Change::worse
                                  : after < before ? analysis::Change::better
                                                   : analysis::Change::within}};
  return change;
}

inline const analysis::CallbackChange kBetter =
    change_of("/a/lidar@Subscription(/points)", "duration", 500, 2'000, 1'000);
inline const analysis::CallbackChange kSame =
    change_of("/a/map@Timer(1000)", "duration", 500, 2'000, 2'000);
inline const analysis::CallbackChange kWorse =
    change_of("/a/plan@Timer(20000000)", "response_time", 990, 1'000'000, 3'000'000);

// A callback that has a deadline, so many of whose 100 instances were late.
inline analysis::CallbackChange with_deadline(std::int64_t deadline_ns, std::uint64_t late_before,
                                              std::uint64_t late_after) {
  const auto id = fmt::format("/a/n{}_{}@Timer(20000000)", late_before, late_after);
  auto change = change_of(id, "response_time", 990, 3'000'000, 1'000'000);
  const auto lateness = [deadline_ns](std::uint64_t late, std::int64_t max) {
    return analysis::Lateness{
        .deadline = {deadline_ns}, .late = late, .instances = 100, .max = max};
  };
  change.lateness_before = lateness(late_before, 4'000'000);
  change.lateness_after = lateness(late_after, 1'500'000);
  change.of(analysis::Count::late) = {.before = late_before, .after = late_after};
  return change;
}

}  // namespace cie::viewer_export
