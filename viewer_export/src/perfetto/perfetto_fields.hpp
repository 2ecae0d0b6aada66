// Field numbers of the Perfetto trace format (protos/perfetto/trace/*.proto), those used here.
#pragma once

#include <cstdint>

#include <protozero/pbf_builder.hpp>

namespace cie::viewer_export::perfetto {

using protozero::pbf_tag_type;

enum class Trace : pbf_tag_type { packet = 1 };
enum class TracePacket : pbf_tag_type {
  ftrace_events = 1,
  clock_snapshot = 6,
  timestamp = 8,
  trusted_packet_sequence_id = 10,
  track_event = 11,
  interned_data = 12,
  sequence_flags = 13,
  system_info = 45,
  track_descriptor = 60,
  first_packet_on_sequence = 87,
  machine_id = 98,
  remote_clock_sync = 107
};
enum class RemoteClockSync : pbf_tag_type { synced_clocks = 1 };
enum class SyncedClocks : pbf_tag_type { client_clocks = 2, host_clocks = 3 };
enum class ClockSnapshot : pbf_tag_type { clocks = 1, primary_trace_clock = 2 };
enum class Clock : pbf_tag_type { clock_id = 1, timestamp = 2 };
enum class SystemInfo : pbf_tag_type { utsname = 1 };
enum class Utsname : pbf_tag_type { sysname = 1, version = 2, release = 3, machine = 4 };
enum class TrackDescriptor : pbf_tag_type {
  uuid = 1,
  name = 2,
  process = 3,
  thread = 4,
  parent_uuid = 5,
  counter = 8,
  sibling_merge_behavior = 15
};
enum class CounterDescriptor : pbf_tag_type { unit = 3 };
enum class ProcessDescriptor : pbf_tag_type { pid = 1, process_name = 6 };
enum class ThreadDescriptor : pbf_tag_type { pid = 1, tid = 2, thread_name = 5 };
enum class TrackEvent : pbf_tag_type {
  category_iids = 3,
  debug_annotations = 4,
  type = 9,
  name_iid = 10,
  track_uuid = 11,
  extra_counter_values = 12,
  name = 23,
  counter_value = 30,
  extra_counter_track_uuids = 31,
  flow_ids = 47,
  terminating_flow_ids = 48
};
enum class DebugAnnotation : pbf_tag_type {
  name_iid = 1,
  uint_value = 3,
  int_value = 4,
  string_value = 6,
  string_value_iid = 17
};
enum class InternedData : pbf_tag_type {
  event_categories = 1,
  event_names = 2,
  debug_annotation_names = 3,
  debug_annotation_string_values = 29
};
enum class Interned : pbf_tag_type { iid = 1, name = 2 };
enum class FtraceEventBundle : pbf_tag_type { cpu = 1, event = 2 };
enum class FtraceEvent : pbf_tag_type {
  timestamp = 1,
  pid = 2,
  sched_switch = 4,
  sched_waking = 20
};
enum class SchedSwitch : pbf_tag_type {
  prev_comm = 1,
  prev_pid = 2,
  prev_prio = 3,
  prev_state = 4,
  next_comm = 5,
  next_pid = 6,
  next_prio = 7
};

enum class SchedWaking : pbf_tag_type { comm = 1, pid = 2, prio = 3, success = 4, target_cpu = 5 };

enum class EventType : std::int32_t { slice_begin = 1, slice_end = 2, instant = 3, counter = 4 };
enum class CounterUnit : std::int32_t { time_ns = 1, count = 2 };
enum class SiblingMerge : std::int32_t { none = 2 };
enum class ClockId : std::uint32_t { realtime = 1, monotonic = 3, boottime = 6 };
enum class SequenceFlag : std::uint32_t {
  incremental_state_cleared = 1,
  needs_incremental_state = 2
};

}  // namespace cie::viewer_export::perfetto
