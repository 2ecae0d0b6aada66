// Translates one event of a trace into an EventBody. A vocabulary knows names of events and fields
// and nothing else; what is behind it is one model, what is before it is any reader.
#pragma once

#include <cie/analysis/event.hpp>

#include "field.hpp"

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace cie::analysis {

// What translations of one trace share.
struct VocabularyState {
  std::int32_t priority_offset = 0;  // added to get the kernel's own scale
};

// Fills `body` from the fields that the translation asked for.
using Translate = void (*)(const Payload& payload, VocabularyState& state, EventBody& body);

struct Translation {
  std::string_view event;  // full name, "cie:callback_start"
  std::vector<FieldRequest> fields;
  // Null: what the event means depends on earlier ones, so that a translator with a memory has to
  // say what follows from it (ros2/event_translator).
  Translate translate;
  std::uint32_t kind = 0;  // then: what that translator calls it
  // The last field is no field of the event, but what the common context calls its thread.
  bool has_thread_name = false;
  bool starts_callback = false;  // it tells that one begins to run
};

// The translations that know an event name; null if none does.
const Translation* find_translation(std::string_view event);

// The same for a class of events; null also if it lacks a field that is needed. `has_slot` says of
// a slot whether the class has its field; of a thread's name it is not asked.
template <typename HasSlot>
const Translation* if_whole(const Translation* translation, const HasSlot& has_slot) {
  if (translation == nullptr) return nullptr;
  for (std::size_t slot = 0; slot < translation->fields.size(); ++slot) {
    if (translation->fields[slot].is_needed && !has_slot(slot)) return nullptr;
  }
  return translation;
}

// Whether some translation says of it that a callback begins to run.
bool is_callback_start(std::string_view event);

// ROS 2's events that tell of clients and of services, of either tracer.
bool is_client_init(std::string_view event);
bool is_service_init(std::string_view event);

// Whether it is of the kernel's vocabulary: those share a state, so that their order counts.
bool is_kernel_event(std::string_view event);

// The tables of each vocabulary. At most kMaxSlots fields each.
const std::vector<Translation>& cie_vocabulary();
const std::vector<Translation>& ros2_vocabulary();  // ROS 2's tracers: see ../ros2
const std::vector<Translation>& kernel_vocabulary();
const std::vector<Translation>& lttng_vocabulary();  // what LTTng itself says of a process

// Where every tracer writes who emitted an event: process, thread, what that is called, and the pid
// namespace of both.
const std::vector<FieldRequest>& context_requests();

}  // namespace cie::analysis
