// Where a recording does not show what happened, and what would have to be hidden there.
#pragma once

#include "cie/analysis/identity.hpp"
#include "cie/analysis/time.hpp"
#include "event_kinds.hpp"

#include <cstdint>
#include <optional>
#include <vector>

namespace cie::analysis {

// Whose events. What is empty is any.
struct Scope {
  std::optional<HostIndex> host{};
  std::optional<std::int32_t> cpu{};
  std::optional<ProcessIndex> process{};
  std::optional<ThreadIndex> thread{};
  std::optional<CallbackIndex> callback{};
  friend bool operator==(const Scope&, const Scope&) = default;
};

// Why a recording has a gap.
enum class GapCause : std::uint8_t {
  loss,             // discarded events or packets, packets that cannot be decoded
  unaccounted,      // numbers or totals show that events are missing, and no other gap holds them
  stream_edge,      // what a stream did not cover yet, or any more, that is judged all the same
  missing_part,     // a file, chunk or session that a manifest names
  recorder_failed,  // it was killed, or its disk was full
  attached_late,    // recording began on a process that ran already
  window,           // --window, or a snapshot
  not_recorded,     // an event class or a context
  unseen_entities,  // callbacks that this tracer has no events for
  reused_identity,  // an address, pid or tid may have another owner
  clock,            // it was set, or clocks of hosts are known to within an error
  kernel_hole,      // a CPU's chain of context switches is broken, or it has no stream
};

struct Reason {
  GapCause cause{};
  Timestamp at{};  // where the recording shows it
  std::uint32_t about =
      0;  // of `loss` the place in the model's losses, else in the list of what facts show
  friend bool operator==(const Reason&, const Reason&) = default;
};

// From `window.from` to `window.to`, both included, events of these kinds and this scope may be missing.
struct Gap {
  Scope scope{};
  EventKinds kinds{};
  TimeWindow window{};
  std::optional<std::uint64_t> at_most{};  // events, where the tracer counts them
  Reason reason{};
};

// An event that would have to be hidden for something to be so. Its scope names all that is known of it: who knows the
// thread names the process and the host, too.
struct Hidden {
  EventKinds kinds{};  // any of them
  Scope scope{};
  TimeWindow window{};
  // It belongs to a numbering that no event shows (a spin that nobody saw), so the proofs of another do not hold for it.
  bool is_unnumbered = false;
};

// They would all have to be hidden.
using Conjunction = std::vector<Hidden>;

inline Hidden hidden(EventKinds kinds, const Scope& scope, Timestamp from = kEarliest,
                     Timestamp to = kLatest) {
  return {.kinds = kinds, .scope = scope, .window = {.from = from, .to = to}};
}

}  // namespace cie::analysis
