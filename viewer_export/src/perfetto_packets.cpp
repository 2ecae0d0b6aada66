#include "perfetto_packets.hpp"

#include <algorithm>
#include <array>

namespace cie::viewer_export::perfetto {
namespace {

using protozero::pbf_builder;

// Each machine has a sequence of track events; kernel events are on none.
constexpr std::uint32_t kFirstSequence = 1;

constexpr std::array<std::string_view, 4> kCategoryNames{"callback", "wait", "publish",
                                                         "enforcement"};

std::uint64_t iid_of(Note note) { return static_cast<std::uint64_t>(note) + 1; }

void add_timestamp(pbf_builder<TracePacket>& packet, std::int64_t time) {
  packet.add_uint64(TracePacket::timestamp, static_cast<std::uint64_t>(time));
}

void add_sequence(pbf_builder<TracePacket>& packet, std::uint32_t machine, SequenceFlag flag) {
  packet.add_uint32(TracePacket::trusted_packet_sequence_id, kFirstSequence + machine);
  packet.add_uint32(TracePacket::sequence_flags, static_cast<std::uint32_t>(flag));
}

void add_clock(pbf_builder<ClockSnapshot>& snapshot, ClockId id, std::int64_t time) {
  pbf_builder<Clock> clock{snapshot, ClockSnapshot::clocks};
  clock.add_uint32(Clock::clock_id, static_cast<std::uint32_t>(id));
  clock.add_uint64(Clock::timestamp, static_cast<std::uint64_t>(time));
}

void add_interned(pbf_builder<InternedData>& data, InternedData field, std::uint64_t iid,
                  std::string_view name) {
  pbf_builder<Interned> entry{data, field};
  entry.add_uint64(Interned::iid, iid);
  entry.add_string(Interned::name, name.data(), name.size());
}

void add_event(pbf_builder<TrackEvent>& event, EventType type, std::uint64_t track) {
  event.add_enum(TrackEvent::type, static_cast<std::int32_t>(type));
  event.add_uint64(TrackEvent::track_uuid, track);
}

void add_track(pbf_builder<TrackDescriptor>& descriptor, std::uint64_t uuid, std::uint64_t parent,
               std::string_view name) {
  descriptor.add_uint64(TrackDescriptor::uuid, uuid);
  if (parent != 0) {
    descriptor.add_uint64(TrackDescriptor::parent_uuid, parent);
  }
  descriptor.add_string(TrackDescriptor::name, name.data(), name.size());
}

std::string encoded_event(EventType type, const Slice& slice, const Annotations& notes) {
  std::string bytes;
  pbf_builder<TrackEvent> event{bytes};
  add_event(event, type, slice.track);
  event.add_uint64(TrackEvent::name_iid, slice.name_iid);
  event.add_uint64(TrackEvent::category_iids, static_cast<std::uint64_t>(slice.category));
  return bytes + notes.bytes();
}

// `add_value` adds the value's field to the annotation.
template <typename AddValue>
void add_note(std::string& bytes, Note note, const AddValue& add_value) {
  std::string annotation;
  pbf_builder<DebugAnnotation> builder{annotation};
  builder.add_uint64(DebugAnnotation::name_iid, iid_of(note));
  add_value(builder);
  pbf_builder<TrackEvent> event{bytes};
  event.add_message(TrackEvent::debug_annotations, annotation);
}

}  // namespace

void Annotations::add(Note note, std::int64_t value) {
  add_note(bytes_, note,
           [value](auto& builder) { builder.add_int64(DebugAnnotation::int_value, value); });
}

void Annotations::add(Note note, std::uint64_t value) {
  add_note(bytes_, note,
           [value](auto& builder) { builder.add_uint64(DebugAnnotation::uint_value, value); });
}

void Annotations::add(Note note, std::string_view value) {
  add_note(bytes_, note, [value](auto& builder) {
    builder.add_string(DebugAnnotation::string_value, value.data(), value.size());
  });
}

template <typename Fill>
void PacketBuffer::packet(const Fill& fill) {
  pbf_builder<Trace> file{bytes_};
  pbf_builder<TracePacket> packet{file, Trace::packet};
  if (machine_ != 0) packet.add_uint32(TracePacket::machine_id, machine_);
  fill(packet);
}

template <typename Fill>
void PacketBuffer::packet_at(std::int64_t time, const Fill& fill) {
  packet([&](pbf_builder<TracePacket>& packet) {
    add_timestamp(packet, time);
    fill(packet);
  });
}

void PacketBuffer::event_packet(std::int64_t time, const std::string& event) {
  packet_at(time, [&](pbf_builder<TracePacket>& packet) {
    add_sequence(packet, machine_, SequenceFlag::needs_incremental_state);
    packet.add_message(TracePacket::track_event, event);
  });
}

void PacketBuffer::preamble(std::int64_t time, std::optional<std::int64_t> clock_offset_ns) {
  packet_at(time, [&](pbf_builder<TracePacket>& packet) {
    pbf_builder<ClockSnapshot> snapshot{packet, TracePacket::clock_snapshot};
    add_clock(snapshot, ClockId::boottime, time);
    add_clock(snapshot, ClockId::monotonic, time);
    std::int64_t realtime = 0;
    if (clock_offset_ns && !__builtin_add_overflow(time, *clock_offset_ns, &realtime) &&
        realtime >= 0) {
      add_clock(snapshot, ClockId::realtime, realtime);
    }
    snapshot.add_uint32(ClockSnapshot::primary_trace_clock,
                        static_cast<std::uint32_t>(ClockId::boottime));
  });
  packet_at(time, [](pbf_builder<TracePacket>& packet) {
    pbf_builder<SystemInfo> system{packet, TracePacket::system_info};
    pbf_builder<Utsname> name{system, SystemInfo::utsname};
    name.add_string(Utsname::sysname, "Linux");
    // Selects the table of task states; the numbers are those of every kernel since 4.14.
    name.add_string(Utsname::release, "6.1.0");
  });
}

void PacketBuffer::interned(std::int64_t time, std::span<const std::string> names) {
  packet_at(time, [&](pbf_builder<TracePacket>& packet) {
    add_sequence(packet, machine_, SequenceFlag::incremental_state_cleared);
    packet.add_bool(TracePacket::first_packet_on_sequence, true);
    pbf_builder<InternedData> data{packet, TracePacket::interned_data};
    for (std::size_t i = 0; i < kCategoryNames.size(); ++i) {
      add_interned(data, InternedData::event_categories, i + 1, kCategoryNames.at(i));
    }
    for (std::size_t i = 0; i < kNotes; ++i) {
      const auto note = static_cast<Note>(i);
      add_interned(data, InternedData::debug_annotation_names, iid_of(note), label(note));
    }
    for (std::size_t i = 0; i < names.size(); ++i) {
      add_interned(data, InternedData::event_names, i + 1, names[i]);
    }
  });
}

void PacketBuffer::process(std::int64_t time, std::uint64_t uuid, std::int64_t pid,
                           std::string_view name) {
  packet_at(time, [&](pbf_builder<TracePacket>& packet) {
    pbf_builder<TrackDescriptor> descriptor{packet, TracePacket::track_descriptor};
    descriptor.add_uint64(TrackDescriptor::uuid, uuid);
    pbf_builder<ProcessDescriptor> process{descriptor, TrackDescriptor::process};
    process.add_int32(ProcessDescriptor::pid, static_cast<std::int32_t>(pid));
    process.add_string(ProcessDescriptor::process_name, name.data(), name.size());
  });
}

void PacketBuffer::thread(std::int64_t time, std::uint64_t uuid, std::int64_t pid, std::int64_t tid,
                          std::string_view name) {
  packet_at(time, [&](pbf_builder<TracePacket>& packet) {
    pbf_builder<TrackDescriptor> descriptor{packet, TracePacket::track_descriptor};
    descriptor.add_uint64(TrackDescriptor::uuid, uuid);
    pbf_builder<ThreadDescriptor> thread{descriptor, TrackDescriptor::thread};
    thread.add_int32(ThreadDescriptor::pid, static_cast<std::int32_t>(pid));
    thread.add_int32(ThreadDescriptor::tid, static_cast<std::int32_t>(tid));
    if (!name.empty()) {
      thread.add_string(ThreadDescriptor::thread_name, name.data(), name.size());
    }
  });
}

void PacketBuffer::track(std::uint64_t uuid, std::uint64_t parent, std::string_view name) {
  packet([&](pbf_builder<TracePacket>& packet) {
    pbf_builder<TrackDescriptor> descriptor{packet, TracePacket::track_descriptor};
    add_track(descriptor, uuid, parent, name);
  });
}

void PacketBuffer::counter_track(std::uint64_t uuid, std::uint64_t parent, std::string_view name,
                                 CounterUnit unit) {
  packet([&](pbf_builder<TracePacket>& packet) {
    pbf_builder<TrackDescriptor> descriptor{packet, TracePacket::track_descriptor};
    add_track(descriptor, uuid, parent, name);
    descriptor.add_enum(TrackDescriptor::sibling_merge_behavior,
                        static_cast<std::int32_t>(SiblingMerge::none));
    pbf_builder<CounterDescriptor> counter{descriptor, TrackDescriptor::counter};
    counter.add_enum(CounterDescriptor::unit, static_cast<std::int32_t>(unit));
  });
}

void PacketBuffer::slice_begin(std::int64_t time, const Slice& slice, const Annotations& notes,
                               std::uint64_t flow) {
  auto event = encoded_event(EventType::slice_begin, slice, notes);
  if (flow != 0) {
    pbf_builder<TrackEvent>{event}.add_fixed64(TrackEvent::terminating_flow_ids, flow);
  }
  event_packet(time, event);
}

void PacketBuffer::slice_end(std::int64_t time, std::uint64_t track) {
  std::string bytes;
  pbf_builder<TrackEvent> event{bytes};
  add_event(event, EventType::slice_end, track);
  event_packet(time, bytes);
}

void PacketBuffer::instant(std::int64_t time, const Slice& slice, const Annotations& notes,
                           std::span<const std::uint64_t> flows) {
  auto event = encoded_event(EventType::instant, slice, notes);
  for (const auto flow : flows) {
    pbf_builder<TrackEvent>{event}.add_fixed64(TrackEvent::flow_ids, flow);
  }
  event_packet(time, event);
}

void PacketBuffer::named_instant(std::int64_t time, std::uint64_t track, Category category,
                                 std::string_view name, const Annotations& notes) {
  std::string bytes;
  pbf_builder<TrackEvent> event{bytes};
  add_event(event, EventType::instant, track);
  event.add_string(TrackEvent::name, name.data(), name.size());
  event.add_uint64(TrackEvent::category_iids, static_cast<std::uint64_t>(category));
  event_packet(time, bytes + notes.bytes());
}

void PacketBuffer::count(std::int64_t time, std::uint64_t track, std::int64_t value) {
  std::string bytes;
  pbf_builder<TrackEvent> event{bytes};
  add_event(event, EventType::counter, track);
  event.add_int64(TrackEvent::counter_value, value);
  event_packet(time, bytes);
}

template <typename Event, typename Fill>
void PacketBuffer::ftrace_bundle(std::int32_t cpu, std::span<const Event> events,
                                 const Fill& fill) {
  packet([&](pbf_builder<TracePacket>& packet) {
    pbf_builder<FtraceEventBundle> bundle{packet, TracePacket::ftrace_events};
    bundle.add_uint32(FtraceEventBundle::cpu, static_cast<std::uint32_t>(cpu));
    for (const auto& e : events) {
      pbf_builder<FtraceEvent> event{bundle, FtraceEventBundle::event};
      event.add_uint64(FtraceEvent::timestamp, static_cast<std::uint64_t>(e.time));
      fill(event, e);
    }
  });
}

void PacketBuffer::switches(std::int32_t cpu, std::span<const SwitchEvent> events) {
  ftrace_bundle(cpu, events, [](pbf_builder<FtraceEvent>& event, const SwitchEvent& e) {
    event.add_uint32(FtraceEvent::pid, static_cast<std::uint32_t>(e.prev_tid));
    pbf_builder<SchedSwitch> change{event, FtraceEvent::sched_switch};
    change.add_string(SchedSwitch::prev_comm, e.prev_comm.data(), e.prev_comm.size());
    change.add_int32(SchedSwitch::prev_pid, static_cast<std::int32_t>(e.prev_tid));
    change.add_int32(SchedSwitch::prev_prio, e.prev_prio);
    change.add_int64(SchedSwitch::prev_state, e.prev_state);
    change.add_string(SchedSwitch::next_comm, e.next_comm.data(), e.next_comm.size());
    change.add_int32(SchedSwitch::next_pid, static_cast<std::int32_t>(e.next_tid));
    change.add_int32(SchedSwitch::next_prio, e.next_prio);
  });
}

void PacketBuffer::wakings(std::int32_t cpu, std::span<const WakingEvent> events) {
  ftrace_bundle(cpu, events, [](pbf_builder<FtraceEvent>& event, const WakingEvent& e) {
    event.add_uint32(FtraceEvent::pid, static_cast<std::uint32_t>(e.waker_tid));
    pbf_builder<SchedWaking> waking{event, FtraceEvent::sched_waking};
    waking.add_string(SchedWaking::comm, e.comm.data(), e.comm.size());
    waking.add_int32(SchedWaking::pid, static_cast<std::int32_t>(e.tid));
    waking.add_int32(SchedWaking::prio, e.prio);
    waking.add_int32(SchedWaking::success, 1);
    if (e.target_cpu) waking.add_int32(SchedWaking::target_cpu, *e.target_cpu);
  });
}

}  // namespace cie::viewer_export::perfetto
