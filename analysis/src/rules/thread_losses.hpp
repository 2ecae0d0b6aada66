// Which threads may have run instances that were lost.
#pragma once

#include <cie/analysis/time.hpp>

#include "isolated_threads.hpp"
#include "model/facts.hpp"
#include "proof.hpp"

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace cie::analysis {

// The thread was allowed to use the CPU, as far as was read back.
bool may_use(const Model& model, const Proof& proof, ThreadIndex thread, std::int32_t cpu);

// A lost instance of a callback ran where the callback ran otherwise or where it was announced to
// run; if that is in a pool, on any thread of the pool. Where nothing was lost meanwhile on the CPUs
// that those may use, it ran on another one, which may use one where something was. One of a callback
// of which neither is known may have run on any thread, isolated ones too. Each
// answer is the first such callback; empty: there is none.
class ThreadLosses {
 public:
  using Loss = const std::optional<Evidence>& (Proof::*)(CallbackIndex) const;
  // `callbacks`: in the order that verdicts are named by. `loss_of`: which of the proof's.
  ThreadLosses(const Model& model, std::span<const CallbackIndex> callbacks, const Proof& proof,
               Loss loss_of, const IsolatedThreads& isolated);
  std::optional<CallbackIndex> on(ThreadIndex thread) const;
  // Of a callback that is announced to run on the thread and of which no run was seen, so that all of
  // them may have been elsewhere; or anywhere.
  std::optional<CallbackIndex> of_every_run(ThreadIndex thread) const;
  // On any thread of the process: of a callback of which none is known.
  std::optional<CallbackIndex> anywhere(ProcessIndex process) const;
  // Of what this project's executors ran on the thread, beside callbacks of another one.
  std::optional<CallbackIndex> of_own(ThreadIndex thread) const;

 private:
  void find_own(Loss loss_of);
  // By process and CPU: instances that ran on none of the threads that their callbacks ran on otherwise.
  struct Elsewhere {
    CallbackIndex callback{};  // the first one's
    TimeWindow when;           // of all
  };
  // `own`: the threads that the callback ran on or was announced for.
  void lose_elsewhere(CallbackIndex callback, const std::vector<ThreadIndex>& own);
  std::optional<CallbackIndex> elsewhere(ThreadIndex thread) const;

  const Model& model_;
  const Proof& proof_;
  // The first one's.
  std::vector<std::optional<CallbackIndex>> on_threads_;
  std::map<ThreadIndex, CallbackIndex> of_every_run_;
  std::map<ThreadIndex, CallbackIndex> of_own_;
  std::map<ProcessIndex, CallbackIndex> in_pools_;
  std::map<ProcessIndex, CallbackIndex> anywhere_;  // in the process
  std::map<std::pair<ProcessIndex, std::int32_t>, Elsewhere> elsewhere_;
};

}  // namespace cie::analysis
