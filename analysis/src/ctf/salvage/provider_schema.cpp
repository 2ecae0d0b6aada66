#include "provider_schema.hpp"

#include <cie/tracepoints/recording_layout.hpp>

#include <algorithm>
#include <array>
#include <cstddef>

namespace cie::analysis::ctf {
namespace {

using Kind = ProviderField::Kind;

constexpr std::array kStateEvents{
    provider::kRunBegin,      provider::kRunEnd,        provider::kNodeInit,
    provider::kGroupInit,     provider::kCallbackInit,  provider::kCallbackFini,
    provider::kPublisherInit, provider::kPublisherFini, provider::kThreadInit,
    provider::kThreadFini,    provider::kThreadSched,   provider::kClockSync,
    provider::kProcname};
static_assert(std::ranges::equal(kStateEvents, cie::kStateEvents, {}, &ProviderEvent::name));
// As recordings have it that are older than its last field.
constexpr ProviderEvent kOldRunBegin{
    provider::kRunBegin.name,
    provider::kRunBegin.fields.first(provider::kRunBegin.fields.size() - 1)};
constexpr std::array kOldStateEvents = [] {
  auto events = kStateEvents;
  events.front() = kOldRunBegin;
  return events;
}();
constexpr std::array kEvents{provider::kCallbackRelease, provider::kThreadWakeup,
                             provider::kCallbackStart,   provider::kCallbackEnd,
                             provider::kPublish,         provider::kSampleLost,
                             provider::kPublishFailed};

std::string integer(int bits, bool is_signed) {
  return "integer { size = " + std::to_string(bits) +
         "; align = 8; signed = " + (is_signed ? "1" : "0") + "; }";
}

std::string field_text(const ProviderField& field) {
  const auto name = "_" + std::string(field.name);
  switch (field.kind) {
    case Kind::u32:
      return integer(32, false) + " " + name + ";";
    case Kind::i32:
      return integer(32, true) + " " + name + ";";
    case Kind::u64:
    case Kind::count:
      return integer(64, false) + " " + name + ";";
    case Kind::i64:
    case Kind::realtime:
    case Kind::realtime_or_nothing:
      return integer(64, true) + " " + name + ";";
    case Kind::label: {
      std::string text = "enum : " + integer(8, false) + " {";
      for (std::size_t i = 0; i < field.labels.size(); ++i)
        text += " \"" + std::string(field.labels[i]) + "\" = " + std::to_string(i) + ",";
      return text + " } " + name + ";";
    }
    case Kind::text:
      return "string " + name + ";";
    case Kind::u32_sequence:
      return integer(32, false) + " _" + name + "_length; " + integer(32, false) + " " + name +
             "[ _" + name + "_length ];";
    case Kind::characters:
      return "integer { size = 8; align = 8; signed = 1; encoding = UTF8; } " + name + "[" +
             std::to_string(field.length) + "];";
  }
  return {};
}

// A text within quotes of TSDL.
std::string tsdl_string(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + '"';
}

}  // namespace

std::span<const ProviderEvent> state_channel_events() { return kStateEvents; }
std::span<const ProviderEvent> old_state_channel_events() { return kOldStateEvents; }
std::span<const ProviderEvent> event_channel_events() { return kEvents; }

std::string trace_text(const TraceOrigin& origin) {
  std::string text = R"(/* CTF 1.8 */
typealias integer { size = 8; align = 8; signed = 0; } := uint8_t;
typealias integer { size = 16; align = 8; signed = 0; } := uint16_t;
typealias integer { size = 32; align = 8; signed = 0; } := uint32_t;
typealias integer { size = 64; align = 8; signed = 0; } := uint64_t;
)";
  text += "trace { major = 1; minor = 8; byte_order = le; uuid = " + tsdl_string(origin.uuid) +
          R"(; packet.header := struct { uint32_t magic; uint8_t uuid[16]; uint32_t stream_id;
  uint64_t stream_instance_id; }; };
)";
  text += "env { domain = \"ust\"; tracer_name = \"lttng-ust\"; hostname = " +
          tsdl_string(origin.host) +
          "; };\nclock { name = \"monotonic\"; freq = 1000000000; offset = " +
          std::to_string(origin.clock_offset_ns) + ";";
  if (!origin.clock_uuid.empty()) text += " uuid = " + tsdl_string(origin.clock_uuid) + ";";
  return text + R"( };
typealias integer { size = 32; align = 8; signed = 0; map = clock.monotonic.value; } := time32_t;
typealias integer { size = 64; align = 8; signed = 0; map = clock.monotonic.value; } := time64_t;
struct packet_context { time64_t timestamp_begin; time64_t timestamp_end; uint64_t content_size;
  uint64_t packet_size; uint64_t packet_seq_num; uint64_t events_discarded; uint32_t cpu_id; };
struct event_header_large { enum : uint16_t { compact = 0 ... 65534, extended = 65535 } id;
  variant <id> { struct { time32_t timestamp; } compact;
    struct { uint32_t id; time64_t timestamp; } extended; } v; } align(8);
)";
}

std::string stream_text(std::uint64_t stream) {
  return "stream { id = " + std::to_string(stream) +
         "; event.header := struct event_header_large; packet.context := struct packet_context;\n"
         "  event.context := struct { " +
         field_text(provider::i32("vpid")) + " " + field_text(provider::i32("vtid")) + " }; };\n";
}

std::string event_text(const ProviderEvent& event, std::uint64_t id, std::uint64_t stream) {
  std::string text = "event { name = " + tsdl_string(event.name) + "; id = " + std::to_string(id) +
                     "; stream_id = " + std::to_string(stream) + "; fields := struct {";
  for (const auto& field : event.fields)
    text += " " + field_text(field);
  return text + " }; };\n";
}

}  // namespace cie::analysis::ctf
