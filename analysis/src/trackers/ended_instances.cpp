#include "ended_instances.hpp"

#include "model/host_clocks.hpp"

#include <cstddef>
#include <new>
#include <utility>

namespace cie::analysis {
namespace {

constexpr std::size_t kMaxWaiting = 100'000;
constexpr std::size_t kMaxSpare = 1024;
// State is announced within one second of a session's start; three are ample.
constexpr Duration kSettleTime{3'000'000'000};

}  // namespace

std::unique_ptr<LiveInstance> EndedInstances::new_instance() {
  if (spare_.empty()) return std::make_unique<LiveInstance>();
  auto live = std::move(spare_.back());
  spare_.pop_back();
  // Cheaper than assigning LiveInstance{}: what is optional and absent is not written, as it would
  // be by std::construct_at() as well.
  std::destroy_at(live.get());
  ::new (static_cast<void*>(live.get())) LiveInstance;
  return live;
}

void EndedInstances::add(std::unique_ptr<LiveInstance> live) {
  // Without the way through the queue if nothing is to be waited for.
  if (waiting_.empty() && is_settled(*live, live->end->time, live->host)) {
    measure(std::move(live));
  } else {
    waiting_.push_back(std::move(live));
  }
}

void EndedInstances::measure(std::unique_ptr<LiveInstance> live) {
  measurer_.measure(*live);
  live->node.reset();
  if (spare_.size() < kMaxSpare) spare_.push_back(std::move(live));
}

void EndedInstances::measure_first() {
  measure(std::move(waiting_.front()));
  waiting_.pop_front();
}

void EndedInstances::measure_settled(const EventHead& head) {
  const auto here = registry_.host_of(head);
  while (!waiting_.empty() &&
         (is_settled(*waiting_.front(), head.time, here) || waiting_.size() > kMaxWaiting)) {
    measure_first();
  }
}

void EndedInstances::measure_all() {
  while (!waiting_.empty())
    measure_first();
}

inline bool EndedInstances::is_settled(const LiveInstance& live, Timestamp now,
                                       HostIndex there) const {
  const auto shift = there == live.host
                         ? Duration{}
                         : clock_shift(model_.hosts[at(there)], model_.hosts[at(live.host)]);
  if (now + shift - live.end->time > kSettleTime) return true;
  // Nothing of the kernel came yet: its first switch tells what ran until then.
  const bool is_kernel_silent =
      recording_.has_kernel(live.host) && !model_.hosts[at(live.host)].has_switches;
  if (is_kernel_silent) return false;
  return is_announced(live) && timeline_.is_confirmed(live.host, live.end->time);
}

inline bool EndedInstances::is_announced(const LiveInstance& live) const {
  const auto& callback = *live.callback_facts;
  if (!callback.registered) return false;
  if (live.thread_facts == nullptr || live.thread_facts->announced) return true;
  // Nobody announces threads of what follows from other events, unless the process has own ones.
  // A message may be taken before its publication is put together, with which the publisher comes.
  return !callback.is_accounted && !model_.processes[at(callback.process)].run_begin &&
         (live.writer_gid == 0 || live.written ||
          (live.source_timestamp < 0
               ? chains_.is_published(*live.node)
               : registry_.publisher_by_gid(live.host, live.writer_gid).has_value()));
}

}  // namespace cie::analysis
