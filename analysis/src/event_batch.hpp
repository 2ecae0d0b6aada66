// Events that outlive the buffers they were read from.
#pragma once

#include <cie/analysis/event.hpp>

#include <cstddef>
#include <memory_resource>
#include <span>
#include <vector>

namespace cie::analysis {

// Keeps a bounded number of events with copies of what they view. Used again after clear(), so that
// it allocates little after its first round.
class EventBatch {
 public:
  explicit EventBatch(std::size_t capacity);
  EventBatch(const EventBatch&) = delete;
  EventBatch& operator=(const EventBatch&) = delete;

  bool is_full() const noexcept { return size_ == events_.size(); }
  // Requires that it is not full.
  void add(const Event& event);
  void clear() noexcept;
  // Valid until the next clear().
  std::span<const Event> events() const noexcept { return {events_.data(), size_}; }

 private:
  std::vector<Event> events_;
  std::size_t size_ = 0;
  std::pmr::monotonic_buffer_resource memory_;  // what the events view
};

}  // namespace cie::analysis
