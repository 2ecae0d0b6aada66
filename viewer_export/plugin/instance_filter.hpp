// What one filter.cie.instances iterator holds: analyses what comes in, and gives out an event
// "cie:instance" for every instance of a callback, in order of their ends.
#pragma once

#include <cie/analysis/analyzer.hpp>
#include <cie/analysis/instance.hpp>
#include <cie/analysis/message_feeder.hpp>

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>

#include <babeltrace2/babeltrace.h>

namespace cie::viewer_export {

class InstanceFilter final : private analysis::Observer {
 public:
  // `self` is borrowed. Takes over the reference of `upstream`.
  InstanceFilter(bt_self_message_iterator* self, bt_message_iterator* upstream);
  InstanceFilter(const InstanceFilter&) = delete;
  InstanceFilter& operator=(const InstanceFilter&) = delete;

  // What babeltrace2 asks of an iterator. Throws std::bad_alloc.
  bt_message_iterator_class_next_method_status next(bt_message_array_const messages,
                                                    std::uint64_t capacity, std::uint64_t* count);

 private:
  template <typename T, void (*Put)(const T*)>
  struct PutRef {
    void operator()(const T* object) const noexcept { Put(object); }
  };
  template <typename T, void (*Put)(const T*)>
  using Ref = std::unique_ptr<T, PutRef<T, Put>>;
  struct PutIterator {
    void operator()(bt_message_iterator* iterator) const noexcept {
      bt_message_iterator_put_ref(iterator);
    }
  };
  struct Row {
    analysis::Instance instance;  // views of names live as long as the analyzer
    std::int64_t time = 0;        // of the event: the instance's end, or the trace's
  };

  void on_instance(const analysis::Instance& instance) override;
  void note_clock(const bt_message* message);
  void make_stream();
  void make_payload(bt_trace_class* trace_class, bt_event_class* event_class);
  bt_message_iterator_next_status pull();
  const bt_message* make_event(const Row& row);
  const bt_message* next_message();
  const bt_message* end_of_stream();

  enum class Step : std::uint8_t { begin, before_packet, in_packet, after_packet, ended };

  bt_self_message_iterator* self_;
  std::unique_ptr<bt_message_iterator, PutIterator> upstream_;
  analysis::Analyzer analyzer_;
  analysis::MessageFeeder feeder_;
  std::deque<Row> rows_;
  std::int64_t last_time_ = 0;
  bool is_complete_ = false;  // nothing more comes in
  Step step_ = Step::begin;

  std::optional<std::int64_t> clock_offset_s_;  // of the first stream that has a clock
  std::uint64_t clock_offset_cycles_ = 0;
  Ref<bt_event_class, bt_event_class_put_ref> event_class_;
  Ref<bt_stream, bt_stream_put_ref> stream_;
  Ref<bt_packet, bt_packet_put_ref> packet_;
};

}  // namespace cie::viewer_export
