#include "isolated_threads.hpp"

#include "model/sort_rows.hpp"
#include "thread_questions.hpp"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <set>

namespace cie::analysis {

void IsolatedThreads::Lists::sort() {
  sort_rows(entries_, {}, &decltype(entries_)::value_type::first);
}

std::vector<ThreadIndex> IsolatedThreads::Lists::of(Key key) const {
  std::vector<ThreadIndex> threads;
  // Not equal_range: what it returns is more than clang 14 knows of libstdc++'s concepts.
  for (auto entry =
           std::ranges::lower_bound(entries_, key, {}, &decltype(entries_)::value_type::first);
       entry != entries_.end() && entry->first == key; ++entry) {
    if (threads.empty() || threads.back() != entry->second) threads.push_back(entry->second);
  }
  return threads;
}

IsolatedThreads::IsolatedThreads(const Model& model) : model_(model) {
  std::vector<ThreadIndex> isolated;
  for (std::size_t i = 0; i < model.threads.size(); ++i) {
    const auto index = ThreadIndex{static_cast<std::uint32_t>(i)};
    if (is_isolated(model.threads[i])) isolated.push_back(index);
  }
  const auto by_order = [this](ThreadIndex index) { return order(index); };
  sort_rows(isolated, {}, by_order);
  for (const auto index : isolated) {
    const auto& thread = model.threads[at(index)];
    add(index, thread.callback, thread.group);
    for (const auto& former : thread.former)
      add(index, former.callback, former.group);
  }
  for (auto* lists : {&by_callback_, &by_group_, &without_callback_})
    lists->sort();
  find_idle_owners(isolated);
}

void IsolatedThreads::add(ThreadIndex index, const std::optional<CallbackId>& callback,
                          const std::optional<GroupId>& of_group) {
  const auto process = model_.threads[at(index)].process;
  if (callback) by_callback_.add({process, to_number(*callback)}, index);
  if (!of_group) return;
  const Lists::Key group(process, to_number(*of_group));
  by_group_.add(group, index);
  if (!callback) without_callback_.add(group, index);
}

void IsolatedThreads::find_idle_owners(const std::vector<ThreadIndex>& isolated) {
  std::set<ThreadIndex> idle;
  for (const auto index : isolated) {
    const auto& thread = model_.threads[at(index)];
    const bool has_worked = std::ranges::any_of(thread.ran, [&](const CallbackOnThread* pair) {
      return is_registered_to(thread, model_.callbacks[at(pair->callback)]);
    });
    if (!has_worked) idle.insert(index);
  }
  for (std::size_t i = 0; i < model_.callbacks.size() && !idle.empty(); ++i) {
    for (const auto thread : of(model_.callbacks[i])) {
      if (idle.contains(thread))
        idle_owners_.try_emplace(thread, CallbackIndex{static_cast<std::uint32_t>(i)});
    }
  }
}

std::optional<CallbackIndex> IsolatedThreads::idle_owner(ThreadIndex thread) const {
  const auto found = idle_owners_.find(thread);
  return found != idle_owners_.end() ? std::optional(found->second) : std::nullopt;
}

std::tuple<Timestamp, std::int64_t, ThreadIndex> IsolatedThreads::order(ThreadIndex index) const {
  const auto& thread = model_.threads[at(index)];
  return {thread.announced->time, thread.tid, index};
}

std::vector<ThreadIndex> IsolatedThreads::of(const CallbackFacts& callback) const {
  auto own = by_callback_.of({callback.process, to_number(callback.id)});
  if (!callback.group) return own;
  const auto group = without_callback_.of({callback.process, to_number(*callback.group)});
  if (group.empty()) return own;
  std::vector<ThreadIndex> threads;
  const auto by_order = [this](ThreadIndex index) { return order(index); };
  std::ranges::merge(own, group, std::back_inserter(threads), {}, by_order, by_order);
  threads.erase(std::unique(threads.begin(), threads.end()), threads.end());
  return threads;
}

std::vector<ThreadIndex> IsolatedThreads::of(const GroupFacts& group) const {
  auto threads = by_group_.of({group.process, to_number(group.id)});
  for (const auto index : group.callbacks) {
    const auto& callback = model_.callbacks[at(index)];
    const auto own = by_callback_.of({callback.process, to_number(callback.id)});
    threads.insert(threads.end(), own.begin(), own.end());
  }
  std::ranges::sort(threads, {}, [this](ThreadIndex index) { return order(index); });
  threads.erase(std::unique(threads.begin(), threads.end()), threads.end());
  return threads;
}

}  // namespace cie::analysis
