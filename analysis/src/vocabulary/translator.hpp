// What says what events mean whose meaning depends on earlier ones.
#pragma once

#include <cie/analysis/event.hpp>

#include "event_batch.hpp"
#include "field.hpp"
#include "vocabulary.hpp"

namespace cie::analysis {

// Of one recording. Events come in their order, each to one of the first two functions.
class Translator {
 public:
  virtual ~Translator() = default;

  // What the batch's last event means, whose translation has no more than a kind; all of it
  // is_derived. Its head is complete; its body becomes what it means, if that is one thing, else an
  // OtherEvent, and the rest is added to the batch. Heeds the batch's events before it. `fields` are
  // read during the call only. False: it tells nothing, and the batch need not keep it.
  virtual bool translate(Event& event, const Translation& translation, const Payload& fields,
                         EventBatch& batch) = 0;
  // Learns from the batch's new events, which are complete, and completes what they say.
  virtual void observe(EventBatch& batch) = 0;
  // The trace ended: adds what was still to be told.
  virtual void finish(EventBatch& batch) = 0;

 protected:
  Translator() = default;
  Translator(const Translator&) = default;
  Translator& operator=(const Translator&) = default;
};

// Completes the batch's last event, which has its head: by its translation, or by the translator if
// that has no more than a kind. Null: nobody asks what such events mean. False: see Translator.
inline bool translate(Event& event, const Translation& translation, const Payload& fields,
                      VocabularyState& state, EventBatch& batch, Translator* translator) {
  if (translation.translate == nullptr && translator != nullptr) {
    return translator->translate(event, translation, fields, batch);
  }
  batch.translate(event, translation, fields, state);
  return true;
}

}  // namespace cie::analysis
