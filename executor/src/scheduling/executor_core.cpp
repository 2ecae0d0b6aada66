#include <cie/scheduling/executor_core.hpp>
#include <cie/scheduling/threads.hpp>

#include "audit_thread.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <stdexcept>
#include <utility>

namespace cie::scheduling {
namespace {

void open_gates(const Placement::Teams& teams) {
  for (const auto& team : teams)
    team->open_gate();
}

[[noreturn]] void throw_nesting(CallbackFailure failure) {
  try {
    std::rethrow_exception(failure.exception);
  } catch (...) {
    throw CallbackError{std::move(failure)};
  }
}

}  // namespace

ExecutorCore::ExecutorCore(ExecutorKind kind, ExecutorOptions options,
                           const PlacementFactory& placement)
    : options_(std::move(options)),
      run_(kind, options_.spec ? options_.spec->sha256() : std::string{}),
      placement_(placement({options_, configurator_, {*this, cancellation_}})) {}

// --- membership -------------------------------------------------------------------------------

bool ExecutorCore::is_member(const ServedNode& node) const {
  return std::ranges::any_of(nodes_, [&node](const auto& each) { return each.get() == &node; });
}

void ExecutorCore::serve(const Callbacks& callbacks) { open_gates(placement_->serve(callbacks)); }

void ExecutorCore::add_node(const std::shared_ptr<ServedNode>& node) {
  const std::lock_guard lock{mutex_};
  node->join(shared_from_this());
  nodes_.push_back(node);
  if (!is_serving_) return;
  try {
    configure_workers_of(*node);
    serve(node->callbacks());
  } catch (...) {
    nodes_.pop_back();
    node->leave();
    throw;
  }
}

void ExecutorCore::serve_new(ServedNode& node, const Callbacks& callbacks) {
  const std::lock_guard lock{mutex_};
  if (!is_serving_ || !is_member(node)) return;
  const Callbacks kept = node.callbacks();
  Callbacks present;
  std::ranges::copy_if(callbacks, std::back_inserter(present), [&kept](const auto& callback) {
    return std::ranges::find(kept, callback) != kept.end();
  });
  serve(present);
}

// Who does not wait may be on a thread of a team that leaves, and drop the last that holds the
// executor: spin() takes such a team from here before it returns.
void ExecutorCore::vacate(const Placement::Vacating& vacating, bool waits) {
  if (waits) {
    vacating(Running::awaited);
    join_departed(Departed::has_left);
    return;
  }
  const auto leaving = vacating(Running::left_alone);
  const std::lock_guard lock{mutex_};
  departed_.insert(departed_.end(), leaving.begin(), leaving.end());
  --departing_;
  departing_ended_.notify_all();
}

Placement::Teams ExecutorCore::take_departed(Departed which) {
  std::unique_lock lock{mutex_};
  if (which == Departed::all) departing_ended_.wait(lock, [this] { return departing_ == 0; });
  Placement::Teams teams;
  std::erase_if(departed_, [&](const auto& team) {
    const bool is_taken = which == Departed::all || team->has_left();
    if (is_taken) teams.push_back(team);
    return is_taken;
  });
  return teams;
}

// A callback that runs on may stop another's team: until there is none.
void ExecutorCore::join_departed(Departed which) {
  for (auto teams = take_departed(which); !teams.empty(); teams = take_departed(which)) {
    for (const auto& team : teams)
      team->join();
  }
}

void ExecutorCore::remove_node(ServedNode& node) {
  std::optional<Callback::Waiting> waiting;
  Placement::Vacating vacating;
  {
    const std::lock_guard lock{mutex_};
    if (!is_member(node)) {
      throw std::logic_error{"node \"" + node.name() + "\" is not in this executor"};
    }
    const Callbacks callbacks = node.callbacks();
    const bool is_on_one_thread = placement_->is_on_spinning_thread();
    waiting.emplace(callbacks, is_on_one_thread ? &cancellation_ : nullptr);
    if (placement_->is_on_thread_of(callbacks) || waiting->is_in_vain()) {
      throw std::logic_error{"remove_node(\"" + node.name() +
                             "\") was called by a callback that it would have to wait for: do it "
                             "from another thread"};
    }
    vacating = placement_->remove(callbacks);
    std::erase_if(nodes_, [&node](const auto& each) { return each.get() == &node; });
  }
  node.leave();
  vacate(vacating, true);
}

void ExecutorCore::drop_node(ServedNode& node) {
  Placement::Vacating vacating;
  bool waits = false;
  {
    const std::lock_guard lock{mutex_};
    const Callbacks callbacks = node.callbacks();
    std::erase_if(nodes_, [&node](const auto& each) { return each.get() == &node; });
    waits = !Callback::is_in_instance() && !placement_->is_on_thread_of(callbacks);
    vacating = placement_->remove(callbacks);
    if (!waits) ++departing_;
  }
  node.leave();
  vacate(vacating, waits);
}

void ExecutorCore::drop_all_nodes() {
  for (;;) {
    std::shared_ptr<ServedNode> node;
    {
      const std::lock_guard lock{mutex_};
      if (nodes_.empty()) return;
      node = nodes_.back();
    }
    drop_node(*node);
  }
}

void ExecutorCore::take_off(const Callbacks& callbacks, bool may_wait) {
  Placement::Vacating vacating;
  bool waits = false;
  {
    const std::lock_guard lock{mutex_};
    waits = may_wait && !Callback::is_in_instance() && !placement_->is_on_thread_of(callbacks);
    vacating = placement_->remove(callbacks);
    if (!waits) ++departing_;
  }
  vacate(vacating, waits);
}

void ExecutorCore::withdraw(const Callbacks& callbacks) { take_off(callbacks, true); }

void ExecutorCore::abandon(const Callbacks& callbacks) {
  for (const auto& callback : callbacks)
    callback->close();
  take_off(callbacks, false);
  join_departed(Departed::has_left);
}

// --- what the spec may name -------------------------------------------------------------------------

void ExecutorCore::configure_workers_of(const ServedNode& node) {
  std::vector<SchedulingProblem> problems;
  for (const AnnouncedThread& worker : node.workers()) {
    if (!configured_workers_.insert(worker.trace).second) continue;
    const auto found = configurator_.configure(worker.trace, {.name = worker.name});
    problems.insert(problems.end(), found.begin(), found.end());
  }
  configurator_.refuse_if_any(problems);
}

KnownIds ExecutorCore::known_ids() const {
  KnownIds known;
  for (const auto& node : nodes_) {
    known.nodes.push_back(node->name());
    for (const auto& callback : node->callbacks())
      known.callbacks.push_back(callback->in_spec());
  }
  return known;
}

void ExecutorCore::configure_new_workers(const ServedNode& node) {
  const std::lock_guard lock{mutex_};
  if (is_serving_ && is_member(node)) configure_workers_of(node);
}

void ExecutorCore::reload_spec(std::shared_ptr<const SchedulingSpec> spec) {
  const std::lock_guard lock{mutex_};  // no thread starts meanwhile
  const std::string sha256 = spec ? spec->sha256() : std::string{};
  configurator_.reload(std::move(spec));
  if (is_serving_) configurator_.tell_misspelt(known_ids());
  run_.set_spec(sha256);
}

// --- spinning -----------------------------------------------------------------------------------

ExecutorCore::Callbacks ExecutorCore::all_callbacks() const {
  Callbacks all;
  for (const auto& node : nodes_) {
    for (const auto& callback : node->callbacks())
      all.push_back(callback);
  }
  return all;
}

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
    const bool is_cancelled = core_.cancellation_.is_cancelled();  // what comes later ends the next
    Placement::Waiting wait_for_callbacks;
    {
      const std::lock_guard lock{core_.mutex_};
      core_.is_serving_ = false;  // what is created from now on waits for the next spin
      wait_for_callbacks = core_.placement_->stop();
    }
    wait_for_callbacks();
    core_.join_departed(Departed::all);  // nobody is left to stop more
    if (is_cancelled) core_.cancellation_.reset();
    {
      const std::lock_guard lock{core_.mutex_};
      core_.placement_->clear();
    }
    core_.is_spinning_.store(false, std::memory_order_release);
    core_.is_spinning_.notify_all();
  }

 private:
  ExecutorCore& core_;
};

void ExecutorCore::count_spins(int more) {
  const std::lock_guard lock{failure_mutex_};
  unreturned_spins_ += more;
  run_.set_status(unreturned_spins_ == 0 ? 0 : 1);
}

void ExecutorCore::spin(std::int64_t deadline_ns, const WhileServing& while_serving) {
  {
    const Spin spin{*this};
    const std::string name = thread_name(current_tid());
    trace::Thread dispatcher{ThreadRole::dispatcher, kNoCallback, kNoGroup, name};
    dispatcher.emit_sched(SchedMoment::initial, 0);
    count_spins(1);
    std::optional<ThreadConfigurator::Configured> configured;
    {
      const std::lock_guard lock{mutex_};
      configurator_.refuse_if_any(configurator_.lock_process_memory());
      for (const auto& node : nodes_)
        configure_workers_of(*node);
      // After the teams, whose threads inherit what this one was started with, not what it is
      // given; and before any of them runs a callback. This one's own callbacks come last.
      const bool serves = placement_->is_on_spinning_thread();
      const auto teams = serves ? Placement::Teams{} : placement_->serve(all_callbacks());
      configured.emplace(configurator_.configure(dispatcher, {.name = name}));
      configurator_.refuse_if_any(configured->problems);
      if (serves) {
        configurator_.refuse_if_any(configurator_.prepare_stack(name));
        placement_->serve(all_callbacks());
      }
      configurator_.tell_misspelt(known_ids());
      open_gates(teams);
      is_serving_ = true;
    }
    std::optional<AuditThread> audit;
    if (options_.audit_period > std::chrono::nanoseconds::zero()) {
      audit.emplace(configurator_, options_.audit_period);
    }
    if (while_serving) {
      while_serving(cancellation_);
    } else {
      placement_->run(deadline_ns, cancellation_);
    }
    wait_for_cancelling();
  }
  std::optional<CallbackFailure> failure;
  {
    const std::lock_guard lock{failure_mutex_};
    failure = std::exchange(failure_, std::nullopt);
  }
  if (failure) throw_nesting(*std::move(failure));
  count_spins(-1);
}

void ExecutorCore::wait_until_idle() const noexcept {
  is_spinning_.wait(true, std::memory_order_acquire);
}

bool ExecutorCore::is_on_own_thread() const noexcept {
  const std::lock_guard lock{mutex_};
  return placement_->is_on_spinning_thread() && placement_->is_on_thread_of({});
}

// Atomics and a futex: all of it may happen in a signal handler.
void ExecutorCore::cancel() noexcept {
  cancelling_.fetch_add(1, std::memory_order_relaxed);
  cancellation_.cancel();
  placement_->cancel();
  cancelling_.fetch_sub(1, std::memory_order_release);
  cancelling_.notify_all();  // uses its address alone: the executor may be gone
}

// Asleep: by yielding, a real-time thread would keep its CPU from who cancels at a lower priority.
void ExecutorCore::wait_for_cancelling() const noexcept {
  for (int calls = cancelling_.load(std::memory_order_acquire); calls != 0;
       calls = cancelling_.load(std::memory_order_acquire)) {
    cancelling_.wait(calls, std::memory_order_acquire);
  }
}

// --- failures -----------------------------------------------------------------------------------

void ExecutorCore::on_failure(CallbackFailure failure) noexcept {
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
    if (!failure_) failure_ = std::move(failure);
  }
  cancel();
}

}  // namespace cie::scheduling
