#include "ended_instances.hpp"

#include <cstddef>
#include <utility>

namespace cie::analysis {
namespace {

constexpr std::size_t kMaxWaiting = 100'000;

}  // namespace

bool EndedInstances::is_message_awaited(const PendingInstance& pending) const {
  if (pending.source_timestamp <= 0) return false;
  const auto publisher = registry_.publisher_by_gid(pending.host, pending.writer_gid);
  if (!publisher) return model_.hosts.size() > 1;  // the other host may announce it yet
  const auto process = model_.publishers[*publisher].process;
  return model_.processes[at(process)].host != pending.host && !chains_.is_published(*pending.node);
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

}  // namespace cie::analysis
