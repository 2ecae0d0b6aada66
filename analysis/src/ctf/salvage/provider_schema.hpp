// How CTF metadata says what the provider `cie` records, for recordings that have lost their own.
#pragma once

#include "vocabulary/provider_events.hpp"

#include <cstdint>
#include <span>
#include <string>

namespace cie::analysis::ctf {

// The events that `cie record` has in its channel "state", and those in "events" in the order in
// which the provider defines them, which is that of their ids.
std::span<const ProviderEvent> state_channel_events();
// The same of recordings without the field that run_begin was given last.
std::span<const ProviderEvent> old_state_channel_events();
std::span<const ProviderEvent> event_channel_events();

// Metadata of a trace with a monotonic clock in nanoseconds, without streams and events.
struct TraceOrigin {
  std::string uuid;
  std::string host;
  std::string clock_uuid;            // the boot id; empty: unknown
  std::int64_t clock_offset_ns = 0;  // CLOCK_REALTIME - CLOCK_MONOTONIC
};
std::string trace_text(const TraceOrigin& origin);
// A class of streams as LTTng-UST 2.13 writes them, with the contexts vpid and vtid.
std::string stream_text(std::uint64_t stream);
std::string event_text(const ProviderEvent& event, std::uint64_t id, std::uint64_t stream);

}  // namespace cie::analysis::ctf
