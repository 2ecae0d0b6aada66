// The provider `cie` as LTTng-UST records it: its events' fields and how CTF metadata says them.
// For recordings that have lost their own metadata; tests/live compares it with a real recording.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace cie::analysis::ctf {

struct ProviderField {
  enum class Kind : std::uint8_t {
    u32,
    i32,
    u64,
    i64,
    count,                // u64 that counts something from 0 on
    realtime,             // i64, nanoseconds since 1970
    realtime_or_nothing,  // the same, or 0
    label,
    text,
    u32_sequence,
    characters
  };
  std::string_view name;
  Kind kind = Kind::u32;
  std::span<const std::string_view> labels{};  // of a label, which is one byte
  std::uint32_t length = 0;                    // of an array of characters
};

struct ProviderEvent {
  std::string_view name;  // full
  std::span<const ProviderField> fields;
};

// The events that `cie record` has in its channel "state", and those in "events" in the order in
// which the provider defines them, which is that of their ids.
std::span<const ProviderEvent> state_channel_events();
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
