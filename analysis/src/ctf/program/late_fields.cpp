#include "late_fields.hpp"

#include <algorithm>

namespace cie::analysis::ctf {

LateFields::OfTrace::OfTrace(LateFields& all, std::shared_ptr<const TracePlan> plan,
                             VocabularyState& state, PidNamespaces& namespaces)
    : all_(all),
      plan_(std::move(plan)),
      state_(state),
      namespaces_(plan_->domain == Domain::user && plan_->tells_pid_namespace ? &namespaces
                                                                              : nullptr),
      waiting_(plan_->event_classes()) {
  for (std::size_t i = 0; i < waiting_.size(); ++i)
    waiting_[i].plan = &plan_->event_class(i);
}

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

void LateFields::OfTrace::make_room(Waiting& waiting) {
  constexpr std::size_t kFirst = 16;
  auto& room = waiting.room;
  const auto used = static_cast<std::size_t>(waiting.end == nullptr ? 0 : room.size());
  if (used == 0) all_.waiting_.push_back({this, &waiting});
  if (used == room.size()) room.resize(std::max(kFirst, 2 * used));
  waiting.next = room.data() + used;
  waiting.end = room.data() + room.size();
}

void LateFields::OfTrace::fill(Waiting& waiting, EventBatch& batch) {
  const auto& plan = *waiting.plan;
  // Copies, which nothing that is written could change.
  const auto pid = plan.fixed->context[slot(ContextSlot::pid)];
  const auto tid = plan.fixed->context[slot(ContextSlot::tid)];
  const bool tells_namespace = has_namespace(plan);
  const auto* const translation = plan.translation;
  Payload fields(nullptr, plan.fixed->fields.data());
  for (const auto* late = waiting.room.data(); late != waiting.next; ++late) {
    auto& event = *late->event;
    pid.get(late->body, event.head.pid);
    tid.get(late->body, event.head.tid);
    if (tells_namespace) tell_apart(plan, late->body, event.head);
    if (translation == nullptr) {
      leave_other(plan, event, batch);
    } else {
      fields.move_to(late->body);
      batch.translate(event, *translation, fields, state_);
    }
  }
  waiting.next = waiting.end = nullptr;
}

void LateFields::fill(EventBatch& batch) {
  for (const auto& [trace, events] : waiting_)
    trace->fill(*events, batch);
  waiting_.clear();
}

void LateFields::complete(EventBatch& batch) {
  fill(batch);
  if (translator_ != nullptr) translator_->observe(batch);
}

}  // namespace cie::analysis::ctf
