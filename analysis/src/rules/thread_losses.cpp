#include "thread_losses.hpp"

#include "thread_questions.hpp"

#include <algorithm>
#include <limits>

namespace cie::analysis {
namespace {

const std::optional<Evidence> kNone;

// When instances ran that numbers or totals tell to be missing. Empty: none do.
std::optional<TimeWindow> when_lost(const CallbackFacts& callback) {
  const auto& starts = callback.starts;
  std::optional<TimeWindow> when;
  if (starts.first_gap) {
    const auto& gap = *starts.first_gap;
    const bool is_only_gap = starts.missing == gap.seen - gap.expected;
    when = {.from = gap.before.time, .to = (is_only_gap ? gap.after : starts.last_at).time};
  }
  const auto next = starts.last ? *starts.last + 1 : callback.first_next_seq;
  if (!callback.fini || callback.fini->started <= next) return when;
  const auto last = starts.last ? starts.last_at : callback.registered.value_or(EventRef{});
  return TimeWindow{.from = when ? when->from : last.time, .to = callback.fini->at.time};
}

}  // namespace

ThreadLosses::ThreadLosses(const Model& model, std::span<const CallbackIndex> callbacks,
                           const Proof& proof, Loss loss_of, const IsolatedThreads& isolated)
    : model_(model), proof_(proof), on_threads_(model.threads.size()) {
  for (const auto index : callbacks) {
    const auto& loss = (proof.*loss_of)(index);
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
    auto own = announced;
    for (const auto* pair : callback.ran_on) {
      lose(pair->thread);
      own.push_back(pair->thread);
      is_pooled = is_pooled || !is_isolated(model.threads[at(pair->thread)]);
    }
    if (is_pooled) {
      in_pools_.try_emplace(callback.process, &loss);
    } else {
      lose_elsewhere(callback, own, loss);
    }
  }
  find_own(loss_of);
}

void ThreadLosses::find_own(Loss loss_of) {
  for (const auto& callback : model_.callbacks) {
    if (callback.is_accounted || model_.processes[at(callback.process)].is_from_ros2) continue;
    for (const auto* pair : callback.ran_on)
      of_own_.try_emplace(pair->thread, &kNone);
  }
  for (auto& [thread, own] : of_own_) {
    const auto& ran = model_.threads[at(thread)].ran;
    const auto lost = std::ranges::find_if(ran, [&](const CallbackOnThread* pair) {
      return model_.callbacks[at(pair->callback)].is_accounted && (proof_.*loss_of)(pair->callback);
    });
    if (lost != ran.end()) own = &(proof_.*loss_of)((*lost)->callback);
  }
}

bool may_use(const Model& model, const Proof& proof, ThreadIndex index, std::int32_t cpu) {
  const auto& thread = model.threads[at(index)];
  if (proof.loss(index) || !thread.last_read_back) return true;
  const auto allows = [cpu](const ReadBack& read) {
    return read.cpus.empty() ||
           std::ranges::binary_search(read.cpus, static_cast<std::uint32_t>(cpu));
  };
  return allows(*thread.last_read_back) || (thread.first_audit && allows(*thread.first_audit)) ||
         std::ranges::any_of(thread.applied, allows) ||
         (thread.applied.empty() && thread.initial && allows(*thread.initial));
}

void ThreadLosses::lose_elsewhere(const CallbackFacts& callback,
                                  const std::vector<ThreadIndex>& own,
                                  const std::optional<Evidence>& loss) {
  const auto when = when_lost(callback);
  if (!when) return;
  const auto cpus =
      model_.gaps.cpus({.kinds = EventKind::run_start,
                        .scope = {.host = model_.processes[at(callback.process)].host},
                        .window = *when});
  const auto may_be_its = [&](const std::optional<std::int32_t>& cpu) {
    return !cpu || std::ranges::any_of(own, [&](ThreadIndex thread) {
      return may_use(model_, proof_, thread, *cpu);
    });
  };
  if (std::ranges::any_of(cpus, may_be_its)) return;
  for (const auto& cpu : cpus) {
    const auto [place, is_first] =
        elsewhere_.try_emplace({callback.process, *cpu}, Elsewhere{.loss = &loss, .when = *when});
    auto& all = place->second.when;
    all = {.from = std::min(all.from, when->from), .to = std::max(all.to, when->to)};
  }
}

const std::optional<Evidence>& ThreadLosses::elsewhere(ThreadIndex index) const {
  const auto& thread = model_.threads[at(index)];
  constexpr auto kFirstCpu = std::numeric_limits<std::int32_t>::min();
  for (auto place = elsewhere_.lower_bound({thread.process, kFirstCpu});
       place != elsewhere_.end() && place->first.first == thread.process; ++place) {
    const auto& [loss, when] = place->second;
    const bool was_there = (!thread.announced || thread.announced->time <= when.to) &&
                           (!thread.fini || thread.fini->time >= when.from);
    if (was_there && may_use(model_, proof_, index, place->first.second)) return *loss;
  }
  return kNone;
}

const std::optional<Evidence>& ThreadLosses::on(ThreadIndex index) const {
  if (const auto* known = on_threads_[at(index)]; known != nullptr) return *known;
  const auto& thread = model_.threads[at(index)];
  const auto in_pool = in_pools_.find(thread.process);
  if (!is_isolated(thread) && in_pool != in_pools_.end()) return *in_pool->second;
  const auto& lost_here = elsewhere(index);
  return lost_here ? lost_here : anywhere(thread.process);
}

const std::optional<Evidence>& ThreadLosses::of_every_run(ThreadIndex thread) const {
  const auto found = of_every_run_.find(thread);
  return found != of_every_run_.end() ? *found->second
                                      : anywhere(model_.threads[at(thread)].process);
}

const std::optional<Evidence>& ThreadLosses::of_own(ThreadIndex thread) const {
  const auto found = of_own_.find(thread);
  return found != of_own_.end() ? *found->second : kNone;
}

const std::optional<Evidence>& ThreadLosses::anywhere(ProcessIndex process) const {
  const auto found = anywhere_.find(process);
  return found != anywhere_.end() ? *found->second : kNone;
}

}  // namespace cie::analysis
