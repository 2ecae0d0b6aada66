#include "late_fields.hpp"

namespace cie::analysis::ctf {

void LateFields::OfTrace::translate(const EventPlan& plan, const Payload& payload,
                                    const ShownFields& shown, Event& event, EventBatch& batch) {
  if (plan.is_shown) {
    auto other = plan.other;
    other.context = shown.context();
    other.fields = shown.values();
    event.body = other;
    batch.keep(event);
  } else {
    translate(plan, payload, event, batch);
  }
}

void LateFields::OfTrace::fill(const EventPlan& plan, EventBatch& batch) {
  auto& events = classes_[plan.number];
  for (const auto& late : events)
    fill(plan, late, batch);
  events.clear();
}

void LateFields::fill(EventBatch& batch) {
  for (const auto& [trace, plan] : waiting_)
    trace->fill(*plan, batch);
  waiting_.clear();
}

void LateFields::complete(EventBatch& batch) {
  fill(batch);
  if (translator_ != nullptr) translator_->observe(batch);
}

}  // namespace cie::analysis::ctf
