// Sorts more records than memory should hold: sorted runs go to disk and are merged at the end.
#pragma once

#include "spool.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace cie::viewer_export {

// Less must be a total order of what matters: records it calls equal may come in any order. Memory:
// records_in_memory records, and while merging kMergeBytes per run. Not thread-safe.
template <typename Record, typename Less>
class ExternalSorter {
  static_assert(std::is_trivially_copyable_v<Record>);

 public:
  ExternalSorter(std::size_t records_in_memory, std::filesystem::path directory)
      : capacity_(std::max<std::size_t>(records_in_memory, 1)), spool_(std::move(directory)) {}

  // Throws WriteError when the disk is full.
  void add(const Record& record) {
    records_.push_back(record);
    if (records_.size() >= capacity_) {
      spill();
    }
  }

  // Calls consume(record) in order, once for each record; the sorter is empty then.
  template <typename Consume>
  void drain(Consume consume) {
    for (const auto* record = front(); record != nullptr; record = front()) {
      consume(*record);
      pop();
    }
  }

  // The first record of those that are left, null if there is none: valid until pop(), which takes
  // it away. Nothing is added from the first call on until all are taken.
  const Record* front() {
    if (!is_read_) begin_reading();
    if (runs_.empty()) {
      if (next_ < records_.size()) return &records_[next_];
    } else if (!heap_.empty()) {
      return &heap_.front()->block[heap_.front()->next];
    }
    runs_.clear();
    records_.clear();
    is_read_ = false;
    return nullptr;
  }
  void pop() {
    if (runs_.empty()) {
      ++next_;
      return;
    }
    std::pop_heap(heap_.begin(), heap_.end(), is_later);
    Run& run = *heap_.back();
    if (++run.next < run.block.size() || load(run)) {
      std::push_heap(heap_.begin(), heap_.end(), is_later);
    } else {
      heap_.pop_back();
    }
  }

 private:
  static constexpr std::size_t kMergeBytes = 32768;

  struct Run {
    std::uint64_t offset = 0;  // of the next record on disk
    std::uint64_t end = 0;
    std::vector<Record> block;
    std::size_t next = 0;
  };

  void spill() {
    if (records_.empty()) {
      return;
    }
    std::sort(records_.begin(), records_.end(), Less{});
    const auto bytes = std::as_bytes(std::span(records_));
    Run run;
    run.offset = spool_.size();
    spool_.append({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    run.end = spool_.size();
    runs_.push_back(std::move(run));
    records_.clear();
  }

  // False at the end of the run.
  bool load(Run& run) {
    const auto left = static_cast<std::size_t>((run.end - run.offset) / sizeof(Record));
    run.block.resize(std::min(left, std::max<std::size_t>(kMergeBytes / sizeof(Record), 1)));
    run.next = 0;
    const auto bytes = std::as_writable_bytes(std::span(run.block));
    spool_.read(run.offset, {reinterpret_cast<char*>(bytes.data()), bytes.size()});
    run.offset += bytes.size();
    return !run.block.empty();
  }

  void begin_reading() {
    is_read_ = true;
    next_ = 0;
    if (runs_.empty()) {
      std::sort(records_.begin(), records_.end(), Less{});
      return;
    }
    spill();
    records_.shrink_to_fit();
    for (auto& run : runs_) {
      if (load(run)) heap_.push_back(&run);
    }
    std::make_heap(heap_.begin(), heap_.end(), is_later);
  }

  static bool is_later(const Run* a, const Run* b) {
    return Less{}(b->block[b->next], a->block[a->next]);
  }

  std::size_t capacity_;
  std::vector<Record> records_;
  Spool spool_;
  std::vector<Run> runs_;
  bool is_read_ = false;
  std::size_t next_ = 0;    // of records_, where all are in memory
  std::vector<Run*> heap_;  // those with records left, the earliest record first
};

}  // namespace cie::viewer_export
