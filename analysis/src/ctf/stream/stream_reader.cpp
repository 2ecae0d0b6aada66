#include "stream_reader.hpp"

#include <string_view>
#include <utility>

namespace cie::analysis::ctf {

StreamReader::StreamReader(std::vector<StreamFile> files, StreamIdentity identity)
    : counts_others_(identity.counts_others && !files.front().trace->plan().is_snapshot),
      files_(std::move(files)),
      identity_(identity),
      clock_(files_.front().first ? files_.front().first->stream->clock
                                  : files_.front().trace->plan().clock()),
      noted_(ahead_options()) {
  if (const auto& first = files_.front().first) {
    has_packet_times_ = first->stream->has_packet_times;
    has_times_ = has_packet_times_ || first->stream->has_event_time;
  }
  frame_.elements = &elements_;
}

std::size_t StreamReader::packet_bytes() const noexcept {
  std::uint64_t bytes = 0;
  for (const auto& file : files_) {
    if (file.first) bytes = std::max(bytes, file.first->size);
  }
  return static_cast<std::size_t>(bytes);
}

std::size_t StreamReader::held_bytes() const noexcept {
  std::uint64_t most = 0;
  for (const auto& file : files_)
    most = std::max(most, file.file.size());
  return static_cast<std::size_t>(
      std::min<std::uint64_t>(std::max(packet_bytes(), kSmallestPiece), most));
}

std::size_t StreamReader::memory_for_packets() const noexcept {
  return PacketMemory::size_of_part(held_bytes() + Window::kReadable) +
         PacketMemory::size_of_part(NotedEvents::room_for(packet_bytes()));
}

void StreamReader::begin(PacketMemory* memory) {
  if (memory != nullptr) {
    room_ = memory->take(held_bytes() + Window::kReadable);
    noted_.set_room(memory->take(NotedEvents::room_for(packet_bytes())));
  }
  // With the header of a packet that ends where a piece does.
  piece_ = room_.empty() ? kSmallestPiece + PacketScanner::kHeaderPiece
                         : room_.size() - Window::kReadable;
  load_packet();
}

void StreamReader::emit(EventWriter& writer, Timestamp time, const EventBody& body) const {
  auto& event = writer.add();
  event.head = {.time = time, .stream = identity_.index, .cpu = cpu_, .pid = {}, .tid = {}};
  event.body = body;
  writer.keep(event);
}

void StreamReader::emit_begin(EventWriter& writer) const {
  auto& event = writer.add();
  event.head = {.time = {}, .stream = identity_.index, .cpu = cpu_, .pid = {}, .tid = {}};
  const auto& trace = files_.front().trace->plan();
  const auto& first = files_.front().first;
  event.body = StreamBegin{.channel = identity_.channel,
                           .trace = identity_.trace,
                           .domain = trace.domain,
                           .host = trace.host,
                           .clock_uuid = clock_.uuid,
                           .clock_offset_ns = clock_.offset_ns,
                           .path = files_.front().file.path(),
                           .is_snapshot = trace.is_snapshot,
                           .writer = trace.writer,
                           .has_events = !identity_.is_idle,
                           .is_left_out = identity_.is_left_out,
                           .has_inheritance = trace.has_inheritance,
                           .has_callback_events = trace.has_callback_events,
                           .has_client_events = trace.has_client_events,
                           .is_descriptive = trace.has_callback_events == true && first &&
                                             !first->stream->starts_callbacks};
  if (identity_.is_first_of_trace) {
    auto& begin = std::get<StreamBegin>(event.body);
    begin.malformed_classes = trace.malformed_classes;
    begin.malformed = trace.malformed;
  }
  writer.keep(event);
}

std::string StreamReader::place_of(const Damage& damage) const {
  return files_[std::min(file_, files_.size() - 1)].file.path() + " at byte " +
         std::to_string(damage.offset) + ": " + damage.reason;
}

void StreamReader::note_damage(const Damage& damage) {
  if (!first_damage_) first_damage_ = Damage{.offset = damage.offset, .reason = place_of(damage)};
  gap_.damages.push_back({.offset = damage.offset, .reason = place_of(damage)});
}

// Whether a packet's number goes on. Numbers that do not, those of a tracer that has none to tell
// or of a header that was damaged, are no reason to leave out a packet whose time goes on.
bool StreamReader::is_new(const Packet& packet) const {
  if (!packet.sequence || !last_sequence_) return true;
  const auto step = packet.sequence->since(*last_sequence_);
  if (step != 0 && !packet.sequence->is_behind(*last_sequence_)) return true;
  return packet.begin && last_packet_ && packet.begin > last_packet_->begin &&
         packet.begin >= last_packet_->end;
}

// Whether the packet found is one to read: not one that was there before.
bool StreamReader::take(const PacketScanner::Found& found) {
  const auto& packet = *found.packet;
  if (packet.stream->id != files_.front().first->stream->id) {
    note_damage({.offset = packet.offset, .reason = "a packet of another stream"});
    return false;
  }
  if (!is_new(packet)) {
    // Snapshots repeat what an earlier one had; within a file nothing repeats.
    if (last_sequence_file_ == file_) {
      note_damage({.offset = packet.offset,
                   .reason = "a packet that was there before, or out of order (number " +
                             std::to_string(packet.sequence->value) + ")"});
    }
    return false;
  }
  if (packet.other_uuid && !is_all_foreign()) {
    gap_.foreign =
        place_of({.offset = packet.offset,
                  .reason = "a packet whose uuid is not its metadata's was read with it"});
  }
  packet_ = packet;
  cpu_ = packet.cpu;
  packet_last_clock_ = found.last_clock;
  is_outside_ = found.is_outside;
  return true;
}

void StreamReader::note_position(std::uint64_t position) {
  if (identity_.progress == nullptr || position <= position_) return;
  identity_.progress->add(position - position_);
  position_ = position;
}

// Finds the next good packet and what is missing before it.
void StreamReader::load_packet() {
  packet_.reset();
  cpu_.reset();
  cursor_.reset();
  gap_ = {};
  noted_.clear();
  PacketScanner::Found found;
  while (file_ < files_.size() && !packet_) {
    const auto& current = files_[file_];
    if (!scanner_) {
      scanner_ = std::make_unique<PacketScanner>(current.file, current.trace->plan(), piece_,
                                                 identity_.window);
      window_.emplace(current.file, piece_, room_);
      trace_ = current.trace.get();
    }
    found = found_ahead_ ? *std::exchange(found_ahead_, std::nullopt)
                         : in_window([this] { return scanner_->next(&noted_); });
    if (found.damage) note_damage(*found.damage);
    if (!found.packet) {
      note_position(current.file.size());
      position_ = 0;
      scanner_.reset();
      ++file_;
    } else if (take(found)) {
      frame_.registers = scanner_->registers();
      cursor_.emplace(*window_, frame_);
    }
  }
  if (packet_) {
    ++packets_;
    note_position(packet_->offset);
    count_losses(found);
    if (!last_end_ && packet_->begin) stand_at(time_of(*packet_->begin));
    step_ = gap_.is_any() ? Step::gap : Step::packet_begin;
    if (step_ == Step::packet_begin && packet_->begin) stand_at(time_of(*packet_->begin));
  } else {
    step_ = gap_.is_any() ? Step::gap : Step::stream_end;
  }
}

// Packets that lie in the window whole need not be read a second time.
bool StreamReader::scan_ahead() {
  if (!packet_ || packet_->size <= piece_ || found_ahead_) return false;
  found_ahead_ = scanner_->next();
  Window unused(files_[file_].file, piece_);
  scanner_->exchange(unused);
  return true;
}

void StreamReader::count_losses(const PacketScanner::Found& found) {
  if (const auto& discarded = packet_->discarded) {
    // Tracers count from 0: what the first packet has was lost before or in it. LTTng may note a
    // packet's count after a later one's: then nothing new was lost.
    const auto last = last_discarded_.value_or(0);
    if (!last_discarded_ || !discarded->is_behind(last)) {
      if (const auto lost = discarded->since(last); lost > 0) {
        gap_.discarded_events = lost;
        // Between a packet that was flushed and the next one there may have been no free buffer.
        const bool follows_at_once = last_packet_ && packet_->begin <= last_packet_->end;
        const bool is_of_this_packet = last_packet_
                                           ? last_discarded_ && follows_at_once
                                           : packet_->sequence && packet_->sequence->value == 0;
        if (is_of_this_packet) {
          gap_.last_with_room = in_window([&] { return scanner_->last_clock_with_room(found); });
        }
      }
      last_discarded_ = discarded->value;
    }
  }
  if (const auto& sequence = packet_->sequence) {
    const bool is_behind = last_sequence_ && sequence->is_behind(*last_sequence_);
    const auto step = last_sequence_ && !is_behind ? sequence->since(*last_sequence_) : 1;
    // Packets that are damaged are missing as such.
    if (step > 1 && gap_.damages.empty()) gap_.discarded_packets = step - 1;
    last_sequence_ = sequence->value;
    last_sequence_file_ = file_;
  }
  last_packet_ = Bounds{.begin = packet_->begin, .end = packet_->end};
}

void StreamReader::emit_gap(EventWriter& writer) {
  std::optional<Timestamp> next_begin;
  std::optional<Timestamp> next_end;
  if (packet_ && packet_->begin) next_begin = time_of(*packet_->begin);
  if (packet_ && packet_->end) next_end = time_of(*packet_->end);
  const auto from = last_end_ ? last_end_ : last_time_;
  const auto here = from ? *from : next_begin.value_or(Timestamp{});
  for (const auto& damage : gap_.damages) {
    emit(writer, here,
         DamagedPacket{.reason = damage.reason,
                       .begin = from.value_or(kBoot),
                       .end = packet_ ? next_begin.value_or(here) : kLatest});
  }
  if (gap_.foreign) {
    emit(writer, here,
         DamagedPacket{.reason = *gap_.foreign,
                       .begin = next_begin.value_or(here),
                       .end = next_end.value_or(kLatest),
                       .has_foreign_metadata = true});
  }
  if (gap_.discarded_events) {
    std::optional<Timestamp> last_with_room;
    if (gap_.last_with_room) last_with_room = time_of(*gap_.last_with_room);
    emit(writer, here,
         Discarded{.begin = here,
                   .end = next_end.value_or(here),
                   .count = gap_.discarded_events,
                   .packets = false,
                   .last_with_room = last_with_room});
  }
  if (gap_.discarded_packets) {
    emit(writer, here,
         Discarded{.begin = here,
                   .end = next_begin.value_or(here),
                   .count = gap_.discarded_packets,
                   .packets = true});
  }
  gap_ = {};
}

void StreamReader::emit_packet_begin(EventWriter& writer) {
  if (!is_outside_) cursor_->begin(*packet_, clock_cycles_);
  if (has_packet_times_ && packet_->begin) {
    const auto time = time_of(*packet_->begin);
    pass(writer, time);
    const bool is_told = std::exchange(told_file_, file_) == file_;
    const std::string_view file = is_told ? "" : std::string_view(files_[file_].file.path());
    emit(writer, time, PacketBegin{.file = file});
  }
  if (is_outside_) {
    step_ = Step::packet_end;
    stand_at(time_of(*packet_->end));
  } else {
    find_event();
  }
}

bool StreamReader::is_on_time_line(const RunAhead& run) const noexcept {
  std::int64_t last = 0;
  return run.events.empty() ||
         (saturating_add(run.first_time().ns, identity_.merge_offset_ns) >= key_ &&
          !__builtin_add_overflow(run.to.ns, identity_.merge_offset_ns, &last));
}

std::optional<RunAhead> StreamReader::walk_ahead() {
  // Of its own, so that nothing that is written could change it.
  EventsAhead events({found_.data(), kAhead}, cursor_->next_event(), last_time_.value_or(kEarliest),
                     ahead_options());
  cursor_->walk_fixed([&events](const EventCursor::Fixed& event) { return events.take(event); });
  if (!events.is_any()) return std::nullopt;
  cursor_->prefetch();
  return events.run();
}

bool StreamReader::look_ahead() {
  ahead_ = {};
  if (!has_times_ || !(has_packet_times_ || has_begun_)) return false;
  const auto begin = cursor_->place();
  auto run = noted_.pass(*cursor_, *window_);
  if (!run) run = walk_ahead();
  if (!run) return false;
  if (!is_on_time_line(*run)) {
    cursor_->go_on_at(begin);
    return false;
  }
  ahead_ = *run;
  counted_ += run->others;
  last_time_ = run->last;
  return !run->events.empty();
}

Lane StreamReader::lane() const noexcept {
  if (ahead_.events.empty()) return {};
  return {ahead_, identity_.merge_offset_ns, *trace_, identity_.index, cpu_};
}

void StreamReader::finish_lane() noexcept {
  stand_at(ahead_.to);
  ahead_ = {};
}

void StreamReader::find_event() {
  if (look_ahead()) return;
  if (cursor_->next() == EventCursor::Step::event) {
    step_ = Step::event;
    if (has_times_) stand_at(time_of(cursor_->clock()));
    return;
  }
  // Damage here means that the file changed since the packet was examined.
  step_ = Step::packet_end;
  if (packet_->end) stand_at(time_of(*packet_->end));
}

void StreamReader::emit_event(EventWriter& writer) {
  const auto time = has_times_ ? time_of(cursor_->clock()) : Timestamp{};
  if (!cursor_->read_body(shown_)) {
    emit(writer, time, DamagedPacket{.reason = cursor_->reason(), .begin = time, .end = kLatest});
    step_ = Step::packet_end;
    return;
  }
  pass(writer, time);
  if (!has_packet_times_ && !has_begun_) emit(writer, time, PacketBegin{});
  has_begun_ = true;
  if (counts_others_ && cursor_->plan().is_other()) {
    ++counted_;
    find_event();
    return;
  }
  auto& event = writer.add();
  event.head.time = time;
  event.head.stream = identity_.index;
  event.head.cpu = cpu_;
  event.head.pid = cursor_->context(ContextSlot::pid);
  event.head.tid = cursor_->context(ContextSlot::tid);
  trace_->tell_apart(cursor_->context(ContextSlot::pid_ns), event.head);
  trace_->translate(cursor_->plan(), cursor_->payload(), shown_, event, writer.batch());
  find_event();
}

void StreamReader::emit_counted(EventWriter& writer, Timestamp time) {
  if (counted_ > 0) emit(writer, time, OtherEvent{.name = {}, .count = counted_});
  counted_ = 0;
}

void StreamReader::emit_packet_end(EventWriter& writer) {
  clock_cycles_ = is_outside_ ? *packet_->end : cursor_->clock();
  if (has_packet_times_ && packet_->begin && packet_->end) {
    // What a crash left behind has no end: its last event is.
    const bool is_open = *packet_->end < *packet_->begin;
    const auto time = time_of(is_open ? packet_last_clock_ : *packet_->end);
    emit_counted(writer, time);
    emit(writer, time, PacketEnd{});
    last_end_ = time;
    last_time_ = last_time_ ? std::max(*last_time_, time) : time;
  } else {
    emit_counted(writer, last_time_.value_or(Timestamp{}));
  }
  load_packet();
}

void StreamReader::step(EventWriter& writer) {
  switch (step_) {
    case Step::gap:
      emit_gap(writer);
      step_ = packet_ ? Step::packet_begin : Step::stream_end;
      if (packet_ && packet_->begin) stand_at(time_of(*packet_->begin));
      break;
    case Step::packet_begin:
      emit_packet_begin(writer);
      break;
    case Step::packet_end:
      emit_packet_end(writer);
      break;
    case Step::stream_end: {
      const auto time = last_time_.value_or(Timestamp{});
      if (!has_packet_times_ && has_begun_) emit(writer, time, PacketEnd{});
      emit(writer, time, StreamEnd{});
      step_ = Step::ended;
      break;
    }
    case Step::event:
      emit_event(writer);
      break;
    case Step::ended:
      break;
  }
}

}  // namespace cie::analysis::ctf
