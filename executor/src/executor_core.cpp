#include "executor_core.hpp"

#include "audit_thread.hpp"
#include "clock.hpp"
#include "events_loop.hpp"
#include "node_state.hpp"
#include "pool_loop.hpp"
#include "serial_loop.hpp"
#include "threads.hpp"
#include "wait_set_loop.hpp"

#include <algorithm>
#include <chrono>
#include <optional>
#include <stdexcept>
#include <utility>

#include <sched.h>

namespace cie::executor {
namespace {

// The loop that spin() runs on its own thread, if it does.
std::unique_ptr<Loop> own_loop(ExecutorKind kind, Dispatch dispatch, FailureSink& failures) {
  if (kind == ExecutorKind::single_threaded) {
    if (dispatch == Dispatch::wait_set) return std::make_unique<WaitSetLoop>(failures);
    return std::make_unique<SerialLoop>(failures);
  }
  if (kind == ExecutorKind::events) return std::make_unique<EventsLoop>(failures);
  return nullptr;
}

}  // namespace

ExecutorCore::ExecutorCore(ExecutorKind kind, ExecutorOptions options)
    : kind_(kind),
      options_(std::move(options)),
      run_(kind, options_.spec ? options_.spec->sha256() : std::string{}),
      own_loop_(own_loop(kind, options_.dispatch, *this)) {}

// --- membership -------------------------------------------------------------------------------

void ExecutorCore::add_node(const std::shared_ptr<NodeState>& node) {
  const std::lock_guard lock{mutex_};
  node->join(shared_from_this());
  nodes_.push_back(node);
  if (!is_serving_) return;
  try {
    configure_workers_of(*node);
    open_gates(serve(node->callbacks()));
  } catch (...) {
    nodes_.pop_back();
    node->leave();
    throw;
  }
}

void ExecutorCore::serve_new(NodeState& node, const std::shared_ptr<Callback>& callback) {
  const std::lock_guard lock{mutex_};
  const bool is_member =
      std::ranges::any_of(nodes_, [&node](const auto& member) { return member.get() == &node; });
  if (is_serving_ && is_member) open_gates(serve({callback}));
}

void ExecutorCore::remove_node(NodeState& node) {
  Callbacks shared;              // on a loop with callbacks of other nodes
  std::vector<TeamPtr> leaving;  // teams of this node's groups
  TeamPtr pool;
  {
    const std::lock_guard lock{mutex_};
    const auto member =
        std::ranges::find_if(nodes_, [&node](const auto& each) { return each.get() == &node; });
    if (member == nodes_.end()) {
      throw std::logic_error{"node \"" + node.name() + "\" is not in this executor"};
    }
    const Callbacks callbacks = node.callbacks();
    if (const auto found = teams_.find(nullptr); found != teams_.end()) pool = found->second;
    for (const auto& callback : callbacks) {
      const auto found = teams_.find(&callback->group());
      if (found == teams_.end()) {
        shared.push_back(callback);
      } else if (std::ranges::find(leaving, found->second) == leaving.end()) {
        leaving.push_back(found->second);
      }
    }
    const bool is_inside =
        (own_loop_ != nullptr && own_loop_->is_on_own_thread()) ||
        (pool != nullptr && pool->loop().is_on_own_thread()) ||
        std::ranges::any_of(leaving, [](const auto& t) { return t->loop().is_on_own_thread(); });
    if (is_inside) {
      throw std::logic_error{"remove_node(\"" + node.name() +
                             "\") was called by a callback that it would have to wait for: do it "
                             "from another thread"};
    }
    for (const auto& callback : callbacks) {
      served_.erase(callback.get());
      teams_.erase(&callback->group());
    }
    nodes_.erase(member);
  }
  node.leave();
  if (own_loop_ != nullptr) own_loop_->remove(shared);
  if (pool != nullptr) pool->remove(shared);
  for (const TeamPtr& team : leaving)
    team->stop();
  for (const TeamPtr& team : leaving)
    team->join();
}

void ExecutorCore::remove_all_nodes() {
  for (;;) {
    std::shared_ptr<NodeState> node;
    {
      const std::lock_guard lock{mutex_};
      if (nodes_.empty()) return;
      node = nodes_.back();
    }
    remove_node(*node);
  }
}

// --- putting callbacks on threads ---------------------------------------------------------------

void ExecutorCore::refuse_if_any(const std::vector<ParameterProblem>& problems) const {
  if (!problems.empty() && options_.on_error == OnError::refuse) throw ParametersRefused{problems};
}

void ExecutorCore::open_gates(const std::vector<TeamPtr>& teams) {
  for (const TeamPtr& team : teams)
    team->open_gate();
}

std::vector<ExecutorCore::TeamPtr> ExecutorCore::serve(const Callbacks& callbacks) {
  Callbacks fresh;
  for (const auto& callback : callbacks) {
    if (!served_.contains(callback.get())) fresh.push_back(callback);
  }
  std::vector<TeamPtr> teams;
  if (kind_ == ExecutorKind::isolated) {
    teams = serve_isolated(fresh);
  } else if (own_loop_ != nullptr) {
    for (const auto& callback : fresh)
      own_loop_->add(callback);
  } else {
    teams = serve_pooled(fresh);
  }
  for (const auto& callback : fresh)
    served_.insert(callback.get());
  return teams;
}

std::vector<ExecutorCore::TeamPtr> ExecutorCore::serve_isolated(const Callbacks& callbacks) {
  std::vector<std::pair<const GroupState*, Callbacks>> groups;  // in order of creation
  for (const auto& callback : callbacks) {
    const GroupState* const group = &callback->group();
    if (const auto team = teams_.find(group); team != teams_.end()) {
      team->second->add(callback);
      continue;
    }
    auto found = std::ranges::find(groups, group, &std::pair<const GroupState*, Callbacks>::first);
    if (found == groups.end()) found = groups.insert(groups.end(), {group, {}});
    found->second.push_back(callback);
  }
  // All threads start before the first is waited for: they configure themselves side by side.
  std::vector<TeamPtr> teams;
  std::vector<ParameterProblem> problems;
  for (const auto& [group, members] : groups) {
    const ThreadPlan plan = plan_for_group(members);
    const auto found = configurator_.conflicts({.name = plan.name, .callbacks = plan.callbacks});
    problems.insert(problems.end(), found.begin(), found.end());
    teams.push_back(start_group_team(*group, plan));
  }
  for (const TeamPtr& team : teams) {
    const auto found = team->wait_configured();
    problems.insert(problems.end(), found.begin(), found.end());
  }
  refuse_if_any(problems);  // the teams end with this scope
  for (std::size_t i = 0; i < teams.size(); ++i) {
    for (const auto& callback : groups[i].second)
      teams[i]->add(callback);
    teams_.emplace(groups[i].first, teams[i]);
  }
  return teams;
}

ThreadPlan ExecutorCore::plan_for_group(const Callbacks& callbacks_of_group) {
  const Callback& first = *callbacks_of_group.front();
  const GroupState& group = first.group();
  ThreadPlan plan{.role = ThreadRole::callback, .group = group.id(), .name = first.label()};
  // A thread that serves several callbacks is announced as what it is meant to be, an isolated one,
  // but without a callback: the verifier finds the group (rule M8).
  const bool is_reentrant = group.type() == GroupType::reentrant;
  if (callbacks_of_group.size() == 1 && !is_reentrant) plan.callback = first.id();
  for (const auto& callback : callbacks_of_group)
    plan.callbacks.push_back(callback->logical_id());
  return plan;
}

ExecutorCore::TeamPtr ExecutorCore::start_group_team(const GroupState& group,
                                                     const ThreadPlan& plan) {
  if (group.type() != GroupType::reentrant) {
    return std::make_shared<Team>(group_loop(group.type()), std::vector{plan}, configurator_);
  }
  const std::vector<ThreadPlan> plans(std::max(options_.reentrant_threads, 1U), plan);
  return std::make_shared<Team>(group_loop(group.type()), plans, configurator_);
}

// The loop of one group; a reentrant one also stands for all groups of a pool.
std::unique_ptr<Loop> ExecutorCore::group_loop(GroupType type) {
  if (options_.dispatch == Dispatch::wait_set) return std::make_unique<WaitSetLoop>(*this);
  if (type == GroupType::reentrant) return std::make_unique<PoolLoop>(*this);
  return std::make_unique<SerialLoop>(*this);
}

unsigned ExecutorCore::pool_size() const {
  if (options_.threads > 0) return options_.threads;
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  const bool is_known = sched_getaffinity(0, sizeof allowed, &allowed) == 0;
  const unsigned cpus =
      is_known ? static_cast<unsigned>(CPU_COUNT(&allowed)) : std::thread::hardware_concurrency();
  return std::max(cpus, 2U);
}

std::vector<ExecutorCore::TeamPtr> ExecutorCore::serve_pooled(const Callbacks& callbacks) {
  TeamPtr& team = teams_[nullptr];
  const bool is_new = team == nullptr;
  if (is_new) {
    std::vector<ThreadPlan> plans;
    for (unsigned i = 0; i < pool_size(); ++i) {
      const std::string name = "cie-pool-" + std::to_string(i);
      plans.push_back({.role = ThreadRole::pool, .name = name});
    }
    try {
      team = std::make_shared<Team>(group_loop(GroupType::reentrant), plans, configurator_);
      refuse_if_any(team->wait_configured());
    } catch (...) {
      teams_.erase(nullptr);
      throw;
    }
  }
  for (const auto& callback : callbacks)
    team->add(callback);
  return is_new ? std::vector{team} : std::vector<TeamPtr>{};
}

void ExecutorCore::configure_workers_of(const NodeState& node) {
  std::vector<ParameterProblem> problems;
  for (const WorkerThread& worker : node.context()->workers()) {
    if (!configured_workers_.insert(worker.trace).second) continue;
    const auto found = configurator_.configure(worker.trace, {.name = worker.name});
    problems.insert(problems.end(), found.begin(), found.end());
  }
  refuse_if_any(problems);
}

void ExecutorCore::configure_new_workers(const NodeState& node) {
  const std::lock_guard lock{mutex_};
  const bool is_member =
      std::ranges::any_of(nodes_, [&node](const auto& member) { return member.get() == &node; });
  if (is_serving_ && is_member) configure_workers_of(node);
}

// --- spinning -----------------------------------------------------------------------------------

class ExecutorCore::Spin {
 public:
  explicit Spin(ExecutorCore& core) : core_(core) {
    if (core_.is_spinning_.exchange(true, std::memory_order_acq_rel)) {
      throw std::logic_error{"spin() was called while this executor is spinning"};
    }
  }
  Spin(const Spin&) = delete;
  Spin& operator=(const Spin&) = delete;

  ~Spin() {
    std::map<const GroupState*, TeamPtr> teams;
    Callbacks served;
    {
      const std::lock_guard lock{core_.mutex_};
      core_.is_serving_ = false;  // what is created from now on waits for the next spin
      teams = core_.teams_;       // remove_node() still finds them, and waits for their end
      if (core_.own_loop_ != nullptr) {
        for (const auto& node : core_.nodes_) {
          for (const auto& callback : node->callbacks())
            served.push_back(callback);
        }
      }
    }
    if (core_.own_loop_ != nullptr) core_.own_loop_->remove(served);
    for (const auto& [group, team] : teams)
      team->stop();
    for (const auto& [group, team] : teams)
      team->join();
    {
      const std::lock_guard lock{core_.mutex_};
      core_.teams_.clear();
      core_.served_.clear();
    }
    core_.is_cancelled_.store(false, std::memory_order_release);
    if (core_.own_loop_ != nullptr) core_.own_loop_->resume();
    core_.is_spinning_.store(false, std::memory_order_release);
  }

 private:
  ExecutorCore& core_;
};

void ExecutorCore::spin(std::int64_t deadline_ns) {
  {
    const Spin spin{*this};
    const std::string name = thread_name(current_tid());
    trace::Thread dispatcher{ThreadRole::dispatcher, kNoCallback, kNoGroup, name};
    dispatcher.emit_sched(SchedMoment::initial, 0);
    run_.set_status(1);
    std::optional<ThreadConfigurator::Configured> configured;
    {
      const std::lock_guard lock{mutex_};
      refuse_if_any(configurator_.lock_process_memory());
      Callbacks all;
      for (const auto& node : nodes_) {
        configure_workers_of(*node);
        for (const auto& callback : node->callbacks())
          all.push_back(callback);
      }
      // After the teams, whose threads inherit what this one was started with, not what it is
      // given; and before any of them runs a callback. This one's own callbacks come last.
      const auto teams = own_loop_ == nullptr ? serve(all) : std::vector<TeamPtr>{};
      configured.emplace(configurator_.configure(dispatcher, {.name = name}));
      refuse_if_any(configured->problems);
      if (own_loop_ != nullptr) {
        refuse_if_any(configurator_.prepare_stack(name));
        serve(all);
      }
      open_gates(teams);
      is_serving_ = true;
    }
    std::optional<AuditThread> audit;
    if (options_.audit_period > std::chrono::nanoseconds::zero()) {
      audit.emplace(configurator_, options_.audit_period);
    }
    wait_for_end(deadline_ns);
  }
  std::exception_ptr failure;
  {
    const std::lock_guard lock{failure_mutex_};
    failure = std::exchange(failure_, nullptr);
  }
  if (failure) std::rethrow_exception(failure);
  run_.set_status(0);
}

void ExecutorCore::wait_for_end(std::int64_t deadline_ns) {
  if (own_loop_ == nullptr) {
    wait_for_cancel(deadline_ns);
  } else if (options_.dispatch == Dispatch::lean) {
    own_loop_->run(deadline_ns);
  } else {
    // cancel() may be called where DDS must not be: somebody else tells the wait set. So does
    // rclcpp.
    std::jthread canceller{[this] {
      set_current_thread_name("cie-cancel");
      wait_for_cancel(kNever);
      own_loop_->stop();
    }};
    try {
      own_loop_->run(deadline_ns);
    } catch (...) {
      cancel();
      throw;
    }
    cancel();
  }
}

void ExecutorCore::wait_for_cancel(std::int64_t deadline_ns) {
  while (!is_cancelled_.load(std::memory_order_acquire)) {
    if (wakeup_.wait_until(deadline_ns) == WaitResult::timeout) return;
  }
}

// Atomics and a futex: all of it may happen in a signal handler.
void ExecutorCore::cancel() noexcept {
  is_cancelled_.store(true, std::memory_order_release);
  if (own_loop_ != nullptr && options_.dispatch == Dispatch::lean) {
    own_loop_->stop();
  } else {
    wakeup_.notify();
  }
}

// --- parameters ---------------------------------------------------------------------------------

void ExecutorCore::reload_spec(std::shared_ptr<const SchedulingSpec> spec) {
  const std::lock_guard lock{mutex_};  // no thread starts meanwhile
  const std::string sha256 = spec ? spec->sha256() : std::string{};
  configurator_.reload(std::move(spec));
  run_.set_spec(sha256);
}

// --- workers ------------------------------------------------------------------------------------

void ExecutorCore::spawn_thread(const std::string& name, FunctionLoop::Function function) {
  workers_.start(name, std::move(function),
                 [this](const auto& problems) { refuse_if_any(problems); });
}

// --- failures -----------------------------------------------------------------------------------

void ExecutorCore::on_failure(Callback& callback, std::exception_ptr exception) noexcept {
  fail({callback.id(), callback.logical_id(), std::move(exception)});
}

void ExecutorCore::fail(CallbackFailure failure) noexcept {
  try {
    if (options_.on_exception) {
      options_.on_exception(failure);
      return;
    }
  } catch (...) {
    failure.exception = std::current_exception();  // the handler's own, which says more
  }
  {
    const std::lock_guard lock{failure_mutex_};
    if (!failure_) failure_ = std::move(failure.exception);
  }
  cancel();
}

}  // namespace cie::executor
