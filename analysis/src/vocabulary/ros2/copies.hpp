// One event that several LTTng sessions recorded at once: a copy is known by what it says, and by who
// said it last.
#pragma once

#include <cie/analysis/event.hpp>

#include "vocabulary/field.hpp"
#include "vocabulary/vocabulary.hpp"

#include <cstdint>
#include <optional>

namespace cie::analysis::ros2 {

// What tells an event of this project's own from others of its thread. Empty: it says the same as often
// as it is told.
std::optional<std::uint64_t> digest_of(const EventBody& body);

// The last event of a thread. A tracepoint writes to one session after the other before the thread
// goes on, so that copies follow each other; and no session has two of one event.
class LastRecorded {
 public:
  // Whether another session had the event: the thread's next one, in a session's trace.
  bool is_copy(std::uint32_t trace, const Translation& translation, const Payload& fields);
  // The same of an event of this project's own.
  bool is_copy(std::uint32_t trace, std::uint64_t digest);

 private:
  // Of one translation; null: of an own event.
  bool is_copy(std::uint32_t trace, const Translation* translation, std::uint64_t digest);

  const Translation* translation_ = nullptr;
  std::uint64_t digest_ = 0;
  std::uint64_t traces_ = 0;  // that have it: bits, which those of more than 64 sessions share
};

}  // namespace cie::analysis::ros2
