// What the trace proves about itself: which subjects lost nothing, judged by contiguous numbers and
// by the totals that the executor leaves behind (laws L2 and L5).
#pragma once

#include <cie/analysis/verdict.hpp>

#include "model/facts.hpp"
#include "model/recorded_parts.hpp"
#include "thread_lives.hpp"
#include "user_losses_of_processes.hpp"

#include <concepts>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace cie::analysis {

class Proof {
 public:
  // All are borrowed.
  Proof(const Model& model, const ThreadLives& lives, const UserLossesOfProcesses& user_losses);

  // A process without `run_end`: it crashed, or the recording stopped first.
  bool is_interrupted(ProcessIndex process) const;
  // What is missing or disagrees in the process's totals, besides the missing `run_end` itself.
  const std::vector<Evidence>& disagreements(ProcessIndex process) const;
  // Every total agrees with what was seen: what is absent from the trace never happened.
  bool is_complete(ProcessIndex process) const;
  // Why that is not so; empty if it is.
  std::optional<Evidence> incompleteness(ProcessIndex process) const;
  // How many totals of a process could be compared.
  std::uint64_t totals_compared(ProcessIndex process) const;

  // Why not every instance of the callback is known to have been seen from start to end; empty if all
  // were.
  const std::optional<Evidence>& loss(CallbackIndex callback) const;
  // The same but for ends that nothing tells because an exception was thrown: they hide no instance.
  const std::optional<Evidence>& lost_runs(CallbackIndex callback) const;
  // Of an instance that is over though it has no event of its end.
  const std::optional<Evidence>& unseen_end(CallbackIndex callback) const;
  // Why not every message of the publisher is known to have been seen; empty if all were.
  std::optional<Evidence> loss(const PublisherFacts& publisher) const;
  // The same for numbers alone (T3), of starts and of ends.
  std::optional<Evidence> gap(const CallbackFacts& callback) const;
  std::optional<Evidence> gap(const PublisherFacts& publisher) const;
  std::optional<Evidence> gap(const ThreadFacts& thread) const;
  // Why not every read-back of the thread is known to have been seen.
  const std::optional<Evidence>& loss(ThreadIndex thread) const;
  // The same but for those of a spin that nobody saw.
  const std::optional<Evidence>& lost_read_backs(ThreadIndex thread) const;

  // Callbacks that `run_end` counts and no event names: they may have run anywhere. Where nothing
  // counts them, a loss that may have taken one with all of its runs.
  std::optional<Evidence> unseen_callbacks(ProcessIndex process) const;

  // `run_end` counts no more than were seen.
  bool are_all_callbacks_seen(ProcessIndex process) const;
  // It counts more.
  std::optional<Evidence> counted_callbacks_unseen(ProcessIndex process) const;

  // The same of threads whose announcement is missing. A process of ROS 2 alone announces none.
  std::optional<Evidence> unseen_threads(ProcessIndex process) const;
  // Why announcements of the process may be missing that no number and no total counts: of a callback
  // that is registered again, of a spec. A stream of which no file is there tells no loss.
  std::optional<Evidence> unseen_announcement(ProcessIndex process) const;
  // Announcements of threads of which something shows that they were emitted, and none of which is counted as seen.
  std::optional<Evidence> unaccounted_threads(ProcessIndex process) const;
  // `run_end` counts no more of them than were seen.
  bool are_all_announced(ProcessIndex process) const;
  // How many more it counts; empty: nothing counts them.
  std::optional<std::uint64_t> threads_missing(ProcessIndex process) const;
  // The same of those that were announced, read back or seen to end.
  bool are_all_accounted(ProcessIndex process) const;
  // Why events of user space may be missing that were recorded, as manifests and recorders say.
  const std::optional<std::string>& missing_user_part() const noexcept {
    return missing_user_part_;
  }
  // Publishers that `run_end` counts and no event names: whatever they published is unseen.
  std::optional<Evidence> unseen_publishers(ProcessIndex process) const;

  // Of that process, as far as their announcements were seen.
  std::uint64_t threads_announced(ProcessIndex process) const {
    return processes_[at(process)].threads_announced;
  }

  // Recorders that failed where totals do not prove that everything is here all the same: each process began and
  // ended in the recording and nothing of it is missing, and no other can have begun unseen.
  const std::vector<RecorderFailure>& recorder_losses() const noexcept { return recorder_losses_; }
  // The one that leaves unknown how the process ended; null: there is none, or its command was killed.
  const RecorderFailure* lost_end(ProcessIndex process) const;

  // Some subject lost its proof.
  bool is_anything_lost() const noexcept { return is_anything_lost_; }

 private:
  struct ProcessProof {
    std::vector<Evidence> disagreements;
    std::uint64_t compared = 0;
    std::uint64_t callbacks_named = 0;
    std::uint64_t callbacks_registered = 0;
    std::uint64_t threads_announced = 0;
    std::uint64_t threads_unannounced = 0;  // that must have been, for they told of themselves
    std::optional<Evidence> first_unannounced{};
    std::optional<Evidence>
        first_stray{};  // ran callbacks, and nothing else shows that it was announced
    std::uint64_t groups_known = 0;
    std::uint64_t publishers_registered = 0;
  };
  bool has_begun_in_trace(ProcessIndex process) const;
  // `run_end` counts no more of them.
  bool counts_no_more(ProcessIndex process, std::uint32_t RunTotals::*total,
                      std::uint64_t seen) const;
  // More of them than were seen are counted by `run_end`; `event` would have told.
  std::optional<Evidence> unseen(ProcessIndex process, std::uint32_t RunTotals::*total,
                                 std::uint64_t seen, const char* what) const;
  // The same; where nothing counts them, a loss that may have taken one.
  std::optional<Evidence> unseen_or_lost(ProcessIndex process, std::uint32_t RunTotals::*total,
                                         std::uint64_t seen, const char* what,
                                         const char* uncounted) const;
  // `total()` names the first of the two numbers.
  template <std::invocable Total>
  void compare(ProcessIndex process, const Total& total, std::uint64_t expected,
               std::uint64_t seen);
  void compare_totals_of(CallbackIndex index);
  void compare_totals_of(const PublisherFacts& publisher);
  void compare_totals_of(ThreadIndex index);
  void compare_totals_of(ProcessIndex index);
  void find_recorder_losses();
  bool is_proven_whole(const Recording& recording) const;
  // Why it may have been announced for a spin of which that was not seen: whose read-backs are of which spin is
  // unknown then, for their numbers begin anew with each. When all threads of its process were counted.
  void find_unseen_spin(ThreadIndex index);
  // A number is missing among those of the ends, and not of an instance that never ended or was
  // still running when the record ended.
  bool is_any_end_lost(const CallbackFacts& callback) const;
  std::optional<Evidence> lost_partner(const CallbackFacts& facts) const;
  // A loss of such events after `last` whose victims no total counts.
  std::optional<Evidence> untold_loss(ProcessIndex process, EventKinds kinds, Timestamp last) const;

  const Model& model_;
  const ThreadLives& lives_;
  const UserLossesOfProcesses& user_losses_;
  std::optional<std::string> missing_user_part_;
  std::vector<RecorderFailure> recorder_losses_;
  std::vector<ProcessProof> processes_;
  // Of those that lost something.
  std::map<CallbackIndex, std::optional<Evidence>> callbacks_;
  std::map<CallbackIndex, std::optional<Evidence>> untold_ends_;  // of others
  std::map<ThreadIndex, std::optional<Evidence>> threads_;
  std::map<ThreadIndex, std::optional<Evidence>> spins_;  // that may have been announced unseen
  bool is_anything_lost_ = false;
  // Machines of which events of these classes were recorded.
  std::set<HostIndex> with_releases_;
  std::set<HostIndex> with_lost_samples_;
};

}  // namespace cie::analysis
