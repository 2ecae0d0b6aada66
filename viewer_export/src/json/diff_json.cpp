#include <cie/viewer_export/diff_writers.hpp>

#include "json.hpp"

namespace cie::viewer_export {
namespace {

using analysis::CallbackChange;

Json json_of(const std::optional<analysis::QuantileInterval>& interval) {
  if (!interval) return nullptr;
  return {{"estimate", interval->estimate.ns},
          {"lower", optional_json(interval->lower)},
          {"upper", optional_json(interval->upper)},
          {"estimate_is_lower_bound", interval->estimate.is_bound}};
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
          {"max_ns", optional_json(lateness->max)},
          {"max_is_lower_bound", lateness->is_max_bound},
          {"late_is_lower_bound", lateness->is_late_bound}};
}

Json json_of(const CallbackChange& change) {
  Json quantities = Json::array();
  for (const auto& quantity : change.quantities)
    quantities.push_back(json_of(quantity));
  return {{"logical_id", change.logical_id},
          {"before", change.is_before},
          {"after", change.is_after},
          {"processes_before", change.processes_before},
          {"processes_after", change.processes_after},
          {"instances_before", change.instances_before},
          {"instances_after", change.instances_after},
          {"incomplete_before", change.incomplete_before},
          {"incomplete_after", change.incomplete_after},
          {"absence", analysis::label(change.absence)},
          {"absence_proved", change.is_absence_proved},
          {"never_ends", change.never_ends},
          {"runs_less", change.runs_less},
          {"exceptions_before", optional_json(change.exceptions_before)},
          {"exceptions_after", optional_json(change.exceptions_after)},
          {"exceptions", analysis::label(change.exceptions)},
          {"missed_releases_before", optional_json(change.missed_before)},
          {"missed_releases_after", optional_json(change.missed_after)},
          {"missed_releases", analysis::label(change.missed)},
          {"lost_isolation", change.lost_isolation},
          {"regression", change.is_regression()},
          {"deadline_before", json_of(change.lateness_before)},
          {"deadline_after", json_of(change.lateness_after)},
          {"late", analysis::label(change.late)},
          {"quantities", std::move(quantities)},
          {"lost_samples_before", optional_json(change.lost_before)},
          {"lost_samples_after", optional_json(change.lost_after)},
          {"lost_samples", analysis::label(change.lost)},
          {"overwritten_samples_before", optional_json(change.overwritten_before)},
          {"overwritten_samples_after", optional_json(change.overwritten_after)},
          {"overwritten_samples", analysis::label(change.overwritten)},
          {"other_releases", change.has_other_releases}};
}

Json json_of(const analysis::ComparedRecord& record) {
  Json losses = Json::array();
  for (const auto& loss : record.losses) {
    losses.push_back({{"kind", analysis::label(loss.kind)}, {"count", loss.count}});
    if (!loss.advice.empty()) losses.back()["advice"] = loss.advice;
  }
  return {{"complete", record.is_complete}, {"losses", std::move(losses)}};
}

}  // namespace

void write_diff_json(std::ostream& out, const analysis::Comparison& comparison,
                     const DiffContext& context) {
  Json callbacks = Json::array();
  for (const auto& change : comparison.callbacks)
    callbacks.push_back(json_of(change));
  const auto outcome = comparison.outcome();
  write_json(out, {{"schema", "cie.diff/1"},
                   {"before", context.before},
                   {"after", context.after},
                   {"tolerance", context.tolerance},
                   {"confidence", 1 - analysis::kComparisonError},
                   {"regression", outcome == analysis::Outcome::regression},
                   {"outcome", analysis::label(outcome)},
                   {"record_before", json_of(comparison.before)},
                   {"record_after", json_of(comparison.after)},
                   {"callbacks", std::move(callbacks)}});
}

}  // namespace cie::viewer_export
