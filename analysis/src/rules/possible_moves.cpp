#include "possible_moves.hpp"

#include "thread_questions.hpp"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>

namespace cie::analysis {

PossibleMoves::PossibleMoves(const RuleContext& context) : context_(context) {
  for (std::size_t i = 0; i < context.model.threads.size(); ++i) {
    const auto& thread = context.model.threads[i];
    if (is_isolated(thread)) continue;
    const auto index = ThreadIndex{static_cast<std::uint32_t>(i)};
    auto& threads = shared_[thread.process];
    threads.all.push_back(index);
    if (!thread.announced) threads.unannounced.push_back(index);
    if (!thread.announced && thread.read_backs.count != 0) threads.read_back.push_back(index);
    if (thread.fini) threads.ended.push_back(index);
  }
  const auto begin = [&context](ThreadIndex index) { return context.lives.of(index).begin; };
  const auto end = [&context](ThreadIndex index) { return context.lives.of(index).latest_end(); };
  for (auto& [process, threads] : shared_) {
    std::ranges::sort(threads.all, std::ranges::greater{}, begin);
    std::ranges::sort(threads.unannounced, std::ranges::greater{}, begin);
    std::ranges::sort(threads.ended, {}, end);
  }
}

bool PossibleMoves::exist_of(const CallbackFacts& callback) const {
  const auto& lives = context_.lives;
  std::vector<ThreadIndex> own;
  std::optional<Timestamp> first_exit;
  auto last_activity = callback.ran_on.front()->last_activity.time;
  for (const auto* pair : callback.ran_on) {
    own.push_back(pair->thread);
    last_activity = std::max(last_activity, pair->last_activity.time);
    if (!context_.model.threads[at(pair->thread)].fini) continue;
    const auto exit = lives.of(pair->thread).latest_end();
    first_exit = first_exit ? std::min(*first_exit, exit) : exit;
  }
  std::ranges::sort(own);
  // The first of them that is not its own, if that one has the property.
  const auto is_other = [&](const std::vector<ThreadIndex>& threads, const auto& has) {
    const auto found = std::ranges::find_if_not(
        threads, [&own](ThreadIndex index) { return std::ranges::binary_search(own, index); });
    return found != threads.end() && has(lives.of(*found));
  };
  const auto any = [](const ThreadLife&) { return true; };
  if (is_other(context_.isolated.of(callback), any)) return true;
  const auto found = shared_.find(callback.process);
  if (found == shared_.end()) return false;
  const auto& shared = found->second;
  return is_other(shared.read_back, any) ||
         is_other(shared.all,
                  [&](const ThreadLife& life) { return first_exit && life.begin > *first_exit; }) ||
         is_other(shared.unannounced,
                  [&](const ThreadLife& life) { return life.begin > last_activity; }) ||
         is_other(shared.ended,
                  [&](const ThreadLife& life) { return life.latest_end() < last_activity; });
}

}  // namespace cie::analysis
