#include <cie/analysis/report_rows.hpp>
#include <cie/viewer_export/schedulability_writers.hpp>

#include "json.hpp"

namespace cie::viewer_export {
namespace {

using analysis::CallbackSchedulability;

Json json_of(const std::optional<analysis::TaskParameter>& parameter) {
  if (!parameter) return nullptr;
  return {{"ns", parameter->ns}, {"source", analysis::label(parameter->source)}};
}

Json json_of(const CallbackSchedulability& callback, const analysis::ProcessReport& process) {
  Json explanations = Json::array();
  for (const auto& [kind, text, ns] : callback.explanations)
    explanations.push_back({{"kind", kind}, {"ns", ns}, {"text", text}});
  const bool is_fixed_priority = callback.policy == "SCHED_FIFO" || callback.policy == "SCHED_RR";
  return {{"logical_id", callback.logical_id},
          {"pid", process.pid},
          {"tid", optional_json(callback.tid)},
          {"policy", callback.policy.empty() ? Json(nullptr) : Json(callback.policy)},
          {"priority", is_fixed_priority ? Json(callback.priority) : Json(nullptr)},
          {"cpus", callback.cpus},
          {"runtime_ns", optional_json(callback.runtime_ns)},
          {"execution", json_of(callback.execution)},
          {"waiting_ns", optional_json(callback.waiting_ns)},
          {"runs", callback.runs},
          {"runs_measured", callback.runs_measured},
          {"period", json_of(callback.period)},
          {"deadline", json_of(callback.deadline)},
          {"method", callback.method == analysis::BoundMethod::none
                         ? Json(nullptr)
                         : Json(analysis::label(callback.method))},
          {"bound_ns", optional_json(callback.bound_ns)},
          {"reason", callback.reason.empty() ? Json(nullptr) : Json(callback.reason)},
          {"observed_ns", optional_json(callback.observed_ns)},
          {"meets_deadline", optional_json(callback.meets_deadline())},
          {"above_bound", callback.is_above_bound()},
          {"flagged", callback.is_flagged},
          {"explanations", std::move(explanations)},
          {"index", static_cast<std::uint32_t>(callback.index)}};
}

Json json_of(const analysis::CpuDemand& demand) {
  return {{"cpu", demand.cpu}, {"real_time_ppb", optional_json(demand.real_time_ppb)}};
}

Json json_of(const analysis::DeadlineAdmission& admission) {
  return {{"cpus", admission.cpus},
          {"threads", admission.servers},
          {"processors", admission.processors},
          {"reserved_ppb", optional_json(admission.reserved_ppb)},
          {"admissible_ppb", admission.admissible_ppb},
          {"guaranteed", optional_json(admission.is_guaranteed)}};
}

// Rows have their host's name where there are several.
template <typename Row>
Json array_of(const std::vector<Row>& rows) {
  Json array = Json::array();
  for (const auto& row : rows) {
    array.push_back(json_of(row));
    if (!row.host.empty()) array.back()["host"] = row.host;
  }
  return array;
}

}  // namespace

void write_schedulability_json(std::ostream& out, const analysis::SchedulabilityReport& report,
                               const analysis::Report& of) {
  const analysis::ReportRows rows(of);
  Json callbacks = Json::array();
  for (const auto& callback : report.callbacks) {
    const auto& process = rows.process_of(callback);
    callbacks.push_back(json_of(callback, process));
    if (of.trace.hosts.size() > 1) callbacks.back()["host"] = process.host;
  }
  // One object, or a list of them.
  Json deadline = array_of(report.deadline);
  if (report.deadline.empty()) deadline = nullptr;
  if (report.deadline.size() == 1 && report.deadline.front().host.empty()) deadline = deadline[0];
  Json document{
      {"schema", "cie.schedulability/1"},
      {"finding", report.has_finding()},
      {"deadlines", {{"count", report.deadlines()}, {"decided", report.decided_deadlines()}}},
      {"callbacks", std::move(callbacks)},
      {"cpus", array_of(report.cpus)},
      {"sched_deadline", std::move(deadline)},
      {"outside", report.outside}};
  if (const auto window = analysis::asked_window(of.trace))
    document["window"] = {{"begin_ns", window->from.ns}, {"end_ns", window->to.ns}};
  write_json(out, document);
}

}  // namespace cie::viewer_export
