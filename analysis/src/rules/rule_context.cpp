#include "rule_context.hpp"

#include "judgement.hpp"
#include "thread_questions.hpp"

#include <cstdint>

namespace cie::analysis {
namespace {

std::map<ThreadIndex, Evidence> find_unknown(const Model& model, const Proof& proof) {
  std::map<ThreadIndex, Evidence> unknown;
  for (std::size_t i = 0; i < model.threads.size(); ++i) {
    const auto& thread = model.threads[i];
    if (thread.announced || thread.ran.empty() || proof.is_complete(thread.process)) continue;
    unknown.emplace(
        ThreadIndex{static_cast<std::uint32_t>(i)},
        without_event(first_start_on(thread), note(thread.former_fini ? "thread-not-announced-again"
                                                                      : "thread-role-unknown",
                                                   {{"tid", thread.tid}})));
  }
  return unknown;
}

// It announces the worker that serves what rclcpp serves for itself.
std::set<ProcessIndex> find_cie_rclcpp(const Model& model) {
  std::set<ProcessIndex> processes;
  for (const auto& thread : model.threads) {
    if (thread.role == ThreadRole::worker && thread.name == "cie-rclcpp")
      processes.insert(thread.process);
  }
  return processes;
}

}  // namespace

RuleContext::RuleContext(const Model& facts, const AnalysisOptions& asked)
    : model(facts),
      options(asked),
      callbacks(callbacks_in_order(facts)),
      names(facts, callbacks),
      holes(facts),
      lives(facts, holes),
      kernel_record(facts, holes, lives, asked.window.value_or(TimeWindow{})),
      user_losses(facts),
      proof(facts, lives, user_losses),
      isolated(facts),
      losses(facts, callbacks, proof, &Proof::loss, isolated),
      run_losses(facts, callbacks, proof, &Proof::lost_runs, isolated),
      hidden(facts),
      known(facts, lives, holes, proof, hidden, losses),
      of_cie_rclcpp(find_cie_rclcpp(facts)),
      unknown_threads(find_unknown(facts, proof)) {}

bool RuleContext::is_after_window(const CallbackFacts& callback) const noexcept {
  return options.window && callback.registered && callback.registered->time > options.window->to;
}

bool RuleContext::is_before_window(ThreadIndex index) const {
  if (!options.window) return false;
  const auto& fini = model.threads[at(index)].fini;
  const auto& life = lives.of(index);
  return fini ? fini->time < options.window->from
              : life.has_ended() && life.end < options.window->from;
}

}  // namespace cie::analysis
