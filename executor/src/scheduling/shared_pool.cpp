#include <cie/scheduling/shared_pool.hpp>

#include <algorithm>
#include <string>
#include <thread>

#include <fmt/format.h>
#include <sched.h>

namespace cie::scheduling {
namespace {

unsigned pool_size(const ExecutorOptions& options) {
  if (options.threads > 0) return options.threads;
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  const bool is_known = sched_getaffinity(0, sizeof allowed, &allowed) == 0;
  const unsigned cpus =
      is_known ? static_cast<unsigned>(CPU_COUNT(&allowed)) : std::thread::hardware_concurrency();
  return std::max(cpus, 2U);
}

}  // namespace

Placement::TeamPtr SharedPool::start_team() {
  std::vector<ThreadPlan> plans;
  for (unsigned i = 0; i < pool_size(parts_.options); ++i) {
    const std::string name = fmt::format("cie-pool-{}", i);
    plans.push_back({.role = ThreadRole::pool, .name = name});
  }
  auto team = std::make_shared<LoopTeam>(new_loop_(GroupType::reentrant, parts_.loops), plans,
                                         parts_.configurator);
  parts_.configurator.refuse_if_any(team->wait_configured());
  return team;
}

Placement::Teams SharedPool::place(const Callbacks& callbacks) {
  Teams fresh;
  if (team_ == nullptr) {
    team_ = start_team();
    fresh.push_back(team_);
  }
  for (const auto& callback : callbacks)
    team_->add(callback);
  return fresh;
}

Placement::Vacating SharedPool::take_off(const Callbacks& callbacks) {
  return [team = team_, callbacks](Running running) {
    if (running == Running::awaited) {
      team->remove(callbacks);
    } else {
      team->abandon(callbacks);
    }
    return Teams{};
  };
}

Placement::Waiting SharedPool::stop() {
  if (team_ == nullptr) return [] {};
  return [team = team_] {
    team->stop();
    team->join();
  };
}

}  // namespace cie::scheduling
