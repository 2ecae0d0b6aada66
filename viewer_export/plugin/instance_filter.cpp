#include "instance_filter.hpp"

#include <cie/analysis/report.hpp>

#include <algorithm>
#include <new>

namespace cie::viewer_export {
namespace {

// Fields of the event, in their order. Times are of the trace's clock, without its offset.
enum Member : std::uint64_t {
  kLogicalId,
  kPid,
  kTid,
  kSeq,
  kState,
  kStart,
  kEnd,
  kRelease,
  kReleaseSource,
  kExecution,
  kPreempted,
  kBlocked,
  kMembers
};

template <typename T>
T* checked(T* object) {
  if (object == nullptr) throw std::bad_alloc();
  return object;
}

const char* name_of(analysis::InstanceState state) noexcept {
  switch (state) {
    case analysis::InstanceState::complete:
      return "complete";
    case analysis::InstanceState::cut_by_window:
      return "cut_by_window";
    case analysis::InstanceState::open:
      return "open";
  }
  return "";
}

void set_text(bt_field* payload, Member member, std::string_view text) {
  auto* field = bt_field_structure_borrow_member_field_by_index(payload, member);
  bt_field_string_clear(field);  // events are used again
  if (bt_field_string_append_with_length(field, text.data(), text.size()) !=
      BT_FIELD_STRING_APPEND_STATUS_OK) {
    throw std::bad_alloc();
  }
}

void set_number(bt_field* payload, Member member, std::int64_t value) {
  bt_field_integer_signed_set_value(
      bt_field_structure_borrow_member_field_by_index(payload, member), value);
}

template <typename Value>
void set_optional(bt_field* payload, Member member, const std::optional<Value>& value) {
  auto* option = bt_field_structure_borrow_member_field_by_index(payload, member);
  bt_field_option_set_has_field(option, value ? 1 : 0);
  if (value) bt_field_integer_signed_set_value(bt_field_option_borrow_field(option), value->ns);
}

std::uint64_t cycles(std::int64_t time) {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(time, 0));
}

}  // namespace

InstanceFilter::InstanceFilter(bt_self_message_iterator* self, bt_message_iterator* upstream)
    : self_(self), upstream_(upstream), analyzer_({}, this), feeder_(analyzer_) {}

void InstanceFilter::on_instance(const analysis::Instance& instance) {
  const auto end = instance.end.value_or(instance.start).ns;
  last_time_ = std::max(last_time_, end);  // open ones are told at the trace's end
  rows_.push_back(Row{.instance = instance, .time = last_time_});
}

void InstanceFilter::note_clock(const bt_message* message) {
  if (clock_offset_s_ || bt_message_get_type(message) != BT_MESSAGE_TYPE_STREAM_BEGINNING) return;
  const auto* stream = bt_message_stream_beginning_borrow_stream_const(message);
  const auto* clock =
      bt_stream_class_borrow_default_clock_class_const(bt_stream_borrow_class_const(stream));
  if (clock == nullptr) return;
  std::int64_t seconds = 0;
  bt_clock_class_get_offset(clock, &seconds, &clock_offset_cycles_);
  clock_offset_s_ = seconds;
}

void InstanceFilter::make_payload(bt_trace_class* trace_class, bt_event_class* event_class) {
  using FieldClass = Ref<bt_field_class, bt_field_class_put_ref>;
  const FieldClass payload(checked(bt_field_class_structure_create(trace_class)));
  const auto add = [&payload](const char* name, FieldClass member) {
    if (bt_field_class_structure_append_member(payload.get(), name, checked(member.get())) !=
        BT_FIELD_CLASS_STRUCTURE_APPEND_MEMBER_STATUS_OK) {
      throw std::bad_alloc();
    }
  };
  const auto text = [trace_class] { return FieldClass(bt_field_class_string_create(trace_class)); };
  const auto number = [trace_class] {
    return FieldClass(bt_field_class_integer_signed_create(trace_class));
  };
  const auto option = [trace_class, &number] {
    const auto content = number();
    return FieldClass(bt_field_class_option_without_selector_create(trace_class, content.get()));
  };
  add("logical_id", text());
  add("pid", number());
  add("tid", number());
  add("seq", number());
  add("state", text());
  add("start_ns", number());
  add("end_ns", option());
  add("release_ns", option());
  add("release_source", text());
  add("execution_ns", option());
  add("preempted_ns", option());
  add("blocked_ns", option());
  if (bt_event_class_set_payload_field_class(event_class, payload.get()) !=
      BT_EVENT_CLASS_SET_FIELD_CLASS_STATUS_OK) {
    throw std::bad_alloc();
  }
}

void InstanceFilter::make_stream() {
  auto* component = bt_self_message_iterator_borrow_component(self_);
  const Ref<bt_trace_class, bt_trace_class_put_ref> trace_class(
      checked(bt_trace_class_create(component)));
  const Ref<bt_clock_class, bt_clock_class_put_ref> clock(
      checked(bt_clock_class_create(component)));
  bt_clock_class_set_offset(clock.get(), clock_offset_s_.value_or(0), clock_offset_cycles_);
  const Ref<bt_stream_class, bt_stream_class_put_ref> stream_class(
      checked(bt_stream_class_create(trace_class.get())));
  if (bt_stream_class_set_default_clock_class(stream_class.get(), clock.get()) !=
      BT_STREAM_CLASS_SET_DEFAULT_CLOCK_CLASS_STATUS_OK) {
    throw std::bad_alloc();
  }
  // src.ctf.fs of babeltrace2 2.1 aborts at packets without times.
  bt_stream_class_set_supports_packets(stream_class.get(), BT_TRUE, BT_TRUE, BT_TRUE);
  event_class_.reset(checked(bt_event_class_create(stream_class.get())));
  if (bt_event_class_set_name(event_class_.get(), "cie:instance") !=
      BT_EVENT_CLASS_SET_NAME_STATUS_OK) {
    throw std::bad_alloc();
  }
  make_payload(trace_class.get(), event_class_.get());
  const Ref<bt_trace, bt_trace_put_ref> trace(checked(bt_trace_create(trace_class.get())));
  stream_.reset(checked(bt_stream_create(stream_class.get(), trace.get())));
  packet_.reset(checked(bt_packet_create(stream_.get())));
}

bt_message_iterator_next_status InstanceFilter::pull() {
  bt_message_array_const messages = nullptr;
  std::uint64_t count = 0;
  const auto status = bt_message_iterator_next(upstream_.get(), &messages, &count);
  if (status == BT_MESSAGE_ITERATOR_NEXT_STATUS_END) {
    feeder_.finish();
    analyzer_.finish();
    is_complete_ = true;
  }
  if (status != BT_MESSAGE_ITERATOR_NEXT_STATUS_OK) return status;
  using MessageRef = Ref<const bt_message, bt_message_put_ref>;
  std::deque<MessageRef> batch;  // every message must be put, whatever happens to the others
  for (std::uint64_t i = 0; i < count; ++i)
    batch.emplace_back(messages[i]);
  for (const auto& message : batch) {
    note_clock(message.get());
    feeder_.consume(message.get());
  }
  return status;
}

const bt_message* InstanceFilter::make_event(const Row& row) {
  auto* message = checked(bt_message_event_create_with_packet_and_default_clock_snapshot(
      self_, event_class_.get(), packet_.get(), cycles(row.time)));
  const Ref<const bt_message, bt_message_put_ref> owner(message);
  auto* payload = bt_event_borrow_payload_field(bt_message_event_borrow_event(message));
  const auto& instance = row.instance;
  set_text(payload, kLogicalId, instance.logical_id);
  set_number(payload, kPid, instance.pid);
  set_number(payload, kTid, instance.tid);
  set_number(payload, kSeq, static_cast<std::int64_t>(instance.seq));
  set_text(payload, kState, name_of(instance.state));
  set_number(payload, kStart, instance.start.ns);
  set_optional(payload, kEnd, instance.end);
  set_optional(payload, kRelease, instance.release);
  set_text(payload, kReleaseSource, analysis::label(instance.release_source));
  set_optional(payload, kExecution, instance.execution);
  set_optional(payload, kPreempted, instance.preempted);
  set_optional(payload, kBlocked, instance.blocked);
  bt_message_get_ref(message);
  return message;
}

// All events are in one packet; a stream without any has none. nullptr: more must come in first, or
// the stream has ended.
const bt_message* InstanceFilter::next_message() {
  switch (step_) {
    case Step::begin:
      make_stream();
      step_ = Step::before_packet;
      return checked(bt_message_stream_beginning_create(self_, stream_.get()));
    case Step::before_packet:
      if (rows_.empty()) return is_complete_ ? end_of_stream() : nullptr;
      step_ = Step::in_packet;
      return checked(bt_message_packet_beginning_create_with_default_clock_snapshot(
          self_, packet_.get(), cycles(rows_.front().time)));
    case Step::in_packet:
      if (!rows_.empty()) {
        const auto* event = make_event(rows_.front());
        rows_.pop_front();
        return event;
      }
      if (!is_complete_) return nullptr;
      step_ = Step::after_packet;
      return checked(bt_message_packet_end_create_with_default_clock_snapshot(self_, packet_.get(),
                                                                              cycles(last_time_)));
    case Step::after_packet:
      return end_of_stream();
    case Step::ended:
      break;
  }
  return nullptr;
}

const bt_message* InstanceFilter::end_of_stream() {
  step_ = Step::ended;
  return checked(bt_message_stream_end_create(self_, stream_.get()));
}

bt_message_iterator_class_next_method_status InstanceFilter::next(bt_message_array_const messages,
                                                                  std::uint64_t capacity,
                                                                  std::uint64_t* count) {
  *count = 0;
  while (rows_.empty() && !is_complete_) {
    const auto status = pull();
    if (status != BT_MESSAGE_ITERATOR_NEXT_STATUS_OK &&
        status != BT_MESSAGE_ITERATOR_NEXT_STATUS_END) {
      return static_cast<bt_message_iterator_class_next_method_status>(status);
    }
  }
  if (step_ == Step::ended) return BT_MESSAGE_ITERATOR_CLASS_NEXT_METHOD_STATUS_END;
  while (*count < capacity) {
    const auto* message = next_message();
    if (message == nullptr) break;
    messages[(*count)++] = message;
  }
  return BT_MESSAGE_ITERATOR_CLASS_NEXT_METHOD_STATUS_OK;
}

}  // namespace cie::viewer_export
