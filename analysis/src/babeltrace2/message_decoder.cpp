#include "message_decoder.hpp"

#include <cie/tracepoints/schema.hpp>

#include "base/uuid.hpp"
#include "bt_fields.hpp"
#include "vocabulary/tracer_clock.hpp"

#include <algorithm>
#include <cstdint>

namespace cie::analysis::bt {
namespace {

const std::vector<FieldRequest> kPacketNames{"cpu_id"};

Timestamp time_of(const bt_clock_snapshot* snapshot) {
  const auto* clock = bt_clock_snapshot_borrow_clock_class_const(snapshot);
  return time_of_cycles(bt_clock_snapshot_get_value(snapshot), bt_clock_class_get_frequency(clock));
}

std::string environment(const bt_trace* trace, const char* name) {
  const auto* value = bt_trace_borrow_environment_entry_value_by_name_const(trace, name);
  if (value == nullptr || bt_value_get_type(value) != BT_VALUE_TYPE_STRING) return {};
  return bt_value_string_get(value);
}

// What the events of a class mean; null: it is of no vocabulary, or lacks a field that is needed.
const Translation* translation_of(const bt_event_class* event_class, std::string_view name) {
  const auto* translation = find_translation(name);
  if (translation == nullptr) return nullptr;
  const FieldTable fields(bt_event_class_borrow_payload_field_class_const(event_class),
                          translation->fields);
  return if_whole(translation, [&fields](std::size_t slot) { return fields.has_slot(slot); });
}

// Whether some event class of the trace, with this name, is wanted.
template <typename IsWanted>
bool declares(const bt_trace* trace, const IsWanted& is_wanted) {
  const auto* trace_class = bt_trace_borrow_class_const(trace);
  const auto streams = bt_trace_class_get_stream_class_count(trace_class);
  for (std::uint64_t i = 0; i < streams; ++i) {
    const auto* stream_class = bt_trace_class_borrow_stream_class_by_index_const(trace_class, i);
    const auto events = bt_stream_class_get_event_class_count(stream_class);
    for (std::uint64_t k = 0; k < events; ++k) {
      const auto* event_class = bt_stream_class_borrow_event_class_by_index_const(stream_class, k);
      const char* name = bt_event_class_get_name(event_class);
      if (name != nullptr && is_wanted(event_class, std::string_view(name))) return true;
    }
  }
  return false;
}

// Of the kernel's trace: see StreamBegin.
std::optional<bool> has_inheritance(const bt_trace* trace) {
  // LTTng's name of the event class, or perf's.
  const auto is_declared = [trace](const std::string& event) {
    return declares(trace, [&event](const bt_event_class* event_class, std::string_view name) {
      return (name == event || name == "sched:" + event) &&
             translation_of(event_class, name) != nullptr;
    });
  };
  if (!is_declared("sched_switch")) return std::nullopt;
  return is_declared("sched_pi_setprio");
}

const bt_field_class* packet_context_class(const bt_stream_class* stream_class) {
  return bt_stream_class_supports_packets(stream_class) != 0
             ? bt_stream_class_borrow_packet_context_field_class_const(stream_class)
             : nullptr;
}

}  // namespace

MessageDecoder::Stream& MessageDecoder::stream_of(const bt_stream* stream) {
  return streams_.at(stream);
}

// A silent stream of applications is taken for one without events until it has one. Of the kernel's,
// an instance's parts may have been in it.
std::optional<bool> MessageDecoder::take_has_events(const bt_stream* stream, Domain domain) {
  const auto found = foretold_.find(stream);
  const auto what = found == foretold_.end() ? Foretold::unknown : found->second;
  if (found != foretold_.end()) foretold_.erase(found);
  switch (what) {
    case Foretold::events:
      return true;
    case Foretold::nothing:
      return false;
    case Foretold::silence:
      return domain == Domain::user ? std::optional(false) : std::nullopt;
    case Foretold::unknown:
      break;
  }
  return std::nullopt;
}

void MessageDecoder::stream_begin(const bt_stream* stream) {
  const auto* trace = bt_stream_borrow_trace_const(stream);
  auto& of_trace = traces_[trace];
  if (!of_trace) {
    of_trace = std::make_unique<Trace>();
    bt_trace_get_ref(trace);
    of_trace->trace.reset(trace);
    of_trace->number = input_.next_trace();
    of_trace->domain = environment(trace, "domain") == "kernel" ? Domain::kernel : Domain::user;
    of_trace->host = environment(trace, "hostname");  // LTTng's; perf says "host"
    of_trace->is_snapshot = environment(trace, "trace_name").starts_with(kSnapshotSession);
    if (of_trace->host.empty()) of_trace->host = environment(trace, "host");
    if (environment(trace, "tracer_name") == "lttng-modules") of_trace->state.priority_offset = 100;
  }
  const auto* stream_class = bt_stream_borrow_class_const(stream);
  const auto [channel, is_new] =
      channels_.try_emplace({trace, bt_stream_class_get_id(stream_class)});
  if (is_new) channel->second = input_.next_channel();
  Stream state;
  state.index = input_.next_stream();
  state.trace = of_trace.get();
  state.packet_context = FieldTable(packet_context_class(stream_class), kPacketNames);
  state.has_packet_times =
      bt_stream_class_supports_packets(stream_class) != 0 &&
      bt_stream_class_packets_have_beginning_default_clock_snapshot(stream_class) != 0 &&
      bt_stream_class_packets_have_end_default_clock_snapshot(stream_class) != 0;

  std::string clock_uuid;
  std::int64_t offset_ns = 0;
  if (const auto* clock = bt_stream_class_borrow_default_clock_class_const(stream_class)) {
    const auto* uuid = bt_clock_class_get_uuid(clock);
    if (uuid != nullptr) clock_uuid = uuid_text(std::span<const std::uint8_t, 16>(uuid, 16));
    std::int64_t seconds = 0;
    std::uint64_t cycles = 0;
    bt_clock_class_get_offset(clock, &seconds, &cycles);
    offset_ns = clock_offset(seconds, cycles, bt_clock_class_get_frequency(clock));
  }
  const char* name = bt_stream_get_name(stream);
  const EventHead head{.time = {}, .stream = state.index, .cpu = {}, .pid = {}, .tid = {}};
  streams_[stream] = std::move(state);
  const auto domain = of_trace->domain;
  const auto has_events = take_has_events(stream, domain);
  // Of a running system nobody knows what its applications will declare.
  std::optional<bool> has_callback_events;
  std::optional<bool> has_client_events;
  if (domain == Domain::user && has_events) {
    const auto declares_any = [trace](bool (*is_wanted)(std::string_view)) {
      return declares(trace, [is_wanted](const bt_event_class* /*event_class*/,
                                         std::string_view event) { return is_wanted(event); });
    };
    has_callback_events = declares_any(is_callback_start);
    has_client_events = declares_any(is_client_init) && declares_any(is_service_init);
  }
  input_.push(
      head, StreamBegin{
                .channel = channel->second,
                .trace = of_trace->number,
                .domain = domain,
                .host = of_trace->host,
                .clock_uuid = clock_uuid,
                .clock_offset_ns = offset_ns,
                .path = name != nullptr ? std::string_view(name) : std::string_view{},
                .is_snapshot = of_trace->is_snapshot,
                .has_events = has_events,
                .has_inheritance = domain == Domain::kernel ? has_inheritance(trace) : std::nullopt,
                .has_callback_events = has_callback_events,
                .has_client_events = has_client_events});
}

void MessageDecoder::stream_end(Stream& stream) {
  const auto time = std::max(stream.last, stream.packet_begin.value_or(stream.last));
  const EventHead head{
      .time = time, .stream = stream.index, .cpu = stream.cpu, .pid = {}, .tid = {}};
  const bool is_open = stream.has_packet_times ? stream.packet_begin.has_value() : stream.has_begun;
  if (is_open) input_.push(head, PacketEnd{});
  input_.push(head, StreamEnd{});
  stream.has_ended = true;
}

void MessageDecoder::give_up() {
  for (auto& [stream, state] : streams_) {
    if (!state.has_ended) stream_end(state);
  }
}

std::vector<std::uint32_t> MessageDecoder::traces() const {
  std::vector<std::uint32_t> numbers;
  for (const auto& [trace, state] : traces_)
    numbers.push_back(state->number);
  return numbers;
}

void MessageDecoder::packet_begin(const bt_message* message) {
  const auto* packet = bt_message_packet_beginning_borrow_packet_const(message);
  auto& state = stream_of(bt_packet_borrow_stream_const(packet));
  const auto cpu =
      read_integer(state.packet_context.get(bt_packet_borrow_context_field_const(packet), 0));
  state.cpu.reset();
  if (cpu) state.cpu = static_cast<std::int32_t>(*cpu);
  if (!state.has_packet_times) return;
  const auto time =
      time_of(bt_message_packet_beginning_borrow_default_clock_snapshot_const(message));
  state.packet_begin = time;
  input_.push({.time = time, .stream = state.index, .cpu = state.cpu, .pid = {}, .tid = {}},
              PacketBegin{});
}

void MessageDecoder::packet_end(const bt_message* message) {
  const auto* packet = bt_message_packet_end_borrow_packet_const(message);
  auto& state = stream_of(bt_packet_borrow_stream_const(packet));
  if (!state.has_packet_times) return;
  state.packet_begin.reset();
  const auto time = time_of(bt_message_packet_end_borrow_default_clock_snapshot_const(message));
  input_.push({.time = time, .stream = state.index, .cpu = state.cpu, .pid = {}, .tid = {}},
              PacketEnd{});
}

MessageDecoder::EventPlan& MessageDecoder::plan_of(const bt_event_class* event_class) {
  const auto [found, is_new] = plans_.try_emplace(event_class);
  auto& plan = found->second;
  if (!is_new) return plan;
  const char* name = bt_event_class_get_name(event_class);
  plan.name = name != nullptr ? name : "";
  plan.translation = translation_of(event_class, plan.name);
  if (plan.translation != nullptr) {
    plan.payload = FieldTable(bt_event_class_borrow_payload_field_class_const(event_class),
                              plan.translation->fields);
  }
  const auto* stream_class = bt_event_class_borrow_stream_class_const(event_class);
  plan.common_context =
      FieldTable(bt_stream_class_borrow_event_common_context_field_class_const(stream_class),
                 context_requests());
  plan.specific_context = FieldTable(
      bt_event_class_borrow_specific_context_field_class_const(event_class), context_requests());
  return plan;
}

void MessageDecoder::event(const bt_message* message) {
  const auto* event = bt_message_event_borrow_event_const(message);
  auto& stream = stream_of(bt_event_borrow_stream_const(event));
  auto& plan = plan_of(bt_event_borrow_class_const(event));
  const auto* common = bt_event_borrow_common_context_field_const(event);
  const auto* specific = bt_event_borrow_specific_context_field_const(event);
  const auto context = [&](std::size_t slot) {
    const auto* field = plan.common_context.get(common, slot);
    return read_integer(field != nullptr ? field : plan.specific_context.get(specific, slot));
  };
  EventHead head{
      .time = {}, .stream = stream.index, .cpu = stream.cpu, .pid = context(0), .tid = context(1)};
  constexpr std::size_t kPidNamespace = 3;
  const auto& trace = *stream.trace;
  if (const auto inode = trace.domain == Domain::user ? context(kPidNamespace) : std::nullopt)
    namespaces_[trace.host].tell_apart(static_cast<std::uint64_t>(*inode), head);
  const auto* stream_class = bt_stream_borrow_class_const(bt_event_borrow_stream_const(event));
  if (bt_stream_class_borrow_default_clock_class_const(stream_class) != nullptr) {
    head.time = time_of(bt_message_event_borrow_default_clock_snapshot_const(message));
  }
  if (!stream.has_packet_times && !stream.has_begun) input_.push(head, PacketBegin{});
  stream.has_begun = true;
  stream.last = head.time;
  if (plan.translation == nullptr) {
    input_.push(head, OtherEvent{.name = plan.name});
    return;
  }
  const auto* fields = plan.payload.read(bt_event_borrow_payload_field_const(event));
  if (plan.translation->has_thread_name) {
    constexpr std::size_t kName = 2;
    plan.payload.put(plan.translation->fields.size() - 1, plan.common_context.read(common)[kName]);
  }
  input_.push(head, *plan.translation, Payload{fields}, stream.trace->state);
}

void MessageDecoder::discarded_events(const bt_message* message) {
  const auto* stream = bt_message_discarded_events_borrow_stream_const(message);
  const auto& state = stream_of(stream);
  const auto* stream_class = bt_stream_borrow_class_const(stream);
  Discarded discarded{.begin = state.last, .end = state.last, .count = {}, .packets = false};
  if (bt_stream_class_discarded_events_have_default_clock_snapshots(stream_class) != 0) {
    discarded.begin =
        time_of(bt_message_discarded_events_borrow_beginning_default_clock_snapshot_const(message));
    discarded.end =
        time_of(bt_message_discarded_events_borrow_end_default_clock_snapshot_const(message));
  }
  std::uint64_t count = 0;
  if (bt_message_discarded_events_get_count(message, &count) ==
      BT_PROPERTY_AVAILABILITY_AVAILABLE) {
    discarded.count = count;
  }
  input_.push(
      {.time = discarded.begin, .stream = state.index, .cpu = state.cpu, .pid = {}, .tid = {}},
      discarded);
}

void MessageDecoder::discarded_packets(const bt_message* message) {
  const auto* stream = bt_message_discarded_packets_borrow_stream_const(message);
  const auto& state = stream_of(stream);
  const auto* stream_class = bt_stream_borrow_class_const(stream);
  Discarded discarded{.begin = state.last, .end = state.last, .count = {}, .packets = true};
  if (bt_stream_class_discarded_packets_have_default_clock_snapshots(stream_class) != 0) {
    discarded.begin = time_of(
        bt_message_discarded_packets_borrow_beginning_default_clock_snapshot_const(message));
    discarded.end =
        time_of(bt_message_discarded_packets_borrow_end_default_clock_snapshot_const(message));
  }
  std::uint64_t count = 0;
  if (bt_message_discarded_packets_get_count(message, &count) ==
      BT_PROPERTY_AVAILABILITY_AVAILABLE) {
    discarded.count = count;
  }
  input_.push(
      {.time = discarded.begin, .stream = state.index, .cpu = state.cpu, .pid = {}, .tid = {}},
      discarded);
}

void MessageDecoder::consume(const bt_message* message) {
  switch (bt_message_get_type(message)) {
    case BT_MESSAGE_TYPE_STREAM_BEGINNING:
      stream_begin(bt_message_stream_beginning_borrow_stream_const(message));
      break;
    case BT_MESSAGE_TYPE_STREAM_END:
      stream_end(stream_of(bt_message_stream_end_borrow_stream_const(message)));
      break;
    case BT_MESSAGE_TYPE_PACKET_BEGINNING:
      packet_begin(message);
      break;
    case BT_MESSAGE_TYPE_PACKET_END:
      packet_end(message);
      break;
    case BT_MESSAGE_TYPE_EVENT:
      event(message);
      break;
    case BT_MESSAGE_TYPE_DISCARDED_EVENTS:
      discarded_events(message);
      break;
    case BT_MESSAGE_TYPE_DISCARDED_PACKETS:
      discarded_packets(message);
      break;
    default:
      break;
  }
}

}  // namespace cie::analysis::bt
