#include "read_ahead.hpp"

#include "vocabulary/event_batch.hpp"

#include <array>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>

namespace cie::analysis::ctf {
namespace {

// To wake a thread of a virtual machine takes as long as several batches: whoever had to wait goes on
// when as many wait for the consumer, and the other one has as many to go on with.
constexpr std::size_t kBatches = 64;
constexpr std::size_t kEnough = kBatches / 4;  // the consumer
constexpr std::size_t kFew = kBatches / 4;     // the reader

struct Batch {
  EventBatch events{kEventsPerBatch};
  bool is_last = false;
};

// Thrown through the reader when nobody wants its events any more.
struct Abandoned {};

// Batches going round between the thread that fills them and the one that consumes them.
class Ring {
 public:
  // --- the reader's side: throws Abandoned.
  // Passes on the batch given last, and gives an empty one. `work` does a part of what there is to do
  // while all batches wait for the consumer; false: there is nothing.
  template <typename Work>
  EventBatch& exchange(const Work& work) {
    if (filling_ != nullptr) pass_on();
    while (is_full() && work()) {
    }
    begin_batch();
    return filling_->events;
  }
  // Nothing follows. What was not passed on yet is forgotten.
  void finish() {
    if (filling_ == nullptr) begin_batch();
    filling_->events.clear();
    filling_->is_last = true;
    pass_on();
  }

  // --- the consumer's side.
  const Batch& take() {
    std::unique_lock lock(mutex_);
    if (filled_ == 0) {
      changed_.wait(lock, [this] { return filled_ >= kEnough || is_finished_; });
    }
    return batches_[taken_ % kBatches];
  }
  // The batch taken last can be filled again.
  void give_back() {
    bool is_low = false;
    {
      const std::scoped_lock lock(mutex_);
      ++taken_;
      --filled_;
      is_low = filled_ == kFew;
    }
    if (is_low) changed_.notify_one();
  }
  void abandon() {
    {
      const std::scoped_lock lock(mutex_);
      is_abandoned_ = true;
    }
    changed_.notify_one();
  }

 private:
  bool is_full() {
    const std::scoped_lock lock(mutex_);
    return filled_ == kBatches;
  }
  void begin_batch() {
    std::unique_lock lock(mutex_);
    if (filled_ == kBatches) {
      changed_.wait(lock, [this] { return filled_ <= kFew || is_abandoned_; });
    }
    if (is_abandoned_) throw Abandoned{};
    filling_ = &batches_[(taken_ + filled_) % kBatches];
    filling_->events.clear();
  }
  void pass_on() {
    bool is_enough = false;
    {
      const std::scoped_lock lock(mutex_);
      ++filled_;
      is_finished_ = filling_->is_last;
      is_enough = filled_ == kEnough || is_finished_;
    }
    filling_ = nullptr;
    if (is_enough) changed_.notify_one();
  }

  std::array<Batch, kBatches> batches_;
  Batch* filling_ = nullptr;  // the reader's

  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::size_t taken_ = 0;     // batches given back
  std::size_t filled_ = 0;    // batches that wait for the consumer, or are with it
  bool is_finished_ = false;  // the last one was filled
  bool is_abandoned_ = false;
};

}  // namespace

void read_ahead(TraceReader& traces, const BatchSink& sink) {
  Ring ring;
  std::exception_ptr error;
  std::jthread reader([&] {
    try {
      try {
        const auto scan = [&traces] { return traces.scan_ahead(); };
        traces.read(ring.exchange(scan),
                    [&](EventBatch& /*filled*/) -> EventBatch& { return ring.exchange(scan); });
      } catch (const Abandoned&) {
        throw;
      } catch (...) {
        error = std::current_exception();
      }
      ring.finish();
    } catch (const Abandoned&) {  // the consumer has failed and waits for this thread's end
    }
  });
  try {
    for (bool is_last = false; !is_last;) {
      const auto& batch = ring.take();
      sink(batch.events);
      is_last = batch.is_last;
      ring.give_back();
    }
  } catch (...) {
    ring.abandon();
    throw;
  }
  reader.join();
  if (error) std::rethrow_exception(error);
}

}  // namespace cie::analysis::ctf
