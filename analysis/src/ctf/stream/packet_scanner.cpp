#include "packet_scanner.hpp"

#include "ctf/metadata/types.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

namespace cie::analysis::ctf {
namespace {

constexpr const char* kBeyondTime = "a time is 2^63 nanoseconds or more";
constexpr std::uint64_t kSearchPiece = 64U << 10U;
constexpr std::uint64_t kMaxHeader = 1U << 20U;
constexpr std::uint64_t kHeaderSteps = 100'000;
constexpr std::uint64_t kExamineAgain = 4;  // times the file's size
constexpr std::uint64_t kExamineFree = 64U << 20U;

const Field& at(const Field* fields, PacketHeaderSlot which) { return fields[slot(which)]; }
const Field& at(const Field* fields, PacketContextSlot which) { return fields[slot(which)]; }

std::optional<std::uint64_t> number(const Field& field) {
  if (field.kind != Field::Kind::integer) return std::nullopt;
  return static_cast<std::uint64_t>(field.number);
}

// The uuid that a packet's header has, if it is another one than `own`.
std::optional<Uuid> uuid_unlike(const Uuid& own, const Field& field) {
  Uuid uuid{};
  if (field.kind != Field::Kind::integers || field.length != uuid.size()) return uuid;
  std::transform(field.elements, field.elements + uuid.size(), uuid.begin(),
                 [](std::uint32_t byte) { return static_cast<std::uint8_t>(byte); });
  return uuid == own ? std::nullopt : std::optional(uuid);
}

std::optional<Counter> counter(const Field& field) {
  if (field.kind != Field::Kind::integer) return std::nullopt;
  return Counter{.value = static_cast<std::uint64_t>(field.number), .bits = field.length};
}

}  // namespace

PacketScanner::PacketScanner(const File& file, const TracePlan& trace, std::size_t piece,
                             const TimeWindow& window)
    : trace_(trace),
      time_window_(window),
      window_(file, piece),
      ahead_(file, kHeaderPiece),
      probe_(window_, frame_) {
  frame_.elements = &elements_;
  ahead_frame_.elements = &elements_;
}

// Runs a program at bits.at, showing more of the file as it needs it.
bool PacketScanner::read_header(std::uint64_t offset, const Sequence* program, Field* fields,
                                Bits& bits, Place place) {
  if (program == nullptr) return true;
  const auto begin = bits.at;
  const auto order = place.frame.order;
  for (auto want = kHeaderPiece;; want *= 2) {
    const auto available = place.window.show(offset, want);
    bits = {.data = place.window.data(), .at = begin, .end = available * 8};
    place.frame.fields = fields;
    place.frame.order = order;
    place.frame.steps = kHeaderSteps;
    const auto outcome = run(*program, bits, place.frame);
    if (outcome == Outcome::ok) return true;
    if (outcome == Outcome::cut && available < want) {
      reason_ = "the file ends within a packet's header";
      return false;
    }
    if (outcome != Outcome::cut || want > kMaxHeader) {
      reason_ = "a packet's header cannot be decoded";
      return false;
    }
  }
}

const StreamPlan* PacketScanner::stream_of(const Field* header) {
  const auto id = number(at(header, PacketHeaderSlot::stream_id));
  const auto* stream = id ? trace_.find(*id) : trace_.only_stream();
  if (stream == nullptr && !id) stream = trace_.find(0);
  if (stream == nullptr) reason_ = "a packet's stream id is not in the metadata";
  return stream;
}

std::optional<Packet> PacketScanner::header_at(std::uint64_t offset, Place place) {
  std::array<Field, kMaxSlots> header{};
  Bits bits;
  if (!read_header(offset, trace_.packet_header, header.data(), bits, place)) return std::nullopt;
  if (trace_.has_magic && number(at(header.data(), PacketHeaderSlot::magic)) != kPacketMagic) {
    reason_ = "no packet begins here (wrong magic number)";
    return std::nullopt;
  }
  std::optional<Uuid> other_uuid;
  if (trace_.has_header_uuid) {
    other_uuid = uuid_unlike(*trace_.uuid, at(header.data(), PacketHeaderSlot::uuid));
    if (other_uuid && other_uuid != other_uuid_ && !is_any_uuid_good_) {
      has_unknown_uuid_ = true;
      reason_ = "a packet of another trace (wrong uuid)";
      return std::nullopt;
    }
  }
  const auto* stream = stream_of(header.data());
  if (stream == nullptr) return std::nullopt;
  std::array<Field, kMaxSlots> context{};
  if (!read_header(offset, stream->packet_context, context.data(), bits, place))
    return std::nullopt;
  auto packet = describe(offset, *stream, header.data(), context.data(), bits.at);
  if (packet) {
    packet->order = place.frame.order;
    packet->other_uuid = other_uuid;
  }
  return packet;
}

std::optional<Packet> PacketScanner::describe(std::uint64_t offset, const StreamPlan& stream,
                                              const Field* header, const Field* context,
                                              std::uint64_t events_begin) {
  const auto rest = window_.file().size() - offset;
  const auto content_bits = number(at(context, PacketContextSlot::content_size));
  const auto told_bits = number(at(context, PacketContextSlot::packet_size));
  // Without a size of its own it is as large as its content, or all that is left of the file.
  const auto size_bits = told_bits.value_or(content_bits.value_or(rest * 8));
  Packet packet;
  packet.stream = &stream;
  packet.offset = offset;
  packet.size = size_bits / 8;
  packet.has_size = told_bits || content_bits;
  packet.events_begin = events_begin;
  packet.content_end = content_bits.value_or(size_bits);
  if (size_bits % 8 != 0 || packet.size == 0 || packet.content_end > size_bits ||
      packet.content_end < events_begin) {
    reason_ = "a packet's sizes contradict each other";
    return std::nullopt;
  }
  if (packet.size > rest) {
    reason_ = "the file ends within a packet (" + std::to_string(rest) + " of " +
              std::to_string(packet.size) + " bytes)";
    return std::nullopt;
  }
  packet.instance = number(at(header, PacketHeaderSlot::stream_instance_id));
  const auto& begin = at(context, PacketContextSlot::timestamp_begin);
  const auto& end = at(context, PacketContextSlot::timestamp_end);
  packet.begin = number(begin);
  if (const auto value = number(end)) {
    packet.end = packet.begin ? extend_clock(*packet.begin, *value, end.length) : *value;
  }
  const auto last = stream.clock.last_cycles();
  if (packet.begin.value_or(0) > last || packet.end.value_or(0) > last) {
    reason_ = kBeyondTime;
    return std::nullopt;
  }
  // What a crash left behind ends at 0.
  if (packet.begin && packet.end.value_or(0) != 0 && *packet.end < *packet.begin) {
    reason_ = "a packet ends before it begins";
    return std::nullopt;
  }
  packet.discarded = counter(at(context, PacketContextSlot::events_discarded));
  packet.sequence = counter(at(context, PacketContextSlot::packet_seq_num));
  if (const auto cpu = number(at(context, PacketContextSlot::cpu_id))) {
    packet.cpu = static_cast<std::int32_t>(*cpu);
  }
  return packet;
}

// A hole reads as events without end where it is as large as a sparse file may be: what is looked
// at stays in proportion to what the file system keeps.
bool PacketScanner::is_mostly_hole(const Packet& packet) {
  constexpr std::uint64_t kFreeHoles = 64U << 20U;
  constexpr std::uint64_t kHolesPerByte = 4;
  const auto& file = window_.file();
  const auto holes = file.hole_bytes(packet.offset, packet.content_end / 8);
  if (holes == 0) return false;
  holes_ += holes;
  if (holes_ <= kFreeHoles + kHolesPerByte * file.stored()) return false;
  holes_ -= holes;
  reason_ = "a packet most of which was never written";
  return true;
}

bool PacketScanner::is_of_other_cpu(const Packet& packet) {
  if (!trace_.has_stream_per_cpu || !packet.cpu) return false;
  if (!cpu_) cpu_ = packet.cpu;
  if (cpu_ == packet.cpu) return false;
  reason_ = "a packet of CPU " + std::to_string(*packet.cpu) + " in a stream of CPU " +
            std::to_string(*cpu_);
  return true;
}

// What a crash left behind has no end: it may hold anything.
bool PacketScanner::is_outside(const Packet& packet) const {
  if (!packet.stream->has_packet_times || !packet.begin || !packet.end) return false;
  if (*packet.end < *packet.begin) return false;
  const auto& clock = packet.stream->clock;
  return clock.time_of(*packet.end) < time_window_.from ||
         clock.time_of(*packet.begin) > time_window_.to;
}

bool PacketScanner::has_readable_events(const Packet& packet, std::uint64_t& last_clock,
                                        NotedEvents* noted) {
  probe_.begin(packet, last_clock);
  if (is_mostly_hole(packet)) return false;
  examined_ += packet.content_end / 8;
  if (noted != nullptr) noted->begin(packet, window_);
  const auto last = packet.stream->clock.last_cycles();
  for (;;) {
    const bool are_noted = noted != nullptr && noted->walk(probe_);
    // Every event of a packet passes here or there once more than it must: nothing but sizes and times
    // is looked at. Behind one that cannot be noted others may be.
    bool has_passed = false;
    probe_.walk_fixed([are_noted, last, &has_passed](const EventCursor::Fixed& event) {
      return event.clock <= last && (!are_noted || !std::exchange(has_passed, true));
    });
    if (has_passed) continue;
    last_clock = probe_.clock();
    const auto step = probe_.next();
    if (step == EventCursor::Step::end) return true;
    if (step == EventCursor::Step::damaged || !probe_.read_body()) {
      reason_ = probe_.reason();
      return false;
    }
    if (probe_.clock() > last) {
      reason_ = kBeyondTime;
      return false;
    }
  }
}

// What is no packet of a tracer but all of a file is read as far as it goes.
void PacketScanner::cut(Packet& packet) {
  rest_ = Damage{.offset = packet.offset + probe_.event_begin() / 8, .reason = reason_};
  packet.content_end = probe_.event_begin();
  packet.size = (packet.content_end + 7) / 8;
  offset_ = window_.file().size();
}

// Where the next packet may begin at or after `from`; the file's end if nowhere.
std::uint64_t PacketScanner::find_magic(std::uint64_t from, Window& window) {
  const auto size = window.file().size();
  if (!trace_.has_magic) return size;
  std::array<std::uint8_t, 4> magic{0xC1, 0x1F, 0xFC, 0xC1};
  if (trace_.byte_order == ByteOrder::big) std::reverse(magic.begin(), magic.end());
  while (from < size) {
    const auto available = window.show(from, std::max<std::uint64_t>(window.piece(), kSearchPiece));
    if (available < magic.size()) return size;
    const auto* found = static_cast<const std::uint8_t*>(
        ::memmem(window.data(), available, magic.data(), magic.size()));
    if (found != nullptr) return from + static_cast<std::uint64_t>(found - window.data());
    from += available - (magic.size() - 1);
    if (window.data()[available - 1] == 0) from = window.file().data_from(from);
  }
  return size;
}

// Whether a packet begins there, or the file ends.
bool PacketScanner::is_packet_ahead(std::uint64_t offset) {
  if (offset >= window_.file().size()) return true;
  const auto reason = reason_;
  auto& window = window_.holds(offset, kHeaderPiece) ? window_ : ahead_;
  packet_ahead_ = header_at(offset, {window, ahead_frame_});
  reason_ = reason;
  return packet_ahead_.has_value();
}

// Another packet that begins inside one: bytes are missing from that one.
std::optional<std::uint64_t> PacketScanner::packet_within(const Packet& packet) {
  const auto end = packet.offset + packet.size;
  if (examined_ > kExamineFree + kExamineAgain * window_.file().stored()) return std::nullopt;
  for (auto at = packet.offset + packet.events_begin / 8;; ++at) {
    at = find_magic(at, ahead_);
    if (at >= end) return std::nullopt;
    if (is_packet_ahead(at)) return at;
    examined_ += kHeaderPiece;
  }
}

// Where to look on after a packet whose events cannot be read: behind it if a packet begins there;
// otherwise within it, because bytes may be missing from it.
std::uint64_t PacketScanner::after_bad_content(const Packet& packet) {
  const auto end = packet.offset + packet.size;
  if (is_packet_ahead(end)) return end;
  const bool may_look_again = examined_ < kExamineFree + kExamineAgain * window_.file().stored();
  const auto skipped = may_look_again ? packet.events_begin / 8 : probe_.position() / 8;
  return find_magic(packet.offset + std::max<std::uint64_t>(skipped, 1), window_);
}

std::optional<Packet> PacketScanner::packet_of_other_uuid(std::uint64_t offset) {
  const auto before = std::exchange(other_uuid_, std::nullopt);
  is_any_uuid_good_ = true;
  auto packet = header_at(offset);
  is_any_uuid_good_ = false;
  if (packet) {
    other_uuid_ = packet->other_uuid;
    if (is_packet_ahead(offset + packet->size)) return packet;
  }
  other_uuid_ = before;
  reason_ = "a packet of another trace (wrong uuid)";
  return std::nullopt;
}

// By its header alone; empty: `reason_` says why.
std::optional<Packet> PacketScanner::packet_at(std::uint64_t offset) {
  if (packet_ahead_ && packet_ahead_->offset == offset) {
    frame_.registers = ahead_frame_.registers;
    return std::exchange(packet_ahead_, std::nullopt);
  }
  has_unknown_uuid_ = false;
  auto packet = header_at(offset);
  if (packet || !has_unknown_uuid_) return packet;
  return packet_of_other_uuid(offset);
}

std::optional<Packet> PacketScanner::next_header() {
  const auto size = window_.file().size();
  while (offset_ < size) {
    auto packet = packet_at(offset_);
    offset_ = packet ? packet->offset + packet->size : find_magic(offset_ + 1, window_);
    if (packet) return packet;
  }
  return std::nullopt;
}

bool PacketScanner::has_events(const Packet& packet) {
  if (packet.content_end == packet.events_begin) return false;
  probe_.begin(packet, 0);
  return probe_.next() != EventCursor::Step::end;
}

std::optional<std::uint64_t> PacketScanner::last_clock(const Packet& packet) {
  auto clock = packet.begin.value_or(0);
  return has_readable_events(packet, clock) ? std::optional(clock) : std::nullopt;
}

std::optional<std::uint64_t> PacketScanner::last_clock_with_room(const Found& found) {
  const auto& packet = *found.packet;
  if (found.is_outside || packet.size <= kRoom) return std::nullopt;
  const auto limit = (packet.size - kRoom) * 8;
  if (packet.content_end <= limit) return std::nullopt;
  auto clock = packet.begin.value_or(0);
  probe_.begin(packet, clock);
  for (;;) {
    probe_.walk_fixed([&](const EventCursor::Fixed& event) {
      if (probe_.position_of(event) > limit) return false;
      clock = event.clock;
      return true;
    });
    const bool has_room = probe_.next() == EventCursor::Step::event && probe_.position() <= limit;
    if (!has_room) return clock;
    clock = probe_.clock();
    if (!probe_.read_body()) return clock;
  }
}

PacketScanner::Found PacketScanner::next(NotedEvents* noted) {
  Found found{.damage = std::exchange(rest_, std::nullopt), .packet = {}};
  const auto note = [&](std::uint64_t offset) {
    if (!found.damage) found.damage = Damage{.offset = offset, .reason = reason_};
  };
  const auto size = window_.file().size();
  while (offset_ < size) {
    auto packet = packet_at(offset_);
    if (!packet) {
      note(offset_);
      offset_ = find_magic(offset_ + 1, window_);
      continue;
    }
    if (is_of_other_cpu(*packet)) {
      note(packet->offset);
      offset_ = packet->offset + packet->size;
      continue;
    }
    if (noted != nullptr) noted->clear();
    auto clock = packet->begin.value_or(0);
    const bool is_skipped = is_outside(*packet);
    if (!is_skipped && !has_readable_events(*packet, clock, noted)) {
      if (!packet->has_size && probe_.event_begin() > packet->events_begin) {
        if (noted != nullptr) noted->clear();
        cut(*packet);
        found.packet = packet;
        found.last_clock = clock;
        break;
      }
      reason_ += ", in byte " + std::to_string(packet->offset + probe_.event_begin() / 8);
      note(packet->offset);
      offset_ = after_bad_content(*packet);
      continue;
    }
    if (trace_.has_magic && !is_packet_ahead(packet->offset + packet->size)) {
      if (const auto inner = packet_within(*packet)) {
        reason_ = "bytes are missing from a packet: another one begins inside it";
        note(packet->offset);
        offset_ = *inner;
        continue;
      }
    }
    // Looking at the events has overwritten what the header left in the registers: nothing that
    // lasts, since events have registers of their own.
    offset_ = packet->offset + packet->size;
    found.packet = packet;
    found.last_clock = clock;
    found.is_outside = is_skipped;
    break;
  }
  return found;
}

}  // namespace cie::analysis::ctf
