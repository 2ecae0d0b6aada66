#include <cie/executor/executor.hpp>
#include <cie/scheduling/clock.hpp>
#include <cie/scheduling/events_loop.hpp>
#include <cie/scheduling/executor_core.hpp>
#include <cie/scheduling/own_thread.hpp>
#include <cie/scheduling/serial_loop.hpp>
#include <cie/scheduling/shared_pool.hpp>
#include <cie/scheduling/thread_per_group.hpp>

#include "node_state.hpp"
#include "scheduling_names.hpp"

#include <memory>
#include <utility>

namespace cie {
namespace {

using scheduling::PlacementParts;

std::unique_ptr<scheduling::Placement> thread_per_group(const PlacementParts& parts) {
  return std::make_unique<executor::ThreadPerGroup>(parts, executor::make_lean_loop);
}

std::unique_ptr<scheduling::Placement> shared_pool(const PlacementParts& parts) {
  return std::make_unique<executor::SharedPool>(parts, executor::make_lean_loop);
}

template <typename Loop>
std::unique_ptr<scheduling::Placement> own_thread(const PlacementParts& parts) {
  return std::make_unique<executor::OwnThread>(std::make_unique<Loop>(parts.loops));
}

std::shared_ptr<scheduling::ExecutorCore> make_core(ExecutorKind kind, ExecutorOptions options,
                                                    const scheduling::PlacementFactory& placement) {
  return std::make_shared<scheduling::ExecutorCore>(kind, std::move(options), placement);
}

}  // namespace

Executor::Executor(std::shared_ptr<scheduling::ExecutorCore> core) : core_(std::move(core)) {}

Executor::~Executor() {
  cancel();
  core_->end_spawned_threads();
  core_->drop_all_nodes();
  // spin() on another thread is about to return, and must not find the executor gone. In a callback
  // it returns after this one.
  if (!executor::Callback::is_in_instance() && !core_->is_on_own_thread()) core_->wait_until_idle();
}

void Executor::add_node(Node& node) { core_->add_node(node.state()); }
void Executor::remove_node(Node& node) { core_->remove_node(*node.state()); }
void Executor::spin() {
  const auto core = core_;  // a callback may destroy the executor
  core->spin(executor::kNever);
}
void Executor::spin_for(std::chrono::nanoseconds duration) {
  const auto core = core_;
  core->spin(scheduling::later(executor::monotonic_now(), duration.count()));
}
void Executor::cancel() noexcept { core_->cancel(); }
void Executor::start_worker(const std::string& name,
                            std::function<void(std::stop_token)> function) {
  core_->spawn_thread(name, std::move(function));
}
void Executor::reload_spec(std::shared_ptr<const SchedulingSpec> spec) {
  core_->reload_spec(std::move(spec));
}
bool Executor::is_spinning() const noexcept { return core_->is_spinning(); }
std::vector<SchedulingProblem> Executor::scheduling_problems() const { return core_->problems(); }

CallbackIsolatedExecutor::CallbackIsolatedExecutor(ExecutorOptions options)
    : Executor(make_core(ExecutorKind::isolated, std::move(options), thread_per_group)) {}
SingleThreadedExecutor::SingleThreadedExecutor(ExecutorOptions options)
    : Executor(make_core(ExecutorKind::single_threaded, std::move(options),
                         own_thread<executor::SerialLoop>)) {}
EventsExecutor::EventsExecutor(ExecutorOptions options)
    : Executor(
          make_core(ExecutorKind::events, std::move(options), own_thread<executor::EventsLoop>)) {}
MultiThreadedExecutor::MultiThreadedExecutor(ExecutorOptions options)
    : Executor(make_core(ExecutorKind::multi_threaded, std::move(options), shared_pool)) {}

}  // namespace cie
