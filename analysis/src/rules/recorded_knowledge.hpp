// What a recording shows of its subjects, as gaps and proofs: rules state claims about it.
#pragma once

#include <cie/analysis/verdict.hpp>

#include "hidden_callbacks.hpp"
#include "kernel_holes.hpp"
#include "knowledge/knowledge.hpp"
#include "model/facts.hpp"
#include "proof.hpp"
#include "thread_lives.hpp"

#include <cstdint>
#include <optional>
#include <vector>

namespace cie::analysis {

class RecordedKnowledge {
 public:
  // All are borrowed.
  RecordedKnowledge(const Model& model, const ThreadLives& lives, const KernelHoles& holes,
                    const Proof& proof, const HiddenCallbacks& unseen);

  const Knowledge& knowledge() const noexcept { return knowledge_; }
  // Why, in words.
  Evidence evidence_of(const Reason& reason) const;

  // What would have to be hidden for a read-back of the thread to have come between the two: one of its spin, or of
  // another spin, whose numbers begin anew.
  std::vector<std::vector<Hidden>> read_backs(ThreadIndex thread, Timestamp from = kEarliest,
                                              Timestamp to = kLatest) const;
  // The same, for the thread to have been given other parameters than these by then: since they were applied, or also
  // before where the first audit of an attached process stands for that.
  std::vector<std::vector<Hidden>> other_parameters(ThreadIndex thread, const ReadBack& applied,
                                                    Timestamp until = kLatest) const;

  Scope scope_of(ProcessIndex process) const;
  Scope scope_of(CallbackIndex callback) const;
  Scope scope_of(ThreadIndex thread) const;

 private:
  void add(const Scope& scope, EventKinds kinds, TimeWindow window, GapCause cause, Evidence reason,
           std::optional<std::uint64_t> at_most = {});
  // What must have been recorded, and was not: unless a gap may hold it, nobody knows what else is missing of
  // what its process announced.
  // `count`: so many of them and no more.
  void expect(const Hidden& missing, ProcessIndex process, Evidence reason,
              std::optional<std::uint64_t> count = {});
  void expect_state(ProcessIndex process);
  void expect_registration(CallbackIndex callback);
  void add_exits(ThreadIndex thread, const ThreadLives& lives, const KernelHoles& holes);
  void add_reused_identity(CallbackIndex callback);
  void add_unordered_registrations(CallbackIndex callback);
  void prove_runs(CallbackIndex callback);
  void prove_read_backs(ThreadIndex thread);

  const Model& model_;
  const Proof& proof_;
  Knowledge knowledge_;
  std::vector<Evidence> reasons_;
};

}  // namespace cie::analysis
