#include <cie/executor/executor.hpp>
#include <cie/scheduling/executor_core.hpp>
#include <cie/scheduling/shared_pool.hpp>
#include <cie/scheduling/thread_per_group.hpp>

#include "wait_set_loop.hpp"
#include "wait_set_on_own_thread.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace cie {
namespace {

// An executor that dispatches as rclcpp does.
class Baseline final : public Executor {
 public:
  Baseline(ExecutorKind kind, ExecutorOptions options,
           const scheduling::PlacementFactory& placement)
      : Executor(std::make_shared<scheduling::ExecutorCore>(kind, std::move(options), placement)) {}
};

std::unique_ptr<executor::Loop> new_wait_set_loop(GroupType, executor::FailureHandler& failures) {
  return std::make_unique<executor::WaitSetLoop>(failures);
}

std::unique_ptr<Executor> make_baseline(std::string_view name, ExecutorOptions options) {
  using scheduling::PlacementParts;
  if (name == "single-waitset") {
    return std::make_unique<Baseline>(
        ExecutorKind::single_threaded, std::move(options), [](const PlacementParts& parts) {
          return std::make_unique<executor::WaitSetOnOwnThread>(parts.failures);
        });
  }
  if (name == "multi-waitset") {
    return std::make_unique<Baseline>(
        ExecutorKind::multi_threaded, std::move(options), [](const PlacementParts& parts) {
          return std::make_unique<executor::SharedPool>(parts, new_wait_set_loop);
        });
  }
  return std::make_unique<Baseline>(
      ExecutorKind::isolated, std::move(options), [](const PlacementParts& parts) {
        return std::make_unique<executor::ThreadPerGroup>(parts, new_wait_set_loop);
      });
}

}  // namespace

std::unique_ptr<Executor> make_executor(std::string_view name, ExecutorOptions options) {
  if (std::ranges::find(kExecutorNames, name) == kExecutorNames.end()) {
    throw std::invalid_argument{"there is no executor \"" + std::string{name} + "\""};
  }
  if (name.ends_with("-waitset")) return make_baseline(name, std::move(options));
  if (name == "single") return std::make_unique<SingleThreadedExecutor>(std::move(options));
  if (name == "multi") return std::make_unique<MultiThreadedExecutor>(std::move(options));
  if (name == "events") return std::make_unique<EventsExecutor>(std::move(options));
  return std::make_unique<CallbackIsolatedExecutor>(std::move(options));
}

}  // namespace cie
