#include "event_cursor.hpp"

#include "ctf/program/shown_fields.hpp"

#include <algorithm>

namespace cie::analysis::ctf {
namespace {

constexpr std::uint64_t kAlignBytes = 4096;  // no alignment is coarser
constexpr std::uint64_t kStepsPerByte = 64;
constexpr std::uint64_t kFreeSteps = 1'000'000;

}  // namespace

void EventCursor::begin(const Packet& packet, std::uint64_t clock) {
  packet_ = &packet;
  clock_ = packet.begin.value_or(clock);
  plan_ = nullptr;
  event_begin_ = packet.events_begin;
  frame_->order = packet.order;
  frame_->steps = kFreeSteps + packet.content_end / 8 * kStepsPerByte;
  base_ = 0;
  const auto content = (packet.content_end + 7) / 8;
  const auto available =
      window_->show(packet.offset, std::min<std::uint64_t>(content, window_->piece()));
  bits_ = {.data = window_->data(),
           .at = packet.events_begin,
           .end = std::min(available * 8, packet.content_end)};
}

// Shows what follows `at`, where a scope begins that the window cuts. False: the packet cuts it.
bool EventCursor::extend(std::uint64_t at) {
  const auto total = packet_->content_end - base_ * 8;
  bits_.at = at;
  if (bits_.end >= total || at >= total) return false;
  const auto skipped = at / 8 / kAlignBytes * kAlignBytes;
  const auto base = base_ + skipped;
  const auto rest = (packet_->content_end + 7) / 8 - base;
  const auto had = bits_.end - std::min(bits_.end, skipped * 8);
  const auto want = std::min(rest, std::max<std::uint64_t>(window_->piece(), had / 8 * 2));
  const auto available = window_->show(packet_->offset + base, want);
  base_ = base;
  bits_.data = window_->data();
  bits_.at = at - skipped * 8;
  bits_.end = std::min(available * 8, packet_->content_end - base * 8);
  return bits_.end > had;
}

Outcome EventCursor::run_here(const Sequence& program, Field* fields) {
  const auto order = frame_->order;
  const auto shown = frame_->shown != nullptr ? frame_->shown->size() : 0;
  for (;;) {
    const auto at = bits_.at;
    if (frame_->shown != nullptr) frame_->shown->take_back(shown);
    frame_->fields = fields;
    frame_->order = order;
    const auto outcome = run(program, bits_, *frame_);
    if (outcome != Outcome::cut || !extend(at)) return outcome;
  }
}

EventCursor::Step EventCursor::fail(const char* reason) {
  reason_ = reason;
  return Step::damaged;
}

bool EventCursor::is_good(Outcome outcome) {
  switch (outcome) {
    case Outcome::ok:
      return true;
    case Outcome::cut:
      reason_ = "an event reaches beyond the packet's content";
      return false;
    case Outcome::no_option:
      reason_ = "a variant's tag selects none of its options";
      return false;
    case Outcome::too_large:
      reason_ = "an integer of variable length has more than 64 bits";
      return false;
    case Outcome::mixed_order:
      reason_ = "the byte order changes within a byte";
      return false;
    case Outcome::too_complex:
      reason_ = "an event takes more steps than any honest one";
      return false;
  }
  return false;
}

std::string EventCursor::reason() const {
  std::string text = reason_;
  if (plan_ != nullptr) return text + " (event " + plan_->name.substr(0, 100) + ")";
  return unknown_id_ ? text + " (id " + std::to_string(*unknown_id_) + ")" : text;
}

bool EventCursor::read_fixed_header(const HeaderLayout& layout, std::uint64_t& id) {
  const bool is_usable = bits_.at % 8 == 0 && bits_.at < bits_.end &&
                         bits_.end - bits_.at >= (layout.most_bytes + FixedField::kSlack) * 8;
  if (!is_usable) return false;
  const auto* begin = bits_.data + bits_.at / 8;
  const auto tag = layout.tag.load_unsigned(begin);
  if (layout.tag_register >= 0) {
    frame_->registers[static_cast<std::size_t>(layout.tag_register)] = tag;
  }
  const auto header = layout.read(begin, clock_);
  if (!header) return false;
  id = header->id;
  clock_ = header->clock;
  bits_.at += header->bytes * 8;
  return true;
}

EventCursor::Step EventCursor::next() {
  plan_ = nullptr;
  unknown_id_.reset();
  event_begin_ = position();
  if (event_begin_ >= packet_->content_end) return Step::end;
  const auto& stream = *packet_->stream;
  std::uint64_t id = 0;
  if (!stream.header_layout || !read_fixed_header(*stream.header_layout, id)) {
    if (stream.event_header != nullptr) {
      header_ = {};
      if (!is_good(run_here(*stream.event_header, header_.data()))) return Step::damaged;
      if (stream.has_event_id) {
        id = static_cast<std::uint64_t>(header_[slot(EventHeaderSlot::id)].number);
      }
      const auto& time = header_[slot(EventHeaderSlot::time)];
      if (time.kind != Field::Kind::absent) {
        clock_ = extend_clock(clock_, static_cast<std::uint64_t>(time.number), time.length);
      }
    } else if (bits_.end <= bits_.at && !extend(bits_.at)) {
      return fail("the packet ends within its content");
    }
  }
  plan_ = stream.find(id);
  if (plan_ == nullptr) {
    unknown_id_ = id;
    return fail("an event's id is not in the metadata");
  }
  return plan_->is_malformed ? fail("its class in the metadata is malformed") : Step::event;
}

bool EventCursor::read_fields() {
  const auto* translation = plan_->translation;
  const auto count = translation != nullptr ? translation->fields.size() : 0;
  for (std::size_t i = 0; i < count; ++i)
    fields_[i] = {};
  auto name = context_[slot(ContextSlot::name)];
  const bool is_named = count > 0 && translation->has_thread_name && name.kind == Field::Kind::text;
  if (is_named) {  // what it views may move
    name.length = std::min(name.length, static_cast<std::uint32_t>(name_.size()));
    std::copy_n(name.characters, name.length, name_.data());
    name.characters = name_.data();
  }
  if (plan_->fields != nullptr && !is_good(run_here(*plan_->fields, fields_.data()))) return false;
  if (is_named) fields_[count - 1] = name;
  return true;
}

bool EventCursor::read_body(ShownFields& shown) {
  if (!plan_->is_shown) return read_body();
  shown.clear();
  frame_->shown = &shown;
  const bool is_good = read_body();
  frame_->shown = nullptr;
  return is_good;
}

bool EventCursor::read_body() {
  const auto& stream = *packet_->stream;
  for (auto& field : context_)
    field = {};
  const auto* common = plan_->is_shown ? stream.shown_context : stream.event_context;
  if (common != nullptr && !is_good(run_here(*common, context_.data()))) return false;
  if (plan_->context != nullptr) {
    std::array<Field, kContextSlots> own{};
    if (!is_good(run_here(*plan_->context, own.data()))) return false;
    if (plan_->has_own_pid) context_[slot(ContextSlot::pid)] = own[slot(ContextSlot::pid)];
    if (plan_->has_own_tid) context_[slot(ContextSlot::tid)] = own[slot(ContextSlot::tid)];
  }
  if (frame_->shown != nullptr) frame_->shown->end_context();
  if (!read_fields()) return false;
  if (position() == event_begin_) {
    reason_ = "events have no size";
    return false;
  }
  return true;
}

}  // namespace cie::analysis::ctf
