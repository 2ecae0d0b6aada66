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

void add_track(pbf_builder<TrackDescriptor>& descriptor, std::uint64_t uuid, std::uint64_t parent,
               std::string_view name) {
  descriptor.add_uint64(TrackDescriptor::uuid, uuid);
  if (parent != 0) {
    descriptor.add_uint64(TrackDescriptor::parent_uuid, parent);
  }
  descriptor.add_string(TrackDescriptor::name, name.data(), name.size());
}

template <typename Enum>
void add_words(pbf_builder<InternedData>& data) {
  for (std::uint64_t i = 0; i < Words<Enum>::kCount; ++i) {
    add_interned(data, InternedData::debug_annotation_string_values, Words<Enum>::kFirst + i,
                 label(static_cast<Enum>(i)));
  }
}

// The fields of a TrackEvent that say what it is of.
constexpr std::size_t kMostOfSlice = 2 * FieldWriter::kMostNumber;
void write_slice(FieldWriter& out, const Slice& slice) {
  out.number<TrackEvent::name_iid>(slice.name_iid);
  out.number<TrackEvent::category_iids>(static_cast<std::uint64_t>(slice.category));
}

}  // namespace

template <typename Fill>
void PacketBuffer::packet(const Fill& fill) {
  packet_.clear();
  {
    pbf_builder<Trace> file{packet_};
    pbf_builder<TracePacket> packet{file, Trace::packet};
    if (machine_ != 0) packet.add_uint32(TracePacket::machine_id, machine_);
    fill(packet);
  }
  bytes_.append(packet_);
}

template <typename Fill>
void PacketBuffer::packet_at(std::int64_t time, const Fill& fill) {
  packet([&](pbf_builder<TracePacket>& packet) {
    add_timestamp(packet, time);
    fill(packet);
  });
}

template <typename Fill>
void PacketBuffer::event(std::int64_t time, EventType type, std::uint64_t track, std::size_t size,
                         const Fill& fill) {
  constexpr auto kMostOfPacket = 8 * FieldWriter::kMostNumber;  // what is below but for `fill`
  FieldWriter out(bytes_.room(kMostOfPacket + size));
  out.message<Trace::packet>([&] {
    if (machine_ != 0) out.number<TracePacket::machine_id>(machine_);
    out.number<TracePacket::timestamp>(static_cast<std::uint64_t>(time));
    out.number<TracePacket::trusted_packet_sequence_id>(kFirstSequence + machine_);
    out.number<TracePacket::sequence_flags>(
        static_cast<std::uint64_t>(SequenceFlag::needs_incremental_state));
    out.message<TracePacket::track_event>([&] {
      out.number<TrackEvent::type>(static_cast<std::uint64_t>(type));
      out.number<TrackEvent::track_uuid>(track);
      fill(out);
    });
  });
  bytes_.end_at(out.at());
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

// Perfetto takes the mean of what several exchanges between two machines show, so there are two.
void PacketBuffer::clock_of_machine(analysis::Duration shift) {
  constexpr std::int64_t kAboveZero = 1'000'000'000;
  const auto own = kAboveZero + std::max<std::int64_t>((analysis::Duration{} - shift).ns, 0);
  packet([&](pbf_builder<TracePacket>& packet) {
    pbf_builder<RemoteClockSync> sync{packet, TracePacket::remote_clock_sync};
    for (int exchange = 0; exchange < 2; ++exchange) {
      pbf_builder<SyncedClocks> clocks{sync, RemoteClockSync::synced_clocks};
      const auto add = [&clocks](SyncedClocks which, std::int64_t time) {
        pbf_builder<ClockSnapshot> snapshot{clocks, which};
        add_clock(snapshot, ClockId::boottime, time);
      };
      add(SyncedClocks::client_clocks, own);
      add(SyncedClocks::host_clocks, (analysis::Timestamp{own} + shift).ns);
    }
  });
}

void PacketBuffer::interned(std::int64_t time, std::span<const std::string> names,
                            std::span<const std::string> logical_ids) {
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
    add_words<analysis::ReleaseSource>(data);
    add_words<CallbackStatus>(data);
    add_words<analysis::InstanceState>(data);
    for (std::size_t i = 0; i < logical_ids.size(); ++i) {
      add_interned(data, InternedData::debug_annotation_string_values, kFirstLogicalId + i,
                   logical_ids[i]);
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
  const auto size = kMostOfSlice + notes.bytes().size() + FieldWriter::kFixed64;
  event(time, EventType::slice_begin, slice.track, size, [&](FieldWriter& out) {
    write_slice(out, slice);
    out.raw(notes.bytes());
    if (flow != 0) out.fixed64<TrackEvent::terminating_flow_ids>(flow);
  });
}

void PacketBuffer::slice_end(std::int64_t time, std::uint64_t track,
                             const std::optional<CounterValue>& counter) {
  event(time, EventType::slice_end, track, 2 * FieldWriter::kMostNumber, [&](FieldWriter& out) {
    if (!counter) return;
    out.number<TrackEvent::extra_counter_track_uuids>(counter->track);
    out.number<TrackEvent::extra_counter_values>(static_cast<std::uint64_t>(counter->value));
  });
}

void PacketBuffer::instant(std::int64_t time, const Slice& slice, const Annotations& notes,
                           std::span<const std::uint64_t> flows) {
  const auto size = kMostOfSlice + notes.bytes().size() + flows.size() * FieldWriter::kFixed64;
  event(time, EventType::instant, slice.track, size, [&](FieldWriter& out) {
    write_slice(out, slice);
    out.raw(notes.bytes());
    for (const auto flow : flows)
      out.fixed64<TrackEvent::flow_ids>(flow);
  });
}

void PacketBuffer::named_instant(std::int64_t time, std::uint64_t track, Category category,
                                 std::string_view name, const Annotations& notes) {
  const auto size = kMostOfSlice + name.size() + notes.bytes().size();
  event(time, EventType::instant, track, size, [&](FieldWriter& out) {
    out.text<TrackEvent::name>(name);
    out.number<TrackEvent::category_iids>(static_cast<std::uint64_t>(category));
    out.raw(notes.bytes());
  });
}

void PacketBuffer::count(std::int64_t time, const CounterValue& counter) {
  event(time, EventType::counter, counter.track, FieldWriter::kMostNumber, [&](FieldWriter& out) {
    out.number<TrackEvent::counter_value>(static_cast<std::uint64_t>(counter.value));
  });
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
