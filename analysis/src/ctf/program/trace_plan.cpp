#include "trace_plan.hpp"

#include <cie/tracepoints/schema.hpp>

#include "ctf/metadata/tokens.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <span>
#include <utility>

namespace cie::analysis::ctf {
namespace {

// Registers by life time; see kRegisters.
constexpr RegisterRange kTraceRegisters{.next = 0, .end = 16};
constexpr RegisterRange kStreamRegisters{.next = 16, .end = 80};
constexpr RegisterRange kEventRegisters{.next = 80, .end = kRegisters};

constexpr std::size_t kDenseIds = 65'536;
// Each takes some two KiB, however short its declaration is.
constexpr std::size_t kMaxStreams = 10'000;
constexpr std::size_t kMaxEvents = 100'000;
constexpr std::uint32_t kMostMalformed = 100;
constexpr std::size_t kMaxDenseIds = 16 * kDenseIds;  // of all streams together

const std::vector<FieldRequest> kPacketHeader{"magic", "uuid", "stream_id", "stream_instance_id"};
const std::vector<FieldRequest> kPacketContext{
    "packet_size",      "content_size",   "timestamp_begin", "timestamp_end",
    "events_discarded", "packet_seq_num", "cpu_id"};
// The same by roles; what has none keeps its name.
constexpr std::array kPacketHeaderRoles{Role::magic, Role::metadata_uuid, Role::stream_class,
                                        Role::stream_instance};
constexpr std::array kPacketContextRoles{
    Role::packet_size,      Role::content_size,    Role::time, Role::packet_end_time,
    Role::discarded_events, Role::packet_sequence, Role::none};

std::string value_of(const Metadata& metadata, const char* name) {
  const auto found = metadata.environment.find(name);
  return found == metadata.environment.end() ? std::string{} : found->second;
}

// LTTng's tracers put the time first in a packet's context, babeltrace2's sink the packet's size.
bool begins_as_lttngs(const std::pair<const std::uint64_t, StreamClass>& stream) {
  const auto& context = stream.second.packet_context;
  return context && !context->members.empty() && context->members.front().name == "timestamp_begin";
}

// The clock that a stream's times are of: the one its types name, else the trace's first.
ClockPlan clock_of(const Metadata& metadata, const std::string& name) {
  const Clock* chosen = metadata.clocks.empty() ? nullptr : &metadata.clocks.front();
  for (const auto& clock : metadata.clocks) {
    if (!name.empty() && clock.name == name) chosen = &clock;
  }
  if (chosen == nullptr) return {};
  ClockPlan plan;
  plan.frequency = chosen->frequency;
  if (const auto uuid = parse_uuid(chosen->uuid)) {
    plan.uuid = chosen->uuid;
    for (auto& c : plan.uuid) {
      if (c >= 'A' && c <= 'F') c = static_cast<char>(c - 'A' + 'a');
    }
  } else if (metadata.has_roles) {
    plan.uuid = chosen->uuid;
  }
  plan.offset_ns =
      clock_offset(chosen->offset_s, static_cast<std::uint64_t>(chosen->offset), plan.frequency);
  return plan;
}

bool begins_with_magic(const Metadata& metadata) {
  const auto& first = metadata.packet_header->members.front();
  if (!metadata.has_roles) return first.name == "magic";
  return std::ranges::find(first.type->roles, Role::magic) != first.type->roles.end();
}

const Sequence* program_or_null(const Scope& scope) {
  return scope.program().ops.empty() ? nullptr : &scope.program();
}

}  // namespace

Scope& TracePlan::new_scope(std::string_view root, RegisterRange& registers,
                            const std::vector<Scope*>& earlier) {
  scopes_.push_back(std::make_unique<Scope>(root, context_, registers, earlier));
  return *scopes_.back();
}

// Of a scope that no later one refers to: it need not stay.
const Sequence* TracePlan::keep_program(const Scope& scope) {
  const auto* program = program_or_null(scope);
  if (program != nullptr) programs_.push_back(scope.shared_program());
  return program;
}

std::string host_of(const Metadata& metadata) {
  const auto name = value_of(metadata, "hostname");  // LTTng's; perf says "host"
  return name.empty() ? value_of(metadata, "host") : name;
}

TracePlan::TracePlan(const Metadata& metadata, EventChoice* choice)
    : byte_order(metadata.byte_order),
      choice_(choice),
      reader_(metadata.reader),
      trace_registers_(kTraceRegisters) {
  context_.byte_order = metadata.byte_order;
  context_.has_roles = metadata.has_roles;
  uuid = parse_uuid(metadata.uuid);
  host = host_of(metadata);
  is_snapshot = value_of(metadata, "trace_name").starts_with(kSnapshotSession);
  domain = value_of(metadata, "domain") == "kernel" ? Domain::kernel : Domain::user;
  const auto tracer = value_of(metadata, "tracer_name");
  if (tracer == "lttng-modules") priority_offset = 100;
  has_stream_per_cpu = tracer == "lttng-modules" || tracer == "lttng-ust";
  if (has_stream_per_cpu) {
    const bool is_own = std::ranges::all_of(metadata.streams, begins_as_lttngs);
    writer = is_own ? PacketWriter::lttng : PacketWriter::copier;
  }
  if (domain == Domain::user) {
    const auto declares_any = [&metadata](bool (*is_wanted)(std::string_view)) {
      return std::ranges::any_of(metadata.events, is_wanted, &EventClass::name);
    };
    has_callback_events = declares_any(is_callback_start);
    has_client_events = declares_any(is_client_init) && declares_any(is_service_init);
  }

  if (metadata.streams.size() > kMaxStreams || metadata.events.size() > kMaxEvents) {
    throw MetadataError("it declares more streams or events than any honest tracer does");
  }
  auto& header = new_scope("trace.packet.header", trace_registers_, {});
  header.build(metadata.packet_header, kPacketHeader, kPacketHeaderRoles);
  has_magic = header.has_slot(slot(PacketHeaderSlot::magic));
  has_header_uuid = header.has_slot(slot(PacketHeaderSlot::uuid)) && uuid.has_value();
  has_stream_id = header.has_slot(slot(PacketHeaderSlot::stream_id));
  EventsOfStreams events;
  for (const auto& event : metadata.events)
    events[event.stream].push_back(&event);
  for (const auto& [id, stream] : metadata.streams) {
    try {
      add_stream(metadata, stream, events[id]);
    } catch (const MetadataError& error) {
      throw MetadataError("stream " + std::to_string(id) + ": " + error.what());
    }
  }
  if (domain == Domain::kernel && has_class("sched_switch")) {
    has_inheritance = has_class("sched_pi_setprio");
  }
  // Later scopes may have made this one keep values.
  packet_header = program_or_null(header);
  // What stands elsewhere does not tell where packets begin.
  has_magic = has_magic && begins_with_magic(metadata);
}

void TracePlan::add_stream(const Metadata& metadata, const StreamClass& stream,
                           std::span<const EventClass* const> events) {
  auto& plan = streams_[stream.id];
  plan.id = stream.id;
  plan.trace_ = this;
  registers_.push_back(std::make_unique<RegisterRange>(kStreamRegisters));
  auto& registers = *registers_.back();
  std::vector<Scope*> earlier{scopes_.front().get()};

  auto& packet = new_scope("stream.packet.context", registers, earlier);
  packet.build(stream.packet_context, kPacketContext, kPacketContextRoles);
  earlier.push_back(&packet);
  auto& header = new_scope("stream.event.header", registers, earlier);
  header.build_header(stream.event_header);
  earlier.push_back(&header);
  auto& context = new_scope("stream.event.context", registers, earlier);
  context.build(stream.event_context, context_requests());
  tells_pid_namespace = tells_pid_namespace || context.has_slot(slot(ContextSlot::pid_ns));
  auto before_shown = earlier;
  earlier.push_back(&context);
  Scope* shown_context = nullptr;
  if (choice_ != nullptr && choice_->has_fields()) {
    shown_context = &new_scope("stream.event.context", registers, before_shown);
    shown_context->build_shown(stream.event_context, context_requests(), *choice_);
    before_shown.push_back(shown_context);
  }

  const auto first_event = events_.size();
  for (const auto* event : events) {
    const bool is_shown = shown_context != nullptr && choice_->number(event->name);
    add_event_or_malformed(plan, *event, is_shown ? before_shown : earlier);
  }
  plan.starts_callbacks = std::ranges::any_of(
      events, [](const EventClass* event) { return is_callback_start(event->name); });
  plan.has_event_id = header.has_slot(slot(EventHeaderSlot::id));
  if (!plan.has_event_id && events.size() > 1) {
    throw MetadataError("several events, but the event header has no id");
  }
  plan.has_event_time = header.has_slot(slot(EventHeaderSlot::time));
  plan.has_packet_times = packet.has_slot(slot(PacketContextSlot::timestamp_begin)) &&
                          packet.has_slot(slot(PacketContextSlot::timestamp_end));
  const bool has_time = plan.has_event_time ||
                        packet.has_slot(slot(PacketContextSlot::timestamp_begin)) ||
                        packet.has_slot(slot(PacketContextSlot::timestamp_end));
  if (metadata.has_roles && has_time && stream.clock.empty()) {
    throw MetadataError("it has times, but no clock");
  }
  auto clock = stream.clock;
  if (clock.empty() && plan.has_event_time) {
    clock = header.clock_of_slot(slot(EventHeaderSlot::time));
  } else if (clock.empty() && plan.has_packet_times) {
    clock = packet.clock_of_slot(slot(PacketContextSlot::timestamp_begin));
  }
  plan.clock = clock_of(metadata, clock);
  plan.packet_context = program_or_null(packet);
  plan.event_header = program_or_null(header);
  plan.event_context = program_or_null(context);
  if (shown_context != nullptr) plan.shown_context = program_or_null(*shown_context);
  // Now that every reference is known.
  plan.header_layout = header_layout_of(plan.event_header);
  for (auto i = first_event; i < events_.size(); ++i) {
    if (events_[i]->unread_fields.empty() && !events_[i]->is_malformed)
      find_layouts(plan, *events_[i]);
  }
  if (plan.header_layout) {
    plan.most_fixed_bytes_ = plan.header_layout->most_bytes + FixedField::kSlack;
  }
  plan.fixed_.resize(plan.dense_.size());
  for (std::size_t i = 0; i < plan.dense_.size(); ++i) {
    if (plan.dense_[i] != nullptr) plan.make_fixed(i, *plan.dense_[i]);
  }
}

void StreamPlan::make_fixed(std::size_t event_id, const EventPlan& event) {
  if (!event.fixed || event.fixed->bytes > std::numeric_limits<std::uint32_t>::max()) return;
  if (event.number > std::numeric_limits<std::uint16_t>::max()) return;
  fixed_[event_id] = {.bytes = event.fixed->bytes,
                      .event_class = static_cast<std::uint16_t>(event.number),
                      .is_other = event.is_other()};
  if (!header_layout) return;
  most_fixed_bytes_ = std::max(most_fixed_bytes_,
                               header_layout->most_bytes + event.fixed->bytes + FixedField::kSlack);
}

void StreamPlan::complete(std::uint64_t event_id, EventPlan& event) const {
  auto& stream = trace_->streams_.at(id);
  trace_->complete(stream, event);
  if (event_id < fixed_.size()) stream.make_fixed(event_id, event);
}

// Of one that means nothing to anybody, but must be stepped over.
void TracePlan::complete(StreamPlan& stream, EventPlan& event) {
  const auto unread = std::exchange(event.unread_fields, {});
  try {
    RegisterRange registers(kEventRegisters);
    Scope fields("event.fields", context_, registers, {});
    fields.build(reader_->read(unread), {});
    event.fields = keep_program(fields);
    find_layouts(stream, event);
  } catch (const MetadataError&) {
    event.is_malformed = true;
  }
}

void TracePlan::find_layouts(const StreamPlan& stream, EventPlan& event) {
  const auto common = layout_of(event.is_shown ? stream.shown_context : stream.event_context);
  const auto own = layout_of(event.context);
  const auto fields = layout_of(event.fields);
  if (!common || !own || !fields) return;
  EventPlan::FixedBody body;
  if (event.translation != nullptr) body.fields.resize(event.translation->fields.size());
  const auto take = [&body](FixedField field, std::span<FixedField> slots) {
    field.offset += static_cast<std::uint32_t>(body.bytes);
    slots[static_cast<std::uint8_t>(field.slot)] = field;
  };
  for (const auto& field : common->fields)
    take(field, body.context);
  body.bytes = common->bytes;
  for (const auto& field : own->fields) {
    const std::size_t wanted = static_cast<std::uint8_t>(field.slot);
    if ((event.has_own_pid && wanted == slot(ContextSlot::pid)) ||
        (event.has_own_tid && wanted == slot(ContextSlot::tid))) {
      take(field, body.context);
    }
  }
  body.bytes += own->bytes;
  for (const auto& field : fields->fields)
    take(field, body.fields);
  body.bytes += fields->bytes;
  if (event.translation != nullptr && event.translation->has_thread_name) {
    body.fields[event.translation->fields.size() - 1] = body.context[slot(ContextSlot::name)];
  }
  // Events of no size must be noticed: the programs do.
  if (body.bytes > 0 || stream.header_layout) event.fixed = std::move(body);
}

// By LTTng's name of it, or perf's; one without the fields that are needed is none.
bool TracePlan::has_class(const std::string& name) const {
  return std::ranges::any_of(events_, [&name](const auto& event) {
    return event->translation != nullptr && (event->name == name || event->name == "sched:" + name);
  });
}

// What an event is without a vocabulary.
void TracePlan::choose(EventPlan& plan) const {
  const auto number = choice_->number(plan.name);
  plan.is_shown = number && choice_->has_fields();
  plan.other = {.name = {}, .event_class = number.value_or(OtherEvent::kNoClass)};
  plan.translation = nullptr;
  plan.is_filled_at_once = false;
}

void TracePlan::add_event(StreamPlan& plan, const EventClass& event,
                          const std::vector<Scope*>& earlier) {
  auto result = std::make_unique<EventPlan>();
  result->number = static_cast<std::uint32_t>(events_.size());
  result->name = event.name;
  result->translation = find_translation(event.name);
  const bool has_memory =
      result->translation != nullptr && result->translation->translate == nullptr;
  result->is_filled_at_once = has_memory || domain == Domain::kernel || is_kernel_event(event.name);
  result->other.name = result->name;
  if (choice_ != nullptr) choose(*result);
  const bool is_unread = !event.unread_fields.empty();
  if (is_unread && result->is_other()) {
    // Many are written alike. Throws if they cannot be read.
    if (readable_.insert(event.unread_fields).second) reader_->read(event.unread_fields);
    result->unread_fields = event.unread_fields;
    enter(plan, event.id, std::move(result));
    return;
  }
  RegisterRange registers(kEventRegisters);
  const auto build = [&](Scope& scope, const TypeRef& type, std::span<const FieldRequest> wanted) {
    return result->is_shown ? scope.build_shown(type, wanted, *choice_) : scope.build(type, wanted);
  };
  auto before_fields = earlier;
  std::optional<Scope> context;  // most events have none of their own
  if (event.context) {
    context.emplace("event.context", context_, registers, earlier);
    // Only what the common context does not have is taken from here.
    build(*context, event.context, context_requests());
    const auto* common = earlier.back();
    const auto is_own = [&](ContextSlot which) {
      return context->has_slot(slot(which)) && !common->has_slot(slot(which));
    };
    result->has_own_pid = is_own(ContextSlot::pid);
    result->has_own_tid = is_own(ContextSlot::tid);
    before_fields.push_back(&*context);
  }
  const auto type = is_unread ? reader_->read(event.unread_fields) : event.fields;
  std::optional<Scope> fields;
  const auto build_fields = [&, of_context = registers](std::span<const FieldRequest> wanted) {
    registers = of_context;
    build(fields.emplace("event.fields", context_, registers, before_fields), type, wanted);
  };
  if (result->translation != nullptr) {
    build_fields(result->translation->fields);
    result->translation = if_whole(
        result->translation, [&fields](std::size_t wanted) { return fields->has_slot(wanted); });
  }
  if (result->translation == nullptr) build_fields({});
  if (context) result->context = keep_program(*context);
  result->fields = keep_program(*fields);
  enter(plan, event.id, std::move(result));
}

void TracePlan::add_event_or_malformed(StreamPlan& plan, const EventClass& event,
                                       const std::vector<Scope*>& earlier) {
  try {
    if (!event.malformed.empty()) throw MetadataError(event.malformed);
    add_event(plan, event, earlier);
  } catch (const MetadataError& error) {
    auto reason = "event \"" + event.name.substr(0, kShown) + "\": " + error.what();
    // Each is looked for in the text.
    if (++malformed_classes > kMostMalformed) throw MetadataError(reason);
    if (malformed.empty()) malformed = std::move(reason);
    auto result = std::make_unique<EventPlan>();
    result->number = static_cast<std::uint32_t>(events_.size());
    result->name = event.name;
    result->is_malformed = true;
    result->other.name = result->name;
    enter(plan, event.id, std::move(result));
  }
}

void TracePlan::enter(StreamPlan& stream, std::uint64_t event_id,
                      std::unique_ptr<EventPlan> event) {
  // Streams that share their small ids' tables evenly do not grow them without bound.
  auto& dense = stream.dense_;
  const auto grown = event_id < dense.size() ? 0 : event_id + 1 - dense.size();
  if (event_id < kDenseIds && dense_ids_ + grown <= kMaxDenseIds) {
    dense_ids_ += grown;
    dense.resize(dense.size() + grown);
    dense[event_id] = event.get();
  } else {
    stream.sparse_[event_id] = event.get();
  }
  events_.push_back(std::move(event));
}

const StreamPlan* TracePlan::find(std::uint64_t stream_id) const noexcept {
  const auto found = streams_.find(stream_id);
  return found == streams_.end() ? nullptr : &found->second;
}

const StreamPlan* TracePlan::only_stream() const noexcept {
  return streams_.size() == 1 ? &streams_.begin()->second : nullptr;
}

}  // namespace cie::analysis::ctf
