#include "callback_ranking.hpp"

#include <cie/analysis/report_rows.hpp>

#include <algorithm>
#include <functional>
#include <tuple>

namespace cie::viewer_export {
namespace {

using analysis::CallbackReport;

// What loads the components of a container is done when the application runs.
bool is_start_up(const CallbackReport& callback) {
  return callback.kind == CallbackKind::service &&
         callback.source.ends_with("/_container/load_node");
}

auto badness(const CallbackReport& callback) {
  const auto longest = analysis::longest_response(callback).value_or(analysis::LongestResponse{});
  return std::tuple(analysis::times_deadline(callback), !ran_at_start(callback), longest.ns);
}

}  // namespace

bool ran_at_start(const CallbackReport& callback) {
  return is_start_up(callback) || callback.instances <= 1;
}

std::vector<const CallbackReport*> worst_first(const analysis::Report& report) {
  std::vector<const CallbackReport*> callbacks;
  for (const auto& callback : report.callbacks) {
    if (callback.has_run()) callbacks.push_back(&callback);
  }
  std::ranges::stable_sort(callbacks, std::ranges::greater{},
                           [](const auto* callback) { return badness(*callback); });
  return callbacks;
}

}  // namespace cie::viewer_export
