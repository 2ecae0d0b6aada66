// What happens to a sample on the thread that delivers it: the receive thread, or the publisher's.
#pragma once

#include <cie/scheduling/callback.hpp>
#include <cie/scheduling/wakeup.hpp>
#include <cie/tracepoints/priority_mutex.hpp>
#include <cie/tracepoints/trace.hpp>

#include "scheduling/arrival_log.hpp"
#include "scheduling/queue_count.hpp"
#include "scheduling_names.hpp"

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

struct dds_rhc;
struct ddsi_serdata;

namespace cie::executor {

// The delivering side of one reader, shared by the reader and its sample cache. Samples are
// delivered one at a time, under a mutex that a callback's thread does not take on its hot path.
class Delivery {
 public:
  Delivery(std::uint32_t log_depth, std::uint32_t queue_depth)
      : arrivals_(log_depth), count_(queue_depth) {}

  // Who is told. Null ends it; no call into `sink` is running when this returns.
  void set_target(ReadySink* sink, Callback* callback);
  // Who is woken, beside or instead of a target; null ends it.
  void set_wakeup(Wakeup* wakeup);
  // Whose events are emitted, also those of samples that are there already; null before the callback
  // goes.
  void set_trace(trace::Callback* callback);

  // Samples whose service header names somebody else are dropped, unseen. Before the reader exists.
  void accept_only(std::uint64_t recipient) noexcept { recipient_ = recipient; }
  std::optional<std::uint64_t> recipient() const noexcept { return recipient_; }
  // Told how many more were lost. Before the reader exists.
  void on_lost(std::function<void(std::uint32_t)> tell) { tell_lost_ = std::move(tell); }
  // Called once, when a sample was taken that cannot be read. Before the reader exists.
  void on_unreadable(std::function<void()> tell) { tell_unreadable_ = std::move(tell); }
  // Has the target and the wake-up's thread look again, although nothing arrived.
  void wake() noexcept;

  // From now on samples are dropped, unseen: the queue can be emptied and counted.
  void close();

  // `store` puts the sample into the queue and says whether it stayed there.
  template <typename Store>
  bool deliver(const void* sample, const Arrival& arrival, Store store) noexcept {
    const std::lock_guard lock{mutex_};
    if (is_closed_) return true;  // false would make a reliable writer offer it again
    arrivals_.record(sample, arrival);
    const bool is_stored = store();
    if (is_stored) announce();
    return is_stored;
  }
  // Samples that DDS lost or rejected before they reached the queue.
  void lost(std::uint32_t count) noexcept;
  // One was taken that cannot be read: it is lost.
  void unreadable() noexcept;

  const ArrivalLog& arrivals() const noexcept { return arrivals_; }
  QueueCount& count() noexcept { return count_; }

 private:
  void announce() noexcept;

  PriorityMutex mutex_;
  ArrivalLog arrivals_;
  QueueCount count_;
  ReadySink* sink_ = nullptr;
  Callback* callback_ = nullptr;
  Wakeup* wakeup_ = nullptr;
  trace::Callback* trace_ = nullptr;
  std::uint64_t untold_releases_ = 0;  // a reader may have samples before its callback is there
  std::uint32_t untold_losses_ = 0;
  bool is_closed_ = false;
  std::optional<std::uint64_t> recipient_;
  std::function<void(std::uint32_t)> tell_lost_;
  std::function<void()> tell_unreadable_;
  std::atomic_flag is_unreadable_told_;
};

// A sample cache for dds_create_reader_rhc() that passes every sample through `delivery` and leaves
// all else to Cyclone's own cache, which it makes when the reader is associated. This is where the
// arrival of the very sample is known: not in the listener (it does not say which sample it is
// called for), and not on the wire. It uses interfaces of Cyclone DDS 0.10 that are exported but
// not promised; the build asks for that version.
::dds_rhc* make_recording_cache(std::shared_ptr<Delivery> delivery);

// 64 bits of a writer's 16-byte GUID, the same in every process; never 0.
std::uint64_t writer_gid(const unsigned char (&guid)[16]) noexcept;

}  // namespace cie::executor
