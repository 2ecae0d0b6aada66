#include "thread_losses.hpp"

#include "thread_questions.hpp"

namespace cie::analysis {
namespace {

const std::optional<Evidence> kNone;

}  // namespace

ThreadLosses::ThreadLosses(const Model& model, std::span<const CallbackIndex> callbacks,
                           const Proof& proof, const IsolatedThreads& isolated)
    : model_(model), on_threads_(model.threads.size()) {
  for (const auto index : callbacks) {
    const auto& loss = proof.loss(index);
    if (!loss) continue;
    const auto lose = [this, &loss](ThreadIndex thread) {
      auto& known = on_threads_[at(thread)];
      if (known == nullptr) known = &loss;
    };
    const auto& callback = model.callbacks[at(index)];
    const auto announced = isolated.of(callback);
    for (const auto thread : announced) {
      lose(thread);
      if (callback.ran_on.empty()) of_every_run_.try_emplace(thread, &loss);
    }
    if (announced.empty() && callback.ran_on.empty()) {
      anywhere_.try_emplace(callback.process, &loss);
      continue;
    }
    bool is_pooled = false;
    for (const auto* pair : callback.ran_on) {
      lose(pair->thread);
      is_pooled = is_pooled || !is_isolated(model.threads[at(pair->thread)]);
    }
    if (is_pooled) in_pools_.try_emplace(callback.process, &loss);
  }
}

const std::optional<Evidence>& ThreadLosses::on(ThreadIndex index) const {
  if (const auto* known = on_threads_[at(index)]; known != nullptr) return *known;
  const auto& thread = model_.threads[at(index)];
  const auto in_pool = in_pools_.find(thread.process);
  if (!is_isolated(thread) && in_pool != in_pools_.end()) return *in_pool->second;
  return anywhere(thread.process);
}

const std::optional<Evidence>& ThreadLosses::of_every_run(ThreadIndex thread) const {
  const auto found = of_every_run_.find(thread);
  return found != of_every_run_.end() ? *found->second
                                      : anywhere(model_.threads[at(thread)].process);
}

const std::optional<Evidence>& ThreadLosses::anywhere(ProcessIndex process) const {
  const auto found = anywhere_.find(process);
  return found != anywhere_.end() ? *found->second : kNone;
}

}  // namespace cie::analysis
