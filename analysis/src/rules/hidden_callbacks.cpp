#include "hidden_callbacks.hpp"

#include <cie/analysis/note.hpp>

#include "judgement.hpp"
#include "kernel_holes.hpp"

#include <algorithm>
#include <set>
#include <utility>

namespace cie::analysis {
namespace {

struct Threads {
  std::map<std::pair<ProcessIndex, GroupId>, std::set<ThreadIndex>> of_groups;
  std::set<ThreadIndex> in_pools;  // some group or callback ran on several, this one among them
};

Threads threads_of(const Model& model) {
  Threads threads;
  for (const auto& callback : model.callbacks) {
    const bool is_pooled = callback.ran_on.size() > 1;
    for (const auto* pair : callback.ran_on) {
      if (is_pooled) threads.in_pools.insert(pair->thread);
      if (callback.group)
        threads.of_groups[{callback.process, *callback.group}].insert(pair->thread);
    }
  }
  for (const auto& [group, ran_on] : threads.of_groups) {
    if (ran_on.size() > 1) threads.in_pools.insert(ran_on.begin(), ran_on.end());
  }
  return threads;
}

// Who served it, if that is known. The callbacks of a group that ran on several threads, or whose executor
// is told to have several, are a pool's, any thread of which may have served it; so may be those that
// ran on one of its threads, as a short recording of a multi-threaded executor shows them.
std::optional<std::set<ThreadIndex>> servers_of(const HiddenCallback& hidden,
                                                const ProcessFacts& process, ProcessIndex index,
                                                const Threads& threads) {
  if (hidden.is_client && !hidden.is_action && process.tells_responses) return hidden.ran_on;
  if (!hidden.group || hidden.is_pooled) return std::nullopt;
  const auto found = threads.of_groups.find({index, *hidden.group});
  if (found == threads.of_groups.end() || found->second.size() != 1) return std::nullopt;
  if (threads.in_pools.contains(*found->second.begin())) return std::nullopt;
  return found->second;
}

// Of a process that tells of all of its own: whether this one is among these, so that no other executor
// served it.
bool is_told(const Model& model, ProcessIndex process, const HiddenCallback& hidden) {
  return std::ranges::any_of(model.callbacks, [&](const CallbackFacts& callback) {
    if (callback.process != process || !callback.is_accounted || callback.node != hidden.node)
      return false;
    if (hidden.is_action) return callback.kind == CallbackKind::waitable;
    return callback.kind == CallbackKind::client && hidden.what.ends_with(' ' + callback.source);
  });
}

}  // namespace

HiddenCallbacks::HiddenCallbacks(const Model& model) : model_(model) {
  for (const auto& stream : model.streams) {
    if (stream.domain != Domain::user || !stream.has_client_events || !stream.begin) continue;
    const auto [since, is_first] = told_since_.try_emplace(stream.host, *stream.begin);
    if (!is_first) since->second = std::min(since->second, *stream.begin);
  }
  for (const auto& callback : model.callbacks) {
    if (callback.is_accounted || model.processes[at(callback.process)].is_from_ros2) continue;
    for (const auto* pair : callback.ran_on)
      of_other_executors_.insert(pair->thread);
  }
  if (std::ranges::all_of(model.processes, &std::vector<HiddenCallback>::empty,
                          &ProcessFacts::hidden))
    return;
  const auto threads = threads_of(model);
  for (std::size_t i = 0; i < model.processes.size(); ++i) {
    const auto& process = model.processes[i];
    const auto index = ProcessIndex{static_cast<std::uint32_t>(i)};
    for (const auto& hidden : process.hidden) {
      if (!process.is_from_ros2 && is_told(model, index, hidden)) continue;
      const auto servers = servers_of(hidden, process, index, threads);
      if (!servers) anywhere_[index].add(hidden);
      if (!servers) continue;
      for (const auto thread : *servers)
        on_threads_[thread].add(hidden);
    }
  }
}

std::optional<Evidence> HiddenCallbacks::may_be_unseen(const ProcessFacts& process) const {
  if (!process.ros2_begin) {
    return without_event(process.first_seen.value_or(EventRef{}),
                         note("client-perhaps-made-before-recording"));
  }
  const auto told = told_since_.find(process.host);
  if (told == told_since_.end() || told->second > process.ros2_begin->time) {
    return evidence("rcl_init", *process.ros2_begin, note("client-events-undeclared"));
  }
  // Within what is judged whoever judges asks for losses.
  const auto* before = loss_before(model_, process.host, Domain::user, process.ros2_begin->time);
  if (before == nullptr) return std::nullopt;
  auto unseen = evidence_of(*before);
  unseen.note = note("client-perhaps-made-then", {{"loss", std::move(unseen.note)}});
  return unseen;
}

std::optional<Evidence> HiddenCallbacks::beside_own(ThreadIndex thread) const {
  const auto& facts = model_.threads[at(thread)];
  const auto& ran = facts.beside_own;
  if (!ran || facts.ran.empty()) return std::nullopt;
  return evidence("callback_start", ran->second,
                  note("runs-in-another-executor", {{"callback", NamedCallback{ran->first}}}));
}

std::optional<Evidence> HiddenCallbacks::unseen_on(ThreadIndex thread) const {
  const auto& facts = model_.threads[at(thread)];
  const auto& process = model_.processes[at(facts.process)];
  if (facts.ran.empty()) return std::nullopt;
  // Where the process tells of all callbacks of its own, that is about those of other executors alone.
  if (!process.is_from_ros2 && !of_other_executors_.contains(thread)) return std::nullopt;
  if (auto unseen = may_be_unseen(process)) return unseen;
  const auto special = on_threads_.find(thread);
  const auto general = anywhere_.find(facts.process);
  Some all = special != on_threads_.end() ? special->second : Some{};
  if (general != anywhere_.end()) {
    if (all.first == nullptr) all.first = general->second.first;
    all.count += general->second.count;
  }
  if (all.first == nullptr) return std::nullopt;
  const auto& hidden = *all.first;
  const bool is_of_responses = all.count == 1 && hidden.is_client && !hidden.is_action;
  return evidence(
      hidden.is_client ? "rcl_client_init" : "rcl_service_init", hidden.made,
      note(hidden.ran_on.contains(thread) ? "also-served" : "perhaps-also-served",
           {{"what", hidden.what},
            {"node", hidden.node.empty() ? Note{} : note("of-node", {{"node", hidden.node}})},
            {"others",
             all.count > 1 ? note("and-other-callbacks", {{"callbacks", all.count - 1}}) : Note{}},
            {"unseen", note(is_of_responses ? "responses-not-shown" : "instances-not-shown")}}));
}

}  // namespace cie::analysis
