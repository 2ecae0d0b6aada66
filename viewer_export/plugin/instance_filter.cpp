#include "instance_filter.hpp"

#include <cie/analysis/report.hpp>

#include <algorithm>
#include <deque>
#include <new>
#include <string_view>
#include <tuple>
#include <utility>

namespace cie::viewer_export {
namespace {

// Fields of the event, in their order. Times are of the host's clock, without its offset.
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
  kHost
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

void set_optional(bt_field* payload, Member member, const std::optional<std::int64_t>& value) {
  auto* option = bt_field_structure_borrow_member_field_by_index(payload, member);
  bt_field_option_set_has_field(option, value ? 1 : 0);
  if (value) bt_field_integer_signed_set_value(bt_field_option_borrow_field(option), *value);
}

}  // namespace

InstanceFilter::InstanceFilter(bt_self_message_iterator* self, bt_message_iterator* upstream)
    : self_(self), upstream_(upstream), analyzer_({}, this), feeder_(analyzer_) {}

bool InstanceFilter::InOrder::operator()(const Row& a, const Row& b) const {
  const auto key = [](const Row& row) {
    const auto& instance = row.instance;
    return std::tuple(instance.state == analysis::InstanceState::open, row.time, instance.start,
                      instance.process, instance.tid, instance.name, instance.seq);
  };
  return key(a) < key(b);
}

void InstanceFilter::on_instance(const analysis::Instance& instance) {
  Row row{.instance = KeptInstance::of(instance), .time = instance.end.value_or(instance.start).ns};
  row.instance.name = names_.number(instance.logical_id, instance.callback);
  rows_->add(row);
}

// How the hosts' clocks are related is known only now.
void InstanceFilter::finish() {
  feeder_.finish();
  finished_ = std::make_unique<const Finished>(analyzer_.finish());
  const auto& clock = finished_->clock;
  if (!clock.is_shifted()) return;
  auto moved = make_rows();
  rows_->drain([&](Row row) {
    row.time = clock.of(finished_->rows.process_of(row.instance).host_index, row.time);
    moved->add(row);
  });
  rows_ = std::move(moved);
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
  add("host", text());
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
  // Cycles are nanoseconds here, whatever the recording's clocks count.
  constexpr std::int64_t kSecond = 1'000'000'000;
  const auto offset = finished_->clock.realtime_offset().value_or(0);
  const auto below = offset % kSecond < 0 ? kSecond : 0;
  bt_clock_class_set_offset(clock.get(), offset / kSecond - (below == 0 ? 0 : 1),
                            static_cast<std::uint64_t>(offset % kSecond + below));
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
  if (status == BT_MESSAGE_ITERATOR_NEXT_STATUS_END) finish();
  if (status != BT_MESSAGE_ITERATOR_NEXT_STATUS_OK) return status;
  using MessageRef = Ref<const bt_message, bt_message_put_ref>;
  std::deque<MessageRef> batch;  // every message must be put, whatever happens to the others
  for (std::uint64_t i = 0; i < count; ++i)
    batch.emplace_back(messages[i]);
  for (const auto& message : batch)
    feeder_.consume(message.get());
  return status;
}

std::uint64_t InstanceFilter::next_time(const Row& row) {
  const auto time = static_cast<std::uint64_t>(std::max<std::int64_t>(row.time, 0));
  last_time_ = std::max(last_time_, time);  // open ones are told at the trace's end
  return last_time_;
}

const bt_message* InstanceFilter::make_event(const Row& row) {
  auto* message = checked(bt_message_event_create_with_packet_and_default_clock_snapshot(
      self_, event_class_.get(), packet_.get(), next_time(row)));
  const Ref<const bt_message, bt_message_put_ref> owner(message);
  auto* payload = bt_event_borrow_payload_field(bt_message_event_borrow_event(message));
  const auto instance = finished_->taken_back.corrected(row.instance);
  const auto& process = finished_->rows.process_of(instance);
  set_text(payload, kLogicalId, names_.name(instance.name));
  set_number(payload, kPid, process.pid);
  set_number(payload, kTid, instance.tid);
  set_number(payload, kSeq, static_cast<std::int64_t>(instance.seq));
  set_text(payload, kState, name_of(instance.state));
  set_number(payload, kStart, instance.start);
  set_optional(payload, kEnd, instance.number(KeptInstance::end));
  set_optional(payload, kRelease, instance.number(KeptInstance::release));
  set_text(payload, kReleaseSource, analysis::label(instance.release_source));
  set_optional(payload, kExecution, instance.number(KeptInstance::execution));
  set_optional(payload, kPreempted, instance.number(KeptInstance::preempted));
  set_optional(payload, kBlocked, instance.number(KeptInstance::blocked));
  set_text(payload, kHost, process.host);
  bt_message_get_ref(message);
  return message;
}

// All events are in one packet; a stream without any has none. nullptr: the stream has ended.
const bt_message* InstanceFilter::next_message() {
  switch (step_) {
    case Step::begin:
      make_stream();
      step_ = Step::before_packet;
      return checked(bt_message_stream_beginning_create(self_, stream_.get()));
    case Step::before_packet: {
      const auto* first = rows_->front();
      if (first == nullptr) return end_of_stream();
      step_ = Step::in_packet;
      return checked(bt_message_packet_beginning_create_with_default_clock_snapshot(
          self_, packet_.get(), next_time(*first)));
    }
    case Step::in_packet:
      if (const auto* row = rows_->front()) {
        const auto* event = make_event(*row);
        rows_->pop();
        return event;
      }
      step_ = Step::after_packet;
      return checked(bt_message_packet_end_create_with_default_clock_snapshot(self_, packet_.get(),
                                                                              last_time_));
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
  while (finished_ == nullptr) {
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
