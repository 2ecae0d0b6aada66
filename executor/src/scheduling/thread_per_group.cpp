#include <cie/scheduling/thread_per_group.hpp>

#include <algorithm>
#include <utility>

namespace cie::scheduling {
namespace {

ThreadPlan plan_for(const Placement::Callbacks& callbacks_of_group) {
  const Callback& first = *callbacks_of_group.front();
  const GroupState& group = first.group();
  ThreadPlan plan{.role = ThreadRole::callback, .group = group.id(), .name = first.label()};
  // A thread that serves several callbacks is announced as what it is meant to be, an isolated one,
  // but without a callback: the verifier finds the group (rule M8).
  const bool is_reentrant = group.type() == GroupType::reentrant;
  if (callbacks_of_group.size() == 1 && !is_reentrant) plan.callback = first.id();
  for (const auto& callback : callbacks_of_group)
    plan.callbacks.push_back(callback->in_spec());
  return plan;
}

}  // namespace

Placement::TeamPtr ThreadPerGroup::team_of(const Callback& callback) const {
  const auto found = teams_.find(&callback.group());
  return found == teams_.end() ? nullptr : found->second;
}

Placement::TeamPtr ThreadPerGroup::start_team(const GroupState& group, const ThreadPlan& plan) {
  const unsigned threads =
      group.type() == GroupType::reentrant ? std::max(parts_.options.reentrant_threads, 1U) : 1U;
  return std::make_shared<LoopTeam>(new_loop_(group.type(), parts_.loops),
                                    std::vector<ThreadPlan>(threads, plan), parts_.configurator);
}

Placement::Teams ThreadPerGroup::place(const Callbacks& callbacks) {
  std::vector<std::pair<const GroupState*, Callbacks>> groups;  // in order of creation
  for (const auto& callback : callbacks) {
    if (const auto team = team_of(*callback)) {
      team->add(callback);
      continue;
    }
    const GroupState* const group = &callback->group();
    auto found = std::ranges::find(groups, group, &std::pair<const GroupState*, Callbacks>::first);
    if (found == groups.end()) found = groups.insert(groups.end(), {group, {}});
    found->second.push_back(callback);
  }
  // All threads start before the first is waited for: they configure themselves side by side.
  Teams teams;
  std::vector<SchedulingProblem> problems;
  for (const auto& [group, members] : groups) {
    const ThreadPlan plan = plan_for(members);
    const auto found =
        parts_.configurator.conflicts({.name = plan.name, .callbacks = plan.callbacks});
    problems.insert(problems.end(), found.begin(), found.end());
    teams.push_back(start_team(*group, plan));
  }
  for (const TeamPtr& team : teams) {
    const auto found = team->wait_configured();
    problems.insert(problems.end(), found.begin(), found.end());
  }
  parts_.configurator.refuse_if_any(problems);  // the teams end with this scope
  for (std::size_t i = 0; i < teams.size(); ++i) {
    for (const auto& callback : groups[i].second)
      teams[i]->add(callback);
    teams_.emplace(groups[i].first, teams[i]);
  }
  return teams;
}

bool ThreadPerGroup::is_on_thread_of(const Callbacks& callbacks) const {
  return std::ranges::any_of(callbacks, [this](const auto& callback) {
    const auto team = team_of(*callback);
    return team != nullptr && team->is_on_own_thread();
  });
}

// A team goes with the last of its callbacks; until then it serves the others.
Placement::Vacating ThreadPerGroup::take_off(const Callbacks& callbacks) {
  std::map<TeamPtr, Callbacks> staying;
  std::map<TeamPtr, Callbacks> leaving;
  for (const auto& callback : callbacks) {
    const GroupState* const group = &callback->group();
    const bool stays = std::ranges::any_of(
        served(), [group](const auto& other) { return &other->group() == group; });
    (stays ? staying : leaving)[team_of(*callback)].push_back(callback);
  }
  for (const auto& [team, members] : leaving)
    teams_.erase(&members.front()->group());
  return [staying = std::move(staying), leaving = std::move(leaving)](Running running) {
    for (const auto& [team, members] : staying) {
      if (running == Running::awaited) {
        team->remove(members);
      } else {
        team->abandon(members);
      }
    }
    Teams teams;
    for (const auto& [team, members] : leaving) {
      team->abandon(members);
      team->stop();
      teams.push_back(team);
    }
    if (running == Running::left_alone) return teams;
    for (const auto& team : teams)
      team->join();
    return Teams{};
  };
}

Placement::Waiting ThreadPerGroup::stop() {
  return [teams = teams_] {
    for (const auto& [group, team] : teams)
      team->stop();
    for (const auto& [group, team] : teams)
      team->join();
  };
}

}  // namespace cie::scheduling
