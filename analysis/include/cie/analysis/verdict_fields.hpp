// The fields of verdicts, each named once: see report_fields.hpp.
#pragma once

#include <cie/analysis/report_fields.hpp>
#include <cie/analysis/verdict.hpp>

#include <optional>
#include <string_view>

namespace cie::analysis {

void fields(auto& visit, Is<Evidence> auto& e) {
  visit("event", e.event);
  visit("time_ns", e.time);
  visit("cpu", e.cpu);
  visit("pid", e.pid);
  visit("tid", e.tid);
  visit.sentence("note", e.note);
  visit.text("stream", e.file);
  visit("packet", e.packet);
}

inline std::string_view state(const Suppression& suppression) {
  return suppression.is_expired ? "expired" : "active";
}

// Where it stands, and who says so; the list that has it says which subjects it is for.
void fields(auto& visit, Is<Suppression> auto& s) {
  visit.derived("state", state(s));
  visit("reason", s.reason);
  visit("expires", s.expires);
  visit("place", s.place);
}

void fields(auto& visit, Is<SubjectVerdict> auto& s) {
  visit("subject", s.subject);
  visit("verdict", s.verdict);
  visit("checked", s.checked);
  visit("evidence", s.evidence);
  visit("kind", s.about.kind);
  visit("index", s.about.index);
  visit.number("process", s.about.process);
  visit.present("suppression", s.suppression);
  // That of several subjects of one name; the contract has the name alone.
  const auto name = s.ordinal.empty() ? std::nullopt : std::optional(s.name_told_apart());
  visit.present("name", name);
}

void fields(auto& visit, Is<RuleVerdict> auto& r) {
  visit("id", r.id);
  visit("name", r.name);
  visit("verdict", r.verdict);
  visit("subjects", r.subjects);
}

void fields(auto& visit, Is<SuppressionUse> auto& u) {
  visit("rule", u.suppression.rule);
  visit("subject", u.suppression.subject);
  visit("reason", u.suppression.reason);
  visit("expires", u.suppression.expires);
  visit("place", u.suppression.place);
  visit.derived("state", state(u.suppression));
  visit("matched", u.matched);
}

void fields(auto& visit, Is<SuppressionReport> auto& r) {
  visit("date", r.date);
  visit("entries", r.uses);
}

void fields(auto& visit, Is<TimeWindow> auto& w) {
  visit("begin_ns", w.from);
  visit("end_ns", w.to);
}

}  // namespace cie::analysis
