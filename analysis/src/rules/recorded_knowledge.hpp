// What a recording shows of its subjects, as gaps and proofs: rules state claims about it.
#pragma once

#include <cie/analysis/verdict.hpp>

#include "hidden_callbacks.hpp"
#include "kernel_holes.hpp"
#include "knowledge/knowledge.hpp"
#include "model/facts.hpp"
#include "proof.hpp"
#include "thread_lives.hpp"
#include "thread_losses.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace cie::analysis {

class RecordedKnowledge {
 public:
  // All are borrowed.
  RecordedKnowledge(const Model& model, const ThreadLives& lives, const KernelHoles& holes,
                    const Proof& proof, const HiddenCallbacks& unseen, const ThreadLosses& losses);

  const Knowledge& knowledge() const noexcept { return knowledge_; }
  // All of them at once.
  bool may_be_hidden(const Conjunction& events) const { return knowledge_.gap(events) != nullptr; }
  // Any of these.
  bool may_be_hidden(std::span<const Conjunction> conjunctions) const {
    return knowledge_.any_gap(conjunctions) != nullptr;
  }
  // Why any of them may be, in words; empty: none may.
  std::optional<Evidence> why_hidden(std::span<const Conjunction> conjunctions) const;
  // Why, in words.
  Evidence evidence_of(const Reason& reason) const;

  // What would have to be hidden for a read-back of the thread to have come between the two: one of its spin, or of
  // another spin, whose numbers begin anew.
  std::vector<Conjunction> read_backs(ThreadIndex thread, Timestamp from = kEarliest,
                                      Timestamp to = kLatest) const;
  // The same, for the thread to have been given other parameters than these by then: since they were applied, or also
  // before where the first audit of an attached process stands for that.
  std::vector<Conjunction> other_parameters(ThreadIndex thread, const ReadBack& applied,
                                            Timestamp until = kLatest) const;

  // The same, for what ran there since the first of the two to have run on another thread with its tid.
  std::vector<Conjunction> replaced(ThreadIndex thread, Timestamp last, Timestamp next) const;
  // For the process to have begun, or to have announced all that it has, between the two.
  Hidden announced_anew(ProcessIndex process, Timestamp from = kEarliest,
                        Timestamp to = kLatest) const;
  // For a callback of which nothing was seen to have run in the process, or on the thread.
  Conjunction unseen_callback(ProcessIndex process) const;
  // For one to have been registered.
  Conjunction unseen_registration(ProcessIndex process) const;
  Conjunction unseen_callback(ThreadIndex thread) const;
  // For one to have run there that the tracer has no events for.
  Conjunction unseen_run(ThreadIndex thread) const;
  // For any more of the callback to have run, or to have ended.
  Conjunction lost_run(CallbackIndex callback) const;
  Conjunction lost_end(CallbackIndex callback) const;
  // For what seems to be one instance, or two that follow each other, to be several: where nothing numbers them, an end
  // and a start in between.
  std::vector<Conjunction> other_instances(CallbackIndex callback, Timestamp from = kEarliest,
                                           Timestamp to = kLatest) const;
  // For what the callback did on the thread behind the end of that to have begun there; empty: it did nothing.
  std::vector<Conjunction> run_behind_end(const CallbackOnThread& pair) const;
  // For the subject's events to be another process's, or in another order (`is_order_needed`): nothing is decided of it
  // then.
  std::vector<Conjunction> misattributed(const Subject& about, bool is_order_needed) const;
  // For the process's own events to tell otherwise of a callback that ROS 2's have: none of its violations is proven.
  Conjunction other_account(CallbackIndex callback) const;
  // For what ran on the thread to be another callback's: an address may have been given anew.
  Conjunction another_owner(const CallbackOnThread& pair) const;

  Scope scope_of(ProcessIndex process) const;
  Scope scope_of(CallbackIndex callback) const;
  Scope scope_of(ThreadIndex thread) const;
  Scope scope_of(const CallbackOnThread& pair) const;

 private:
  void add(const Scope& scope, EventKinds kinds, TimeWindow window, GapCause cause, Evidence reason,
           std::optional<std::uint64_t> at_most = {});
  // What must have been recorded, and was not: unless a gap may hold it, nobody knows what else is missing of
  // what its process announced.
  // `count`: so many of them and no more.
  void expect(const Hidden& missing, ProcessIndex process, Evidence reason,
              std::optional<std::uint64_t> count = {});
  Conjunction unseen_callback_of(ProcessIndex process, const Scope& scope) const;
  void add_shared_pids();
  void add_clocks_apart();
  void add_cut(ProcessIndex process, const StreamFacts& stream);
  void expect_state(ProcessIndex process);
  void expect_callbacks(ProcessIndex process);
  void expect_registration(CallbackIndex callback);
  Timestamp last_sign_of(ThreadIndex thread) const;
  void expect_announcement(ThreadIndex thread);
  void add_exits(ThreadIndex thread, const KernelHoles& holes);
  void add_reused_identity(CallbackIndex callback);
  void add_other_owner(const CallbackOnThread& pair, const std::optional<Evidence>& told_by_own);
  void add_unordered_registrations(CallbackIndex callback);
  void prove_runs(CallbackIndex callback);
  void prove_read_backs(ThreadIndex thread);

  const Model& model_;
  const ThreadLives& lives_;
  const Proof& proof_;
  Knowledge knowledge_;
  std::vector<Evidence> reasons_;
};

}  // namespace cie::analysis
