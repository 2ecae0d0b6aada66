#include <cie/executor/executor.hpp>

#include "clock.hpp"
#include "executor_core.hpp"
#include "node_state.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace cie {
namespace {

std::string joined(const std::vector<ParameterProblem>& problems) {
  std::string text;
  for (const ParameterProblem& problem : problems) {
    text.append(text.empty() ? "" : "\n").append(problem.text());
  }
  return text;
}

ExecutorOptions without_wait_set(ExecutorOptions options) {
  if (options.dispatch == Dispatch::wait_set) {
    throw std::invalid_argument{
        "the events executor has no dispatch by wait sets: they do not tell what came first"};
  }
  return options;
}

}  // namespace

std::string ParameterProblem::text() const {
  const std::string place = line > 0 ? file + ":" + std::to_string(line) : file;
  return (place.empty() ? "" : place + ": ") + "\"" + entry + "\": thread \"" + thread +
         "\": " + reason;
}

ParametersRefused::ParametersRefused(std::vector<ParameterProblem> problems)
    : std::runtime_error(joined(problems)), problems_(std::move(problems)) {}

Executor::Executor(ExecutorKind kind, ExecutorOptions options)
    : core_(std::make_shared<executor::ExecutorCore>(kind, std::move(options))) {}

Executor::~Executor() {
  cancel();
  core_->end_workers();
  core_->remove_all_nodes();
}

void Executor::add_node(Node& node) { core_->add_node(node.state()); }
void Executor::remove_node(Node& node) { core_->remove_node(*node.state()); }
void Executor::spin() { core_->spin(executor::kNever); }
void Executor::spin_for(std::chrono::nanoseconds duration) {
  core_->spin(executor::monotonic_now() + duration.count());
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
std::vector<ParameterProblem> Executor::parameter_problems() const { return core_->problems(); }

CallbackIsolatedExecutor::CallbackIsolatedExecutor(ExecutorOptions options)
    : Executor(ExecutorKind::isolated, std::move(options)) {}
SingleThreadedExecutor::SingleThreadedExecutor(ExecutorOptions options)
    : Executor(ExecutorKind::single_threaded, std::move(options)) {}
EventsExecutor::EventsExecutor(ExecutorOptions options)
    : Executor(ExecutorKind::events, without_wait_set(std::move(options))) {}
MultiThreadedExecutor::MultiThreadedExecutor(ExecutorOptions options)
    : Executor(ExecutorKind::multi_threaded, std::move(options)) {}

std::unique_ptr<Executor> make_executor(std::string_view name, ExecutorOptions options) {
  constexpr std::string_view kWaitSet = "-waitset";
  if (std::ranges::find(kExecutorNames, name) == kExecutorNames.end()) {
    throw std::invalid_argument{"there is no executor \"" + std::string{name} + "\""};
  }
  options.dispatch = name.ends_with(kWaitSet) ? Dispatch::wait_set : Dispatch::lean;
  if (name.starts_with("single")) {
    return std::make_unique<SingleThreadedExecutor>(std::move(options));
  }
  if (name.starts_with("multi")) return std::make_unique<MultiThreadedExecutor>(std::move(options));
  if (name == "events") return std::make_unique<EventsExecutor>(std::move(options));
  return std::make_unique<CallbackIsolatedExecutor>(std::move(options));
}

}  // namespace cie
