// From when to when threads lived, as far as was seen.
#pragma once

#include "kernel_holes.hpp"
#include "model/facts.hpp"

#include <cstdint>
#include <optional>
#include <set>
#include <tuple>
#include <vector>

namespace cie::analysis {

struct ThreadLife {
  Timestamp begin;  // first sign of life, or its creation
  Timestamp end;    // last sign of life; that of its announcement alone is a point
  std::optional<Timestamp> last_activity;  // of callbacks on it
  // It had ended by then, as itself, the kernel or another thread tells: after `end` where that tells it
  // alone. Empty: nobody does.
  std::optional<Timestamp> ended_by;
  bool has_exited = false;  // as the kernel tells

  // Somebody tells: it began nothing later.
  bool has_ended() const noexcept { return ended_by.has_value(); }
  // It may have lived, unseen, until then.
  Timestamp latest_end() const noexcept { return ended_by.value_or(end); }
};

// The life of every thread, gathered once: a thread may have run thousands of callbacks.
class ThreadLives {
 public:
  ThreadLives(const Model& model, const KernelHoles& holes);
  const ThreadLife& of(ThreadIndex thread) const { return lives_[at(thread)]; }
  // What the kernel tells of its tid then may be of another thread: since its last sign of life its
  // exit may have been lost.
  std::optional<Evidence> may_be_another(ThreadIndex thread, Timestamp time) const;
  // Another thread with the tid of this one began after `begin` and no later than `end`.
  bool is_tid_given_anew(ThreadIndex thread, Timestamp begin, Timestamp end) const;
  // Nothing shows that it lived on: its last event, or when a thread of it was switched in last.
  Timestamp last_sign(ProcessIndex process) const { return last_signs_[at(process)]; }
  // The kernel saw its main thread exit, and no other one that has the pid since.
  bool has_exited(ProcessIndex process) const { return exited_.contains(process); }
  // The instance was still running when its record was cut off: no callback's event followed on its
  // thread.
  bool is_cut_by_end(const OpenInstance& open) const;
  // It ended, and that was lost: later ones of its callback were seen to end, and its record went on.
  bool is_end_lost(const CallbackFacts& callback, const OpenInstance& open) const;

 private:
  using Birth = std::tuple<HostIndex, std::uint64_t, std::int64_t, Timestamp>;  // pid_ns, tid
  Birth birth(ThreadIndex thread, Timestamp time) const;

  const Model& model_;
  const KernelHoles& holes_;
  std::vector<ThreadLife> lives_;
  std::vector<Birth> births_;  // ascending
  std::vector<Timestamp> last_signs_;
  std::set<ProcessIndex> exited_;
};

}  // namespace cie::analysis
