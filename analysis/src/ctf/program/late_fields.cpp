#include "late_fields.hpp"

namespace cie::analysis::ctf {

void translate(const EventPlan& plan, const Payload& payload, VocabularyState& state, Event& event,
               EventBatch& batch, const ShownFields& shown) {
  if (plan.is_shown) {
    auto other = plan.other;
    other.context = shown.context();
    other.fields = shown.values();
    event.body = other;
    batch.keep(event);
  } else {
    translate(plan, payload, state, event, batch);
  }
}

void translate(const EventPlan& plan, const Payload& payload, VocabularyState& state, Event& event,
               EventBatch& batch) {
  if (plan.translation == nullptr) {
    event.body = plan.other;
    batch.keep(event);
  } else {
    batch.translate(event, *plan.translation, payload, state);
  }
}

void LateFields::OfTrace::fill(const EventPlan& plan, const Late& late, EventBatch& batch) {
  const auto& layout = *plan.fixed;
  auto& head = late.event->head;
  layout.context[slot(ContextSlot::pid)].get(late.body, head.pid);
  layout.context[slot(ContextSlot::tid)].get(late.body, head.tid);
  const Payload fields(late.body, layout.fields.data());
  const auto* translation = plan.translation;
  if (translation != nullptr && translation->translate == nullptr) {
    batch.keep_raw(*late.event, *translation, fields);
  } else {
    translate(plan, fields, state_, *late.event, batch);
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

}  // namespace cie::analysis::ctf
