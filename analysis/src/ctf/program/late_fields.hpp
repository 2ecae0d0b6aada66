// Events that have their place in a batch, while their fields still lie in the streams' windows.
#pragma once

#include <cie/analysis/event.hpp>

#include "shown_fields.hpp"
#include "trace_plan.hpp"
#include "vocabulary/event_batch.hpp"
#include "vocabulary/pid_namespaces.hpp"
#include "vocabulary/translator.hpp"
#include "vocabulary/vocabulary.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace cie::analysis::ctf {

// Fills them class by class: which class follows on which cannot be predicted where streams are
// merged, and a wrong guess costs the processor more than an event's fields. Events whose meaning
// depends on earlier ones are given to a translator as they come.
class LateFields {
 public:
  // The events that one plan describes.
  class OfTrace {
   public:
    // Borrowed: `state`, which the plans of one trace share, and `namespaces`, which those of one host do.
    OfTrace(LateFields& all, std::shared_ptr<const TracePlan> plan, VocabularyState& state,
            PidNamespaces& namespaces);

    const TracePlan& plan() const noexcept { return *plan_; }
    // An event of an application has that namespace. The kernel's pids are those of all of the host.
    void tell_apart(std::optional<std::int64_t> inode, EventHead& head) {
      if (inode && namespaces_ != nullptr)
        namespaces_->tell_apart(static_cast<std::uint64_t>(*inode), head);
    }
    // Completes an event of the batch that has its head with its other fields, those that are shown
    // if the event is. No event waits for its own.
    void translate(const EventPlan& plan, const Payload& payload, const ShownFields& shown,
                   Event& event, EventBatch& batch);
    // `event`: complete but for what its thread and its fields are; `event_class`: its plan's number;
    // `body`: those, of fixed layout. Both stay where they are until fill().
    // Those that wait for none are filled at once. False: it tells nothing, see Translator.
    [[gnu::always_inline]] bool add(std::size_t event_class, Event& event, const std::uint8_t* body,
                                    EventBatch& batch) {
      auto& waiting = waiting_[event_class];
      if (waiting.next == waiting.end) [[unlikely]] {
        if (waiting.plan->is_filled_at_once) return fill(*waiting.plan, {&event, body}, batch);
        make_room(waiting);
      }
      *waiting.next++ = {&event, body};
      return true;
    }

   private:
    friend class LateFields;
    struct Late {
      Event* event = nullptr;
      const std::uint8_t* body = nullptr;
    };
    // Events of one class. Without any there is no room, so that the first one has to ask for it.
    struct Waiting {
      Late* next = nullptr;  // where there is room for one
      Late* end = nullptr;   // of the room
      const EventPlan* plan = nullptr;
      std::vector<Late> room{};
    };
    void make_room(Waiting& waiting);
    bool has_namespace(const EventPlan& plan) const noexcept {
      return namespaces_ != nullptr &&
             plan.fixed->context[slot(ContextSlot::pid_ns)].kind == FixedField::Kind::integer;
    }
    void tell_apart(const EventPlan& plan, const std::uint8_t* body, EventHead& head) {
      namespaces_->tell_apart(plan.fixed->context[slot(ContextSlot::pid_ns)].load_unsigned(body),
                              head);
    }
    static void leave_other(const EventPlan& plan, Event& event, EventBatch& batch) {
      event.body.emplace<OtherEvent>(plan.other);
      batch.keep(event);
    }
    bool fill(const EventPlan& plan, const Late& late, EventBatch& batch);
    void fill(Waiting& waiting, EventBatch& batch);
    [[gnu::always_inline]] bool translate(const EventPlan& plan, const Payload& payload,
                                          Event& event, EventBatch& batch);

    LateFields& all_;
    std::shared_ptr<const TracePlan> plan_;
    VocabularyState& state_;
    PidNamespaces* namespaces_;     // null: none is told, or it is the kernel's
    std::vector<Waiting> waiting_;  // by EventPlan::number
  };

  // `translator` is borrowed. Null: what it would say is not asked for.
  explicit LateFields(Translator* translator) : translator_(translator) {}
  LateFields(const LateFields&) = delete;
  LateFields& operator=(const LateFields&) = delete;

  // Before anything moves in a window, and before the batch that has the events is passed on.
  void complete(EventBatch& batch);

 private:
  void fill(EventBatch& batch);

  Translator* translator_;
  struct Class {
    OfTrace* trace;
    OfTrace::Waiting* events;
  };
  std::vector<Class> waiting_;  // of which events wait
};

[[gnu::always_inline]] inline bool LateFields::OfTrace::fill(const EventPlan& plan,
                                                             const Late& late, EventBatch& batch) {
  const auto& layout = *plan.fixed;
  auto& head = late.event->head;
  layout.context[slot(ContextSlot::pid)].get(late.body, head.pid);
  layout.context[slot(ContextSlot::tid)].get(late.body, head.tid);
  if (has_namespace(plan)) tell_apart(plan, late.body, head);
  const Payload fields(late.body, layout.fields.data());
  return translate(plan, fields, *late.event, batch);
}

[[gnu::always_inline]] inline bool LateFields::OfTrace::translate(const EventPlan& plan,
                                                                  const Payload& payload,
                                                                  Event& event, EventBatch& batch) {
  const auto* translation = plan.translation;
  if (translation == nullptr) {
    leave_other(plan, event, batch);
    return true;
  }
  // The translator heeds those before it, which must be complete then.
  if (translation->translate == nullptr && !all_.waiting_.empty()) all_.fill(batch);
  return analysis::translate(event, *translation, payload, state_, batch, all_.translator_);
}

}  // namespace cie::analysis::ctf
