#include "thread_losses.hpp"

#include "thread_questions.hpp"

#include <algorithm>
#include <limits>
#include <set>

namespace cie::analysis {
namespace {

template <typename Index>
std::optional<CallbackIndex> found(const std::map<Index, CallbackIndex>& callbacks, Index index) {
  const auto entry = callbacks.find(index);
  return entry != callbacks.end() ? std::optional(entry->second) : std::nullopt;
}

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
    if (!(proof.*loss_of)(index)) continue;
    const auto lose = [this, index](ThreadIndex thread) {
      auto& known = on_threads_[at(thread)];
      if (!known) known = index;
    };
    const auto& callback = model.callbacks[at(index)];
    const auto announced = isolated.of(callback);
    for (const auto thread : announced) {
      lose(thread);
      if (callback.ran_on.empty()) of_every_run_.try_emplace(thread, index);
    }
    if (announced.empty() && callback.ran_on.empty()) {
      anywhere_.try_emplace(callback.process, index);
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
      in_pools_.try_emplace(callback.process, index);
    } else {
      lose_elsewhere(index, own);
    }
  }
  find_own(loss_of);
}

void ThreadLosses::find_own(Loss loss_of) {
  const auto is_lost = [&](const CallbackOnThread* pair) {
    return model_.callbacks[at(pair->callback)].is_accounted && (proof_.*loss_of)(pair->callback);
  };
  std::set<ThreadIndex> of_another_executor;
  for (const auto& callback : model_.callbacks) {
    if (callback.is_accounted || model_.processes[at(callback.process)].is_from_ros2) continue;
    for (const auto* pair : callback.ran_on)
      of_another_executor.insert(pair->thread);
  }
  for (const auto thread : of_another_executor) {
    const auto& ran = model_.threads[at(thread)].ran;
    const auto lost = std::ranges::find_if(ran, is_lost);
    if (lost != ran.end()) of_own_.emplace(thread, (*lost)->callback);
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

void ThreadLosses::lose_elsewhere(CallbackIndex index, const std::vector<ThreadIndex>& own) {
  const auto& callback = model_.callbacks[at(index)];
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
    const auto [place, is_first] = elsewhere_.try_emplace(
        {callback.process, *cpu}, Elsewhere{.callback = index, .when = *when});
    auto& all = place->second.when;
    all = {.from = std::min(all.from, when->from), .to = std::max(all.to, when->to)};
  }
}

std::optional<CallbackIndex> ThreadLosses::elsewhere(ThreadIndex index) const {
  const auto& thread = model_.threads[at(index)];
  constexpr auto kFirstCpu = std::numeric_limits<std::int32_t>::min();
  for (auto place = elsewhere_.lower_bound({thread.process, kFirstCpu});
       place != elsewhere_.end() && place->first.first == thread.process; ++place) {
    const auto& [callback, when] = place->second;
    const bool was_there = (!thread.announced || thread.announced->time <= when.to) &&
                           (!thread.fini || thread.fini->time >= when.from);
    if (was_there && may_use(model_, proof_, index, place->first.second)) return callback;
  }
  return std::nullopt;
}

std::optional<CallbackIndex> ThreadLosses::on(ThreadIndex index) const {
  if (const auto& known = on_threads_[at(index)]) return known;
  const auto& thread = model_.threads[at(index)];
  const auto in_pool = found(in_pools_, thread.process);
  if (!is_isolated(thread) && in_pool) return in_pool;
  const auto lost_here = elsewhere(index);
  return lost_here ? lost_here : anywhere(thread.process);
}

std::optional<CallbackIndex> ThreadLosses::of_every_run(ThreadIndex thread) const {
  const auto lost = found(of_every_run_, thread);
  return lost ? lost : anywhere(model_.threads[at(thread)].process);
}

std::optional<CallbackIndex> ThreadLosses::of_own(ThreadIndex thread) const {
  return found(of_own_, thread);
}

std::optional<CallbackIndex> ThreadLosses::anywhere(ProcessIndex process) const {
  return found(anywhere_, process);
}

}  // namespace cie::analysis
