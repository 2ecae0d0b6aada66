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
  Json json{{"logical_id", change.logical_id},
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
            {"lost_isolation", change.lost_isolation},
            {"regression", change.is_regression()},
            {"deadline_before", json_of(change.lateness_before)},
            {"deadline_after", json_of(change.lateness_after)},
            {"quantities", std::move(quantities)},
            {"other_releases", change.has_other_releases}};
  for (const auto which : analysis::kCounts) {
    const std::string name(analysis::label(which));
    const auto& count = change.of(which);
    json[name] = analysis::label(count.change);
    if (which == analysis::Count::late) continue;  // deadline_before and deadline_after have it
    json[name + "_before"] = optional_json(count.before);
    json[name + "_after"] = optional_json(count.after);
  }
  return json;
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
