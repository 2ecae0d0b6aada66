#include <cie/viewer_export/diff_writers.hpp>

#include "json.hpp"

namespace cie::viewer_export {
namespace {

using analysis::CallbackChange;

Json json_of(const std::optional<analysis::QuantileInterval>& interval) {
  if (!interval) return nullptr;
  return {{"estimate", interval->estimate},
          {"lower", optional_json(interval->lower)},
          {"upper", optional_json(interval->upper)}};
}

Json json_of(const analysis::QuantityChange& change) {
  return {{"quantity", change.quantity},
          {"quantile", change.per_mille / 1000.0},
          {"before_ns", json_of(change.before)},
          {"after_ns", json_of(change.after)},
          {"change", analysis::label(change.change)}};
}

Json json_of(const std::optional<analysis::Lateness>& lateness) {
  if (!lateness) return nullptr;
  return {{"deadline_ns", lateness->deadline.ns},
          {"late", lateness->late},
          {"instances", lateness->instances},
          {"max_ns", optional_json(lateness->max)}};
}

Json json_of(const CallbackChange& change) {
  Json quantities = Json::array();
  for (const auto& quantity : change.quantities)
    quantities.push_back(json_of(quantity));
  return {{"logical_id", change.logical_id},
          {"before", change.is_before},
          {"after", change.is_after},
          {"instances_before", change.instances_before},
          {"instances_after", change.instances_after},
          {"missed_releases_before", optional_json(change.missed_before)},
          {"missed_releases_after", optional_json(change.missed_after)},
          {"missed_releases", analysis::label(change.missed)},
          {"lost_isolation", change.lost_isolation},
          {"regression", change.is_regression()},
          {"deadline_before", json_of(change.lateness_before)},
          {"deadline_after", json_of(change.lateness_after)},
          {"quantities", std::move(quantities)}};
}

}  // namespace

void write_diff_json(std::ostream& out, const std::vector<CallbackChange>& changes,
                     const DiffContext& context) {
  Json callbacks = Json::array();
  bool is_regression = false;
  for (const auto& change : changes) {
    callbacks.push_back(json_of(change));
    is_regression = is_regression || change.is_regression();
  }
  write_json(out, {{"schema", "cie.diff/1"},
                   {"before", context.before},
                   {"after", context.after},
                   {"tolerance", context.tolerance},
                   {"confidence", 1 - analysis::kComparisonError},
                   {"regression", is_regression},
                   {"callbacks", std::move(callbacks)}});
}

}  // namespace cie::viewer_export
