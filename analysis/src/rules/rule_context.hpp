// What rules judge by: the facts, and what several rules ask of them, worked out once.
#pragma once

#include <cie/analysis/analyzer.hpp>
#include <cie/analysis/verdict.hpp>

#include "hidden_callbacks.hpp"
#include "isolated_threads.hpp"
#include "kernel_holes.hpp"
#include "kernel_record_of_threads.hpp"
#include "model/facts.hpp"
#include "model/subjects.hpp"
#include "proof.hpp"
#include "recorded_knowledge.hpp"
#include "thread_lives.hpp"
#include "thread_losses.hpp"
#include "user_losses_of_processes.hpp"

#include <map>
#include <set>
#include <vector>

namespace cie::analysis {

struct RuleContext {
  RuleContext(const Model& model, const AnalysisOptions& options);
  RuleContext(const RuleContext&) = delete;
  RuleContext& operator=(const RuleContext&) = delete;

  // Registered after the window that was asked for, or over before it: none of its concern.
  bool is_after_window(const CallbackFacts& callback) const noexcept;
  bool is_before_window(ThreadIndex thread) const;

  const Model& model;
  const AnalysisOptions& options;
  const std::vector<CallbackIndex> callbacks;  // in the order that verdicts are named by
  const Subjects names;
  const KernelHoles holes;
  const ThreadLives lives;
  const KernelRecordOfThreads kernel_record;
  const UserLossesOfProcesses user_losses;
  const Proof proof;
  const IsolatedThreads isolated;
  const ThreadLosses losses;
  const ThreadLosses run_losses;  // of whole instances: see Proof::lost_runs()
  const HiddenCallbacks hidden;
  const RecordedKnowledge known;
  const std::set<ProcessIndex> of_cie_rclcpp;
  // Threads that ran callbacks, were never announced, and of which it is not proven that they never
  // were (M9 is INCONCLUSIVE): rules about isolated threads are INCONCLUSIVE there as well.
  const std::map<ThreadIndex, Evidence> unknown_threads;
};

}  // namespace cie::analysis
