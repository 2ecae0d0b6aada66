// Translates one event of a trace into an EventBody. A vocabulary knows names of events and fields
// and nothing else; what is behind it is one model.
#pragma once

#include <cie/analysis/event.hpp>

#include <cstdint>
#include <string_view>
#include <vector>

#include <babeltrace2/babeltrace.h>

namespace cie::analysis::bt {

// Where the fields of one event class lie: position in the payload by the order of `names` that
// the vocabulary asks for; -1 where the trace has no such field.
struct FieldTable {
  static FieldTable of(const bt_field_class* payload, const std::vector<std::string_view>& names);
  const bt_field* get(const bt_field* payload, std::size_t slot) const noexcept;
  std::vector<std::int32_t> positions;
};

// What translations of one trace share.
struct VocabularyState {
  std::vector<std::uint32_t> cpus;   // backs ThreadSched::cpus until the next event
  std::int32_t priority_offset = 0;  // added to get the kernel's own scale
};

// Reads a payload whose fields `table` found.
using Translate = EventBody (*)(const bt_field* payload, const FieldTable& table,
                                VocabularyState& state);

struct Translation {
  std::string_view event;  // full name, "cie:callback_start"
  std::vector<std::string_view> fields;
  Translate translate;
};

// The translations that know an event name; null if none does.
const Translation* find_translation(std::string_view event);

// The tables of each vocabulary.
const std::vector<Translation>& cie_vocabulary();
const std::vector<Translation>& kernel_vocabulary();

}  // namespace cie::analysis::bt
