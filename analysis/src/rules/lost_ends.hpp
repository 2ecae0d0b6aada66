// Threads whose end was not recorded, though it was told or may have been lost.
#pragma once

#include <cie/analysis/verdict.hpp>

#include "kernel_holes.hpp"
#include "model/facts.hpp"
#include "thread_lives.hpp"
#include "user_losses_of_processes.hpp"

#include <cstdint>
#include <optional>
#include <vector>

namespace cie::analysis {

class LostEnds {
 public:
  LostEnds(const Model& model, const ThreadLives& lives, const KernelHoles& holes,
           const UserLossesOfProcesses& user_losses);
  // In a process that ended in order every thread tells its end, unless it was replaced: why what ran
  // on this one may have run after it had ended, or on another one with its tid. Of a thread that was
  // not announced the same, where an announcement is missing.
  std::optional<Evidence> of(ThreadIndex thread) const;
  // Why the callbacks of a thread may be those of several with its tid, one after the other: the next
  // callback came when the last one was done for good, and in between the end of one thread and the
  // announcement of another may be missing. Empty: they are of one.
  std::optional<Evidence> between_callbacks(ThreadIndex thread) const;
  // Why what a thread that ROS 2's events alone tell of ran after that time may have run on another one
  // with its tid: no callback that it had run before ran there any more.
  std::optional<Evidence> since(ThreadIndex thread, Timestamp last) const;
  // The same between two of its signs. Where no totals tell what is missing, the tracer tells where
  // it lost any.
  std::optional<Evidence> between(ThreadIndex thread, Timestamp last, Timestamp next) const;

 private:
  // Of a process that tells of no threads all but the main one may end unseen.
  std::optional<Evidence> untold_between(ThreadIndex thread, Timestamp last, Timestamp next) const;

  const Model& model_;
  const ThreadLives& lives_;
  const KernelHoles& holes_;
  const UserLossesOfProcesses& user_losses_;
  std::vector<std::uint64_t> announced_;    // threads, by process
  std::vector<Timestamp> last_activities_;  // by callback, on whatever thread
};

}  // namespace cie::analysis
