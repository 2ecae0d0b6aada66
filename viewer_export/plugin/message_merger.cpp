#include "message_merger.hpp"

#include <algorithm>
#include <optional>

namespace cie::viewer_export {
namespace {

const bt_clock_snapshot* snapshot_of(const bt_message* message) {
  const bt_clock_snapshot* snapshot = nullptr;
  const auto has_clock = [](const bt_stream* stream) {
    return bt_stream_class_borrow_default_clock_class_const(bt_stream_borrow_class_const(stream)) !=
           nullptr;
  };
  switch (bt_message_get_type(message)) {
    case BT_MESSAGE_TYPE_EVENT: {
      const auto* event = bt_message_event_borrow_event_const(message);
      if (has_clock(bt_event_borrow_stream_const(event))) {
        snapshot = bt_message_event_borrow_default_clock_snapshot_const(message);
      }
      break;
    }
    case BT_MESSAGE_TYPE_PACKET_BEGINNING: {
      const auto* packet = bt_message_packet_beginning_borrow_packet_const(message);
      const auto* stream_class =
          bt_stream_borrow_class_const(bt_packet_borrow_stream_const(packet));
      if (bt_stream_class_packets_have_beginning_default_clock_snapshot(stream_class) != 0) {
        snapshot = bt_message_packet_beginning_borrow_default_clock_snapshot_const(message);
      }
      break;
    }
    case BT_MESSAGE_TYPE_PACKET_END: {
      const auto* packet = bt_message_packet_end_borrow_packet_const(message);
      const auto* stream_class =
          bt_stream_borrow_class_const(bt_packet_borrow_stream_const(packet));
      if (bt_stream_class_packets_have_end_default_clock_snapshot(stream_class) != 0) {
        snapshot = bt_message_packet_end_borrow_default_clock_snapshot_const(message);
      }
      break;
    }
    default:
      break;
  }
  return snapshot;
}

// Where a message stands among those of other inputs. Empty: at once, after the ones before it.
std::optional<std::int64_t> time_of(const bt_message* message) {
  const auto* snapshot = snapshot_of(message);
  std::int64_t time = 0;
  if (snapshot == nullptr || bt_clock_snapshot_get_ns_from_origin(snapshot, &time) !=
                                 BT_CLOCK_SNAPSHOT_GET_NS_FROM_ORIGIN_STATUS_OK) {
    return std::nullopt;
  }
  return time;
}

}  // namespace

void MessageMerger::add(bt_message_iterator* iterator) {
  Input input;
  input.iterator.reset(iterator);
  inputs_.push_back(std::move(input));
}

bt_message_iterator_next_status MessageMerger::fill(Input& input) {
  bt_message_array_const messages = nullptr;
  std::uint64_t count = 0;
  const auto status = bt_message_iterator_next(input.iterator.get(), &messages, &count);
  if (status == BT_MESSAGE_ITERATOR_NEXT_STATUS_END) input.has_ended = true;
  if (status != BT_MESSAGE_ITERATOR_NEXT_STATUS_OK) return status;
  for (std::uint64_t i = 0; i < count; ++i)
    input.ready.emplace_back(messages[i]);
  if (!input.ready.empty()) input.time = time_of(input.ready.front().get()).value_or(input.time);
  return status;
}

bt_message_iterator_next_status MessageMerger::next(
    const std::function<void(const bt_message*)>& take) {
  bool has_input = false;
  for (auto& input : inputs_) {
    if (input.ready.empty() && !input.has_ended) {
      const auto status = fill(input);
      if (status != BT_MESSAGE_ITERATOR_NEXT_STATUS_OK &&
          status != BT_MESSAGE_ITERATOR_NEXT_STATUS_END) {
        return status;
      }
    }
    has_input = has_input || !input.has_ended;
  }
  if (!has_input) return BT_MESSAGE_ITERATOR_NEXT_STATUS_END;
  // Until one input has nothing more to compare with.
  for (;;) {
    Input* first = nullptr;
    for (auto& input : inputs_) {
      if (input.has_ended) continue;
      if (input.ready.empty()) return BT_MESSAGE_ITERATOR_NEXT_STATUS_OK;
      if (first == nullptr || input.time < first->time) first = &input;
    }
    if (first == nullptr) return BT_MESSAGE_ITERATOR_NEXT_STATUS_OK;
    const auto message = std::move(first->ready.front());
    first->ready.pop_front();
    if (!first->ready.empty()) {
      first->time = time_of(first->ready.front().get()).value_or(first->time);
    }
    take(message.get());
  }
}

}  // namespace cie::viewer_export
