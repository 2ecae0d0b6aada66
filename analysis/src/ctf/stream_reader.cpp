#include "stream_reader.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace cie::analysis::ctf {
namespace {

constexpr Timestamp kForever{std::numeric_limits<std::int64_t>::max()};

std::int64_t saturating_add(std::int64_t a, std::int64_t b) noexcept {
  std::int64_t sum = 0;
  if (!__builtin_add_overflow(a, b, &sum)) return sum;
  return b < 0 ? std::numeric_limits<std::int64_t>::min()
               : std::numeric_limits<std::int64_t>::max();
}

}  // namespace

StreamReader::StreamReader(std::vector<StreamFile> files, StreamIdentity identity,
                           VocabularyState& state)
    : files_(std::move(files)), identity_(identity), state_(state) {
  if (const auto& first = files_.front().first) {
    clock_ = first->stream->clock;
    has_packet_times_ = first->stream->has_packet_times;
    has_times_ = has_packet_times_ || first->stream->has_event_time;
  }
  load_packet();
}

void StreamReader::head(Event& event, Timestamp time) const noexcept {
  event.head.time = time;
  event.head.stream = identity_.index;
  event.head.cpu.reset();
  if (packet_) event.head.cpu = packet_->cpu;
  event.head.pid.reset();
  event.head.tid.reset();
}

void StreamReader::stand_at(Timestamp time) noexcept {
  key_ = std::max(key_, saturating_add(time.ns, identity_.merge_offset_ns));
}

void StreamReader::emit_begin(const EventSink& sink, Event& event) const {
  event.head = {.time = {}, .stream = identity_.index, .cpu = {}, .pid = {}, .tid = {}};
  const auto& trace = *files_.front().trace;
  event.body = StreamBegin{.channel = identity_.channel,
                           .domain = trace.domain,
                           .host = trace.host,
                           .clock_uuid = clock_.uuid,
                           .clock_offset_ns = clock_.offset_ns,
                           .path = files_.front().file.path()};
  sink(event);
}

std::string StreamReader::place_of(const Damage& damage) const {
  return files_[std::min(file_, files_.size() - 1)].file.path() + " at byte " +
         std::to_string(damage.offset) + ": " + damage.reason;
}

void StreamReader::note_damage(const Damage& damage) {
  if (!first_damage_) first_damage_ = Damage{.offset = damage.offset, .reason = place_of(damage)};
  gap_.damages.push_back({.offset = damage.offset, .reason = place_of(damage)});
}

// Whether the packet found is one to read: not one that was there before.
bool StreamReader::take(const PacketScanner::Found& found) {
  const auto& packet = *found.packet;
  if (packet.stream->id != files_.front().first->stream->id) {
    note_damage({.offset = packet.offset, .reason = "a packet of another stream"});
    return false;
  }
  if (packet.sequence && last_sequence_) {
    const auto step = packet.sequence->since(*last_sequence_);
    const auto half = packet.sequence->bits >= 64 ? std::uint64_t{1} << 63U
                                                  : std::uint64_t{1} << (packet.sequence->bits - 1);
    if (step == 0 || step >= half) {
      // Snapshots repeat what an earlier one had; within a file nothing repeats.
      if (last_sequence_file_ == file_) {
        note_damage({.offset = packet.offset,
                     .reason = "a packet that was there before, or out of order (number " +
                               std::to_string(packet.sequence->value) + ")"});
      }
      return false;
    }
  }
  packet_ = packet;
  packet_last_clock_ = found.last_clock;
  return true;
}

// Finds the next good packet and what is missing before it.
void StreamReader::load_packet() {
  packet_.reset();
  cursor_.reset();
  gap_ = {};
  while (file_ < files_.size() && !packet_) {
    const auto& current = files_[file_];
    if (!scanner_) {
      scanner_ = std::make_unique<PacketScanner>(current.file, *current.trace, identity_.piece);
    }
    const auto found = scanner_->next();
    if (found.damage) note_damage(*found.damage);
    if (!found.packet) {
      scanner_.reset();
      ++file_;
    } else if (take(found)) {
      cursor_.emplace(scanner_->window(), scanner_->frame());
    }
  }
  if (packet_) {
    ++packets_;
    count_losses();
    if (!last_end_ && packet_->begin) stand_at(time_of(*packet_->begin));
    step_ = gap_.is_any() ? Step::gap : Step::packet_begin;
    if (step_ == Step::packet_begin && packet_->begin) stand_at(time_of(*packet_->begin));
  } else {
    step_ = gap_.is_any() ? Step::gap : Step::stream_end;
  }
}

void StreamReader::count_losses() {
  if (const auto& discarded = packet_->discarded) {
    // Tracers count from 0: what the first packet has was lost before or in it. LTTng may note a
    // packet's count after a later one's: then nothing new was lost.
    const auto last = last_discarded_.value_or(0);
    if (!last_discarded_ || !discarded->is_behind(last)) {
      if (const auto lost = discarded->since(last); lost > 0) gap_.discarded_events = lost;
      last_discarded_ = discarded->value;
    }
  }
  if (const auto& sequence = packet_->sequence) {
    const auto step = last_sequence_ ? sequence->since(*last_sequence_) : 1;
    // Packets that are damaged are missing as such.
    if (step > 1 && gap_.damages.empty()) gap_.discarded_packets = step - 1;
    last_sequence_ = sequence->value;
    last_sequence_file_ = file_;
  }
}

void StreamReader::emit_gap(const EventSink& sink, Event& event) {
  std::optional<Timestamp> next_begin;
  std::optional<Timestamp> next_end;
  if (packet_ && packet_->begin) next_begin = time_of(*packet_->begin);
  if (packet_ && packet_->end) next_end = time_of(*packet_->end);
  const auto from = last_end_ ? last_end_ : last_time_;
  const auto here = from ? *from : next_begin.value_or(Timestamp{});
  head(event, here);
  for (const auto& damage : gap_.damages) {
    event.body = DamagedPacket{.reason = damage.reason,
                               .begin = from.value_or(Timestamp{}),
                               .end = packet_ ? next_begin.value_or(here) : kForever};
    sink(event);
  }
  if (gap_.discarded_events) {
    event.body = Discarded{.begin = here,
                           .end = next_end.value_or(here),
                           .count = gap_.discarded_events,
                           .packets = false};
    sink(event);
  }
  if (gap_.discarded_packets) {
    event.body = Discarded{.begin = here,
                           .end = next_begin.value_or(here),
                           .count = gap_.discarded_packets,
                           .packets = true};
    sink(event);
  }
  gap_ = {};
}

void StreamReader::check_time(const EventSink& sink, Event& event, Timestamp time) {
  if (last_time_ && time < *last_time_) {
    const auto previous = *last_time_;
    event.body = TimeRegression{.previous = previous};
    sink(event);
  }
  last_time_ = time;
}

void StreamReader::emit_packet_begin(const EventSink& sink, Event& event) {
  cursor_->begin(*packet_, clock_cycles_);
  clock_cycles_ = cursor_->clock();
  if (has_packet_times_ && packet_->begin) {
    const auto time = time_of(*packet_->begin);
    head(event, time);
    check_time(sink, event, time);
    event.body = PacketBegin{};
    sink(event);
  }
  find_event();
}

void StreamReader::find_event() {
  if (cursor_->next() == EventCursor::Step::event) {
    cursor_->prefetch();
    step_ = Step::event;
    if (has_times_) stand_at(time_of(cursor_->clock()));
    return;
  }
  // Damage here means that the file changed since the packet was examined.
  step_ = Step::packet_end;
  if (packet_->end) stand_at(time_of(*packet_->end));
}

void StreamReader::emit_event(const EventSink& sink, Event& event) {
  const auto time = has_times_ ? time_of(cursor_->clock()) : Timestamp{};
  clock_cycles_ = cursor_->clock();
  head(event, time);
  if (!cursor_->read_body()) {
    event.body = DamagedPacket{.reason = cursor_->reason(), .begin = time, .end = kForever};
    sink(event);
    step_ = Step::packet_end;
    return;
  }
  check_time(sink, event, time);
  if (!has_packet_times_ && !has_begun_) {
    event.body = PacketBegin{};
    sink(event);
  }
  has_begun_ = true;
  event.head.pid = cursor_->context(ContextSlot::pid);
  event.head.tid = cursor_->context(ContextSlot::tid);
  const auto& plan = cursor_->plan();
  if (plan.translation == nullptr) {
    event.body = OtherEvent{.name = plan.name};
  } else {
    plan.translation->translate(cursor_->payload(), state_, event.body);
  }
  sink(event);
  find_event();
}

void StreamReader::emit_packet_end(const EventSink& sink, Event& event) {
  if (has_packet_times_ && packet_->begin && packet_->end) {
    // What a crash left behind has no end: its last event is.
    const bool is_open = *packet_->end < *packet_->begin;
    const auto time = time_of(is_open ? packet_last_clock_ : *packet_->end);
    head(event, time);
    event.body = PacketEnd{};
    sink(event);
    last_end_ = time;
    last_time_ = last_time_ ? std::max(*last_time_, time) : time;
  }
  load_packet();
}

void StreamReader::advance(const EventSink& sink, Event& event) {
  switch (step_) {
    case Step::gap:
      emit_gap(sink, event);
      step_ = packet_ ? Step::packet_begin : Step::stream_end;
      if (packet_ && packet_->begin) stand_at(time_of(*packet_->begin));
      break;
    case Step::packet_begin:
      emit_packet_begin(sink, event);
      break;
    case Step::event:
      emit_event(sink, event);
      break;
    case Step::packet_end:
      emit_packet_end(sink, event);
      break;
    case Step::stream_end:
      head(event, last_time_.value_or(Timestamp{}));
      if (!has_packet_times_ && has_begun_) {
        event.body = PacketEnd{};
        sink(event);
      }
      event.body = StreamEnd{};
      sink(event);
      step_ = Step::ended;
      break;
    case Step::ended:
      break;
  }
}

}  // namespace cie::analysis::ctf
