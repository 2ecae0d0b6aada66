// Where a reader writes its events: into one batch after the other.
#pragma once

#include "vocabulary/event_batch.hpp"

#include <cstddef>
#include <functional>
#include <utility>

namespace cie::analysis::ctf {

// Small enough that several batches stay in the cache that both cores share.
inline constexpr std::size_t kEventsPerBatch = 256;

class EventWriter {
 public:
  // Passes on what a batch holds, and gives an empty one.
  using Exchange = std::function<EventBatch&(EventBatch& filled)>;
  // `first` is empty.
  EventWriter(EventBatch& first, Exchange exchange)
      : exchange_(std::move(exchange)), batch_(&first) {}

  // An event to be filled, which holds what another one left.
  Event& add() {
    if (batch_->is_full()) flush();
    return batch_->add();
  }
  // Once the event added last is complete: what it viewed may vanish.
  void keep(Event& event) { batch_->keep(event); }
  void flush() { batch_ = &exchange_(*batch_); }
  EventBatch& batch() noexcept { return *batch_; }

 private:
  Exchange exchange_;
  EventBatch* batch_;
};

}  // namespace cie::analysis::ctf
