// What one filter.cie.instances iterator holds: analyses what comes in, and gives out an event
// "cie:instance" for every instance of a callback, in order of their ends. What is told of one may be
// taken back until all is read, so none is given out before.
#pragma once

#include <cie/analysis/analyzer.hpp>
#include <cie/analysis/instance.hpp>
#include <cie/analysis/message_feeder.hpp>
#include <cie/analysis/report_rows.hpp>

#include "output/external_sorter.hpp"
#include "output/kept_instance.hpp"
#include "output/name_table.hpp"
#include "timelines/common_clock.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <utility>

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
    KeptInstance instance;
    std::int64_t time = 0;  // of its end; of its start while it is open
  };
  // By ends; then what never ended.
  struct InOrder {
    bool operator()(const Row& a, const Row& b) const;
  };
  using Rows = ExternalSorter<Row, InOrder>;
  static std::unique_ptr<Rows> make_rows() {
    constexpr std::size_t kInMemory = 65'536;
    return std::make_unique<Rows>(kInMemory, std::filesystem::path{});
  }
  // What the report adds to the rows.
  struct Finished {
    explicit Finished(analysis::AnalysisResult all)
        : result(std::move(all)),
          rows(result.report),
          taken_back(result.report),
          clock(result.report) {}
    Finished(const Finished&) = delete;
    Finished& operator=(const Finished&) = delete;

    analysis::AnalysisResult result;
    analysis::ReportRows rows;
    TakenBackReleases taken_back;
    CommonClock clock;
  };

  void on_instance(const analysis::Instance& instance) override;
  bt_message_iterator_next_status pull();
  // Nothing more comes in.
  void finish();
  void make_stream();
  void make_payload(bt_trace_class* trace_class, bt_event_class* event_class);
  // Of an event, in order: none is before the one that was given out last.
  std::uint64_t next_time(const Row& row);
  const bt_message* make_event(const Row& row);
  const bt_message* next_message();
  const bt_message* end_of_stream();

  enum class Step : std::uint8_t { begin, before_packet, in_packet, after_packet, ended };

  bt_self_message_iterator* self_;
  std::unique_ptr<bt_message_iterator, PutIterator> upstream_;
  analysis::Analyzer analyzer_;
  analysis::MessageFeeder feeder_;
  NameTable names_;
  std::unique_ptr<Rows> rows_ = make_rows();
  std::unique_ptr<const Finished> finished_;  // null: more may come in
  std::uint64_t last_time_ = 0;
  Step step_ = Step::begin;

  Ref<bt_event_class, bt_event_class_put_ref> event_class_;
  Ref<bt_stream, bt_stream_put_ref> stream_;
  Ref<bt_packet, bt_packet_put_ref> packet_;
};

}  // namespace cie::viewer_export
