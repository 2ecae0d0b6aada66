#include "thread_losses.hpp"

#include "model/subjects.hpp"
#include "thread_questions.hpp"

#include <algorithm>

namespace cie::analysis {

ThreadLosses::ThreadLosses(const Model& model, const Proof& proof) : model_(model) {
  const IsolatedThreads isolated(model);
  for (const auto index : callbacks_in_order(model)) {
    const auto& loss = proof.loss(index);
    if (!loss) continue;
    const auto& callback = model.callbacks[at(index)];
    const auto announced = isolated.of(callback);
    for (const auto thread : announced)
      on_threads_.emplace(thread, *loss);
    bool is_pooled = announced.empty() && callback.ran_on.empty();
    for (const auto& pair : callback.ran_on) {
      on_threads_.emplace(pair.thread, *loss);
      is_pooled = is_pooled || !is_isolated(model.threads[at(pair.thread)]);
    }
    if (is_pooled) in_pools_.emplace(callback.process, *loss);
  }
}

std::optional<Evidence> ThreadLosses::on(ThreadIndex index) const {
  if (const auto found = on_threads_.find(index); found != on_threads_.end()) return found->second;
  const auto& thread = model_.threads[at(index)];
  const auto found = in_pools_.find(thread.process);
  if (is_isolated(thread) || found == in_pools_.end()) return std::nullopt;
  return found->second;
}

}  // namespace cie::analysis
