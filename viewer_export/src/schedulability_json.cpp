#include <cie/viewer_export/schedulability_writers.hpp>

#include "json.hpp"

namespace cie::viewer_export {
namespace {

using analysis::CallbackSchedulability;

Json json_of(const std::optional<analysis::TaskParameter>& parameter) {
  if (!parameter) return nullptr;
  return {{"ns", parameter->ns}, {"source", analysis::label(parameter->source)}};
}

Json json_of(const CallbackSchedulability& callback) {
  Json explanations = Json::array();
  for (const auto& [kind, text, ns] : callback.explanations)
    explanations.push_back({{"kind", kind}, {"ns", ns}, {"text", text}});
  const bool is_fixed_priority = callback.policy == "SCHED_FIFO" || callback.policy == "SCHED_RR";
  return {{"logical_id", callback.logical_id},
          {"pid", callback.pid},
          {"tid", optional_json(callback.tid)},
          {"policy", callback.policy.empty() ? Json(nullptr) : Json(callback.policy)},
          {"priority", is_fixed_priority ? Json(callback.priority) : Json(nullptr)},
          {"cpus", callback.cpus},
          {"execution", json_of(callback.execution)},
          {"period", json_of(callback.period)},
          {"deadline", json_of(callback.deadline)},
          {"method", analysis::label(callback.method)},
          {"bound_ns", optional_json(callback.bound_ns)},
          {"reason", callback.bound_ns ? Json(nullptr) : Json(callback.reason)},
          {"observed_ns", optional_json(callback.observed_ns)},
          {"meets_deadline", optional_json(callback.meets_deadline())},
          {"above_bound", callback.is_above_bound()},
          {"flagged", callback.is_flagged},
          {"explanations", std::move(explanations)}};
}

}  // namespace

void write_schedulability_json(std::ostream& out, const analysis::SchedulabilityReport& report) {
  Json callbacks = Json::array();
  for (const auto& callback : report.callbacks)
    callbacks.push_back(json_of(callback));
  Json cpus = Json::array();
  for (const auto& demand : report.cpus)
    cpus.push_back({{"cpu", demand.cpu}, {"real_time_ppb", demand.real_time_ppb}});
  Json deadline = nullptr;
  if (const auto& admission = report.deadline) {
    deadline = {{"threads", admission->servers},
                {"processors", admission->processors},
                {"reserved_ppb", admission->reserved_ppb},
                {"admissible_ppb", admission->admissible_ppb},
                {"guaranteed", admission->is_guaranteed}};
  }
  write_json(out, {{"schema", "cie.schedulability/1"},
                   {"finding", report.has_finding()},
                   {"callbacks", std::move(callbacks)},
                   {"cpus", std::move(cpus)},
                   {"sched_deadline", std::move(deadline)},
                   {"outside", report.outside}});
}

}  // namespace cie::viewer_export
