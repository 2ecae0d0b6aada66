// What the kernel's record lacks of the lives of threads.
#pragma once

#include <cie/analysis/time.hpp>
#include <cie/analysis/verdict.hpp>

#include "kernel_holes.hpp"
#include "model/facts.hpp"
#include "thread_lives.hpp"

#include <optional>

namespace cie::analysis {

class KernelRecordOfThreads {
 public:
  // `judged`: the part of the recording that was asked for. The others are borrowed.
  KernelRecordOfThreads(const Model& model, const KernelHoles& holes, const ThreadLives& lives,
                        const TimeWindow& judged);

  // Kernel events were lost, or never recorded of some CPU, while the thread lived and is judged.
  // What is no evidence loses nothing.
  std::optional<Evidence> loss(ThreadIndex thread) const;
  // The kernel's record leaves out something of the time from then on to the end of the thread, as
  // far as that is judged.
  std::optional<Evidence> outside(ThreadIndex thread, Timestamp begin) const;
  // On the thread's machine nothing tells of priority inheritance at some time between the two.
  std::optional<Evidence> untold_inheritance(ThreadIndex thread, Timestamp begin,
                                             Timestamp end) const;

 private:
  HostIndex host_of(ThreadIndex thread) const;

  const Model& model_;
  const KernelHoles& holes_;
  const ThreadLives& lives_;
  const TimeWindow judged_;
};

}  // namespace cie::analysis
