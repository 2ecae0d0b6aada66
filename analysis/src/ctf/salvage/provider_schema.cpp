#include "provider_schema.hpp"

#include <cie/tracepoints/schema.hpp>

#include <array>
#include <cstddef>

namespace cie::analysis::ctf {
namespace {

using Kind = ProviderField::Kind;

constexpr ProviderField u32(std::string_view name) { return {.name = name, .kind = Kind::u32}; }
constexpr ProviderField i32(std::string_view name) { return {.name = name, .kind = Kind::i32}; }
constexpr ProviderField u64(std::string_view name) { return {.name = name, .kind = Kind::u64}; }
constexpr ProviderField i64(std::string_view name) { return {.name = name, .kind = Kind::i64}; }
constexpr ProviderField count(std::string_view name) { return {.name = name, .kind = Kind::count}; }
constexpr ProviderField realtime(std::string_view name) {
  return {.name = name, .kind = Kind::realtime};
}
constexpr ProviderField realtime_or_nothing(std::string_view name) {
  return {.name = name, .kind = Kind::realtime_or_nothing};
}
constexpr ProviderField text(std::string_view name) { return {.name = name, .kind = Kind::text}; }
template <typename Enum>
constexpr ProviderField label(std::string_view name) {
  return {.name = name, .kind = Kind::label, .labels = Labels<Enum>::kValues};
}

constexpr std::array kRunBegin{u32("contract_version"),
                               text("tool_version"),
                               text("executor"),
                               text("boot_id"),
                               text("host"),
                               u32("pid"),
                               u64("pid_ns"),
                               i64("process_start_ns"),
                               i64("monotonic_ns"),
                               i64("realtime_ns"),
                               u32("online_cpus"),
                               text("spec_sha256"),
                               label<RunMoment>("moment")};
constexpr std::array kRunEnd{u32("callbacks"), u32("threads"), u32("groups"), u32("publishers"),
                             i32("status")};
constexpr std::array kNodeInit{u32("node_id"), text("name")};
constexpr std::array kGroupInit{u32("group_id"), u32("node_id"), label<GroupType>("type")};
constexpr std::array kCallbackInit{
    u32("callback_id"), u32("group_id"),    u32("node_id"), label<CallbackKind>("kind"),
    text("logical_id"), text("source"),     text("symbol"), u64("period_ns"),
    u32("queue_depth"), u64("deadline_ns"), u64("next_seq")};
constexpr std::array kCallbackFini{u32("callback_id"), u64("started"),     u64("ended"),
                                   u64("released"),    u64("overwritten"), u64("lost")};
constexpr std::array kPublisherInit{u32("publisher_id"), u32("node_id"), text("topic"),
                                    u64("writer_gid"), u64("next_seq")};
constexpr std::array kPublisherFini{u32("publisher_id"), u64("published")};
constexpr std::array kThreadInit{u32("tid"),         label<ThreadRole>("role"),
                                 u32("callback_id"), u32("group_id"),
                                 text("name"),       i64("start_ns")};
constexpr std::array kThreadFini{u32("tid"), u32("read_backs")};
constexpr std::array kThreadSched{u32("tid"),
                                  label<SchedMoment>("moment"),
                                  u32("n"),
                                  i32("policy"),
                                  u64("flags"),
                                  i32("nice"),
                                  u32("priority"),
                                  u64("runtime_ns"),
                                  u64("deadline_ns"),
                                  u64("period_ns"),
                                  ProviderField{.name = "cpus", .kind = Kind::u32_sequence},
                                  i32("error"),
                                  u64("slice_ns"),
                                  u32("util_min"),
                                  u32("util_max"),
                                  u32("change")};
constexpr std::array kClockSync{i64("monotonic_ns"), i64("realtime_ns")};
constexpr std::array kProcname{
    ProviderField{.name = "procname", .kind = Kind::characters, .length = 17}};

constexpr std::array kCallbackRelease{u32("callback_id"), count("release_seq"),
                                      count("overwritten")};
constexpr std::array kThreadWakeup{u32("callback_id"), label<WakeupReason>("reason")};
constexpr std::array kCallbackStart{
    u32("callback_id"), count("seq"),  label<ReleaseKind>("release_kind"),
    i64("release_ns"),  u32("missed"), realtime_or_nothing("source_timestamp_realtime_ns"),
    u64("writer_gid")};
constexpr std::array kCallbackEnd{u32("callback_id"), count("seq"),
                                  label<CallbackStatus>("status")};
constexpr std::array kPublish{u32("publisher_id"), count("seq"),
                              realtime("source_timestamp_realtime_ns")};
constexpr std::array kSampleLost{u32("callback_id"), u32("count"), count("total")};

constexpr std::array kStateEvents{ProviderEvent{"cie:run_begin", kRunBegin},
                                  ProviderEvent{"cie:run_end", kRunEnd},
                                  ProviderEvent{"cie:node_init", kNodeInit},
                                  ProviderEvent{"cie:group_init", kGroupInit},
                                  ProviderEvent{"cie:callback_init", kCallbackInit},
                                  ProviderEvent{"cie:callback_fini", kCallbackFini},
                                  ProviderEvent{"cie:publisher_init", kPublisherInit},
                                  ProviderEvent{"cie:publisher_fini", kPublisherFini},
                                  ProviderEvent{"cie:thread_init", kThreadInit},
                                  ProviderEvent{"cie:thread_fini", kThreadFini},
                                  ProviderEvent{"cie:thread_sched", kThreadSched},
                                  ProviderEvent{"cie:clock_sync", kClockSync},
                                  ProviderEvent{"lttng_ust_statedump:procname", kProcname}};
constexpr std::array kEvents{ProviderEvent{"cie:callback_release", kCallbackRelease},
                             ProviderEvent{"cie:thread_wakeup", kThreadWakeup},
                             ProviderEvent{"cie:callback_start", kCallbackStart},
                             ProviderEvent{"cie:callback_end", kCallbackEnd},
                             ProviderEvent{"cie:publish", kPublish},
                             ProviderEvent{"cie:sample_lost", kSampleLost}};

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
         field_text(i32("vpid")) + " " + field_text(i32("vtid")) + " }; };\n";
}

std::string event_text(const ProviderEvent& event, std::uint64_t id, std::uint64_t stream) {
  std::string text = "event { name = " + tsdl_string(event.name) + "; id = " + std::to_string(id) +
                     "; stream_id = " + std::to_string(stream) + "; fields := struct {";
  for (const auto& field : event.fields)
    text += " " + field_text(field);
  return text + " }; };\n";
}

}  // namespace cie::analysis::ctf
