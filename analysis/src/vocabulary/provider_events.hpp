// The events of the provider `cie` as LTTng-UST records them, in the order in which the provider defines
// them: the reader's table of their fields' names and types. The writer's is provider.h, in
// tracepoints/provider; tests hold this one against real recordings.
#pragma once

#include <cie/tracepoints/schema.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string_view>

namespace cie::analysis {

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
  bool is_needed = false;                      // see FieldRequest
};

struct ProviderEvent {
  std::string_view name;  // full
  std::span<const ProviderField> fields;

  // Where a field stands in it. What it does not have is refused by the compiler.
  consteval std::size_t operator[](std::string_view field) const {
    for (std::size_t i = 0; i < fields.size(); ++i) {
      if (fields[i].name == field) return i;
    }
    throw std::out_of_range("no such field");
  }
};

namespace provider {

constexpr ProviderField u32(std::string_view name) {
  return {.name = name, .kind = ProviderField::Kind::u32, .is_needed = true};
}
constexpr ProviderField i32(std::string_view name) {
  return {.name = name, .kind = ProviderField::Kind::i32, .is_needed = true};
}
constexpr ProviderField u64(std::string_view name) {
  return {.name = name, .kind = ProviderField::Kind::u64, .is_needed = true};
}
constexpr ProviderField i64(std::string_view name) {
  return {.name = name, .kind = ProviderField::Kind::i64, .is_needed = true};
}
constexpr ProviderField count(std::string_view name) {
  return {.name = name, .kind = ProviderField::Kind::count, .is_needed = true};
}
constexpr ProviderField realtime(std::string_view name) {
  return {.name = name, .kind = ProviderField::Kind::realtime, .is_needed = true};
}
constexpr ProviderField realtime_or_nothing(std::string_view name) {
  return {.name = name, .kind = ProviderField::Kind::realtime_or_nothing};
}
constexpr ProviderField text(std::string_view name) {
  return {.name = name, .kind = ProviderField::Kind::text};
}
// Of a number that may be unknown, and of an id that may be of none.
constexpr ProviderField optional(ProviderField field) {
  field.is_needed = false;
  return field;
}
constexpr ProviderField needed(ProviderField field) {
  field.is_needed = true;
  return field;
}
template <typename Enum>
constexpr ProviderField label(std::string_view name) {
  return {.name = name, .kind = ProviderField::Kind::label, .labels = Labels<Enum>::kValues};
}

inline constexpr std::array kRunBeginFields{u32("contract_version"),
                                            text("tool_version"),
                                            text("executor"),
                                            text("boot_id"),
                                            text("host"),
                                            u32("pid"),
                                            optional(u64("pid_ns")),
                                            i64("process_start_ns"),
                                            i64("monotonic_ns"),
                                            i64("realtime_ns"),
                                            optional(u32("online_cpus")),
                                            text("spec_sha256"),
                                            label<RunMoment>("moment"),
                                            optional(i64("monotonic_offset_ns"))};
inline constexpr ProviderEvent kRunBegin{"cie:run_begin", kRunBeginFields};

inline constexpr std::array kRunEndFields{u32("callbacks"), u32("threads"), u32("groups"),
                                          u32("publishers"), i32("status")};
inline constexpr ProviderEvent kRunEnd{"cie:run_end", kRunEndFields};

inline constexpr std::array kNodeInitFields{u32("node_id"), text("name")};
inline constexpr ProviderEvent kNodeInit{"cie:node_init", kNodeInitFields};

inline constexpr std::array kGroupInitFields{u32("group_id"), optional(u32("node_id")),
                                             label<GroupType>("type")};
inline constexpr ProviderEvent kGroupInit{"cie:group_init", kGroupInitFields};

inline constexpr std::array kCallbackInitFields{u32("callback_id"),
                                                optional(u32("group_id")),
                                                optional(u32("node_id")),
                                                label<CallbackKind>("kind"),
                                                needed(text("logical_id")),
                                                text("source"),
                                                text("symbol"),
                                                u64("period_ns"),
                                                optional(u32("queue_depth")),
                                                u64("deadline_ns"),
                                                optional(u64("next_seq"))};
inline constexpr ProviderEvent kCallbackInit{"cie:callback_init", kCallbackInitFields};

inline constexpr std::array kCallbackFiniFields{u32("callback_id"), u64("started"),
                                                u64("ended"),       u64("released"),
                                                u64("overwritten"), u64("lost")};
inline constexpr ProviderEvent kCallbackFini{"cie:callback_fini", kCallbackFiniFields};

inline constexpr std::array kPublisherInitFields{u32("publisher_id"), optional(u32("node_id")),
                                                 needed(text("topic")), u64("writer_gid"),
                                                 u64("next_seq")};
inline constexpr ProviderEvent kPublisherInit{"cie:publisher_init", kPublisherInitFields};

inline constexpr std::array kPublisherFiniFields{u32("publisher_id"), u64("published")};
inline constexpr ProviderEvent kPublisherFini{"cie:publisher_fini", kPublisherFiniFields};

inline constexpr std::array kThreadInitFields{u32("tid"),         label<ThreadRole>("role"),
                                              u32("callback_id"), u32("group_id"),
                                              text("name"),       i64("start_ns")};
inline constexpr ProviderEvent kThreadInit{"cie:thread_init", kThreadInitFields};

inline constexpr std::array kThreadFiniFields{u32("tid"), u32("read_backs")};
inline constexpr ProviderEvent kThreadFini{"cie:thread_fini", kThreadFiniFields};

inline constexpr std::array kThreadSchedFields{
    u32("tid"),
    label<SchedMoment>("moment"),
    u32("n"),
    i32("policy"),
    u64("flags"),
    i32("nice"),
    u32("priority"),
    u64("runtime_ns"),
    u64("deadline_ns"),
    u64("period_ns"),
    ProviderField{.name = "cpus", .kind = ProviderField::Kind::u32_sequence, .is_needed = true},
    i32("error"),
    optional(u64("slice_ns")),
    optional(u32("util_min")),
    optional(u32("util_max")),
    optional(u32("change"))};
inline constexpr ProviderEvent kThreadSched{"cie:thread_sched", kThreadSchedFields};

inline constexpr std::array kClockSyncFields{i64("monotonic_ns"), i64("realtime_ns")};
inline constexpr ProviderEvent kClockSync{"cie:clock_sync", kClockSyncFields};

inline constexpr std::array kProcnameFields{
    ProviderField{.name = "procname", .kind = ProviderField::Kind::characters, .length = 17}};
inline constexpr ProviderEvent kProcname{"lttng_ust_statedump:procname", kProcnameFields};

inline constexpr std::array kCallbackReleaseFields{u32("callback_id"), count("release_seq"),
                                                   count("overwritten")};
inline constexpr ProviderEvent kCallbackRelease{"cie:callback_release", kCallbackReleaseFields};

inline constexpr std::array kThreadWakeupFields{optional(u32("callback_id")),
                                                label<WakeupReason>("reason")};
inline constexpr ProviderEvent kThreadWakeup{"cie:thread_wakeup", kThreadWakeupFields};

inline constexpr std::array kCallbackStartFields{
    u32("callback_id"),          count("seq"),  label<ReleaseKind>("release_kind"),
    optional(i64("release_ns")), u32("missed"), realtime_or_nothing("source_timestamp_realtime_ns"),
    optional(u64("writer_gid"))};
inline constexpr ProviderEvent kCallbackStart{"cie:callback_start", kCallbackStartFields};

inline constexpr std::array kCallbackEndFields{u32("callback_id"), count("seq"),
                                               label<CallbackStatus>("status")};
inline constexpr ProviderEvent kCallbackEnd{"cie:callback_end", kCallbackEndFields};

inline constexpr std::array kPublishFields{u32("publisher_id"), count("seq"),
                                           realtime("source_timestamp_realtime_ns")};
inline constexpr ProviderEvent kPublish{"cie:publish", kPublishFields};

inline constexpr std::array kSampleLostFields{u32("callback_id"), u32("count"), count("total")};
inline constexpr ProviderEvent kSampleLost{"cie:sample_lost", kSampleLostFields};

inline constexpr std::array kPublishFailedFields{
    u32("publisher_id"), realtime("source_timestamp_realtime_ns"), count("total")};
inline constexpr ProviderEvent kPublishFailed{"cie:publish_failed", kPublishFailedFields};

}  // namespace provider
}  // namespace cie::analysis
