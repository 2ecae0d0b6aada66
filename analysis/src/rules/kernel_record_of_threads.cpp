#include "kernel_record_of_threads.hpp"

#include <algorithm>

namespace cie::analysis {

KernelRecordOfThreads::KernelRecordOfThreads(const Model& model, const KernelHoles& holes,
                                             const ThreadLives& lives, const TimeWindow& judged)
    : model_(model), holes_(holes), lives_(lives), judged_(judged) {}

std::optional<Evidence> KernelRecordOfThreads::loss(ThreadIndex thread) const {
  const auto& life = lives_.of(thread);
  return holes_.between(host_of(thread), std::max(life.begin, judged_.from),
                        std::min(life.end, judged_.to));
}

std::optional<Evidence> KernelRecordOfThreads::outside(ThreadIndex thread, Timestamp begin) const {
  return holes_.outside(host_of(thread), std::max(begin, judged_.from),
                        std::min(lives_.of(thread).latest_end(), judged_.to));
}

std::optional<Evidence> KernelRecordOfThreads::untold_inheritance(ThreadIndex thread,
                                                                  Timestamp begin,
                                                                  Timestamp end) const {
  return holes_.untold_inheritance(host_of(thread), begin, end);
}

HostIndex KernelRecordOfThreads::host_of(ThreadIndex thread) const {
  return model_.processes[at(model_.threads[at(thread)].process)].host;
}

}  // namespace cie::analysis
