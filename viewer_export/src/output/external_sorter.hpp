// Sorts more records than memory should hold: sorted runs go to disk and are merged at the end.
#pragma once

#include "record_codec.hpp"
#include "spool.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <future>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace cie::viewer_export {

// Less must be a total order of what matters: records it calls equal may come in any order. Memory:
// records_in_memory records, and while merging 32 KiB per run. A run is sorted and written by a
// thread of its own while the next one is collected. To be used by one thread.
template <typename Record, typename Less>
class ExternalSorter {
  static_assert(std::is_trivially_copyable_v<Record>);

 public:
  ExternalSorter(std::size_t records_in_memory, std::filesystem::path directory, Less less = {})
      : less_(less),
        capacity_(std::max<std::size_t>(records_in_memory / 2, 1)),
        spool_(std::move(directory)) {}
  ExternalSorter(const ExternalSorter&) = delete;
  ExternalSorter& operator=(const ExternalSorter&) = delete;

  // Records that were added and not drained.
  std::uint64_t size() const noexcept { return size_; }

  // Throws WriteError when the disk is full, sooner or later.
  void add(const Record& record) {
    records_.push_back(record);
    ++size_;
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
    } else if (current_ != nullptr) {
      return &current_->record;
    }
    runs_.clear();
    records_.clear();
    size_ = 0;
    is_read_ = false;
    return nullptr;
  }
  void pop() {
    if (runs_.empty()) {
      ++next_;
      return;
    }
    Run& run = *current_;
    // What arrived in about the right order comes from one run for a long time.
    if (load(run) && (heap_.empty() || !later()(&run, heap_.front()))) return;
    if (run.has_record) {
      heap_.push_back(&run);
      std::push_heap(heap_.begin(), heap_.end(), later());
    } else {
      run.block = {};
    }
    take_first();
  }

 private:
  using Codec = RecordCodec<Record>;
  static constexpr std::size_t kMergeBytes = std::max<std::size_t>(32768, 2 * Codec::kMostBytes);

  static constexpr std::size_t kPiece = 1U << 18U;  // bytes to write at a time

  // A sorted sequence on disk, encoded.
  struct Run {
    std::uint64_t offset = 0;  // of what is not in `block`
    std::uint64_t end = 0;
    std::uint64_t records = 0;  // that were not decoded
    std::vector<char> block{};
    std::size_t next = 0;  // in it
    Codec codec{};
    Record record{};  // the first that is left
    bool has_record = false;
  };

  void sort(std::vector<Record>& records) const {
    std::sort(records.begin(), records.end(), less_);
  }

  // Has another thread write what was added.
  void spill() {
    end_spill();
    if (records_.empty()) return;
    spilled_.clear();
    std::swap(records_, spilled_);
    // Where there can be no thread, end_spill() does the work.
    spill_ =
        std::async(std::launch::async | std::launch::deferred, [this] { write_run(spilled_); });
  }
  // Waits for it.
  void end_spill() {
    if (spill_.valid()) spill_.get();
  }

  void write_run(std::vector<Record>& records) {
    sort(records);
    Codec codec;
    Run run;
    run.offset = spool_.size();
    encoded_.resize(kPiece + Codec::kMostBytes);
    std::size_t size = 0;
    for (const auto& record : records) {
      size =
          static_cast<std::size_t>(codec.encode(record, encoded_.data() + size) - encoded_.data());
      if (size >= kPiece) spool_.append({encoded_.data(), std::exchange(size, 0)});
    }
    spool_.append({encoded_.data(), size});
    run.end = spool_.size();
    run.records = records.size();
    runs_.push_back(std::move(run));
  }

  // Decodes the next record; false at the end of the run.
  bool load(Run& run) {
    run.has_record = run.records > 0;
    if (!run.has_record) return false;
    if (run.block.size() - run.next < Codec::kMostBytes && run.offset < run.end) refill(run);
    const char* const at = run.block.data() + run.next;
    run.next += static_cast<std::size_t>(run.codec.decode(at, run.record) - at);
    --run.records;
    return true;
  }

  void refill(Run& run) {
    run.block.erase(run.block.begin(), run.block.begin() + static_cast<std::ptrdiff_t>(run.next));
    run.next = 0;
    const auto kept = run.block.size();
    const auto more = std::min<std::uint64_t>(run.end - run.offset, kMergeBytes - kept);
    run.block.resize(kept + more);
    spool_.read(run.offset, std::span(run.block).subspan(kept));
    run.offset += more;
  }

  void begin_reading() {
    is_read_ = true;
    next_ = 0;
    end_spill();
    if (runs_.empty()) {
      sort(records_);
      return;
    }
    spill();
    end_spill();
    records_ = {};
    spilled_ = {};
    encoded_ = {};
    for (auto& run : runs_) {
      if (load(run)) heap_.push_back(&run);
    }
    std::make_heap(heap_.begin(), heap_.end(), later());
    take_first();
  }

  // The run that has the first record of all, null if none has any.
  void take_first() {
    current_ = nullptr;
    if (heap_.empty()) return;
    std::pop_heap(heap_.begin(), heap_.end(), later());
    current_ = heap_.back();
    heap_.pop_back();
  }

  // Of runs, by the first record that each has left.
  auto later() const {
    return [this](const Run* a, const Run* b) { return less_(b->record, a->record); };
  }

  [[no_unique_address]] Less less_;
  std::size_t capacity_;  // of a run
  std::uint64_t size_ = 0;
  std::vector<Record> records_;
  std::vector<char> encoded_;  // a piece of a run on its way to the disk
  Spool spool_;
  std::vector<Run> runs_;
  bool is_read_ = false;
  std::size_t next_ = 0;    // of records_, where all are in memory
  Run* current_ = nullptr;  // has the first record of all
  std::vector<Run*> heap_;  // the others with records left, the earliest record first
  // Until the spill has ended, encoded_, spool_ and runs_ are its own too.
  std::vector<Record> spilled_;
  std::future<void> spill_;  // last: it uses the rest, and waits
};

}  // namespace cie::viewer_export
