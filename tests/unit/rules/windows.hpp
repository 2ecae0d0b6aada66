// A recording of which a part is judged, and the part.
#pragma once

#include "support/verdicts.hpp"

#include <algorithm>
#include <cstdint>
#include <string_view>

namespace cie::test {

inline analysis::AnalysisOptions window(std::int64_t from, std::int64_t to) {
  analysis::AnalysisOptions options;
  options.window = analysis::TimeWindow{.from = {from}, .to = {to}};
  return options;
}

inline Verified in_window(std::string_view trace, std::int64_t from, std::int64_t to,
                          std::string_view spec = {}) {
  return Verified(trace_of(trace), spec, window(from, to));
}

inline const analysis::CallbackReport& callback(const Verified& verified, std::string_view id) {
  return *std::ranges::find(verified.result.report.callbacks, id,
                            &analysis::CallbackReport::logical_id);
}

}  // namespace cie::test
