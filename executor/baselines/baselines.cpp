#include "baselines.hpp"

#include <cie/scheduling/executor_core.hpp>
#include <cie/scheduling/shared_pool.hpp>
#include <cie/scheduling/thread_per_group.hpp>

#include "wait_set_loop.hpp"
#include "wait_set_on_own_thread.hpp"

#include <utility>

namespace cie::executor {
namespace {

// An executor that dispatches as rclcpp does.
class Baseline final : public Executor {
 public:
  Baseline(ExecutorKind kind, ExecutorOptions options,
           const scheduling::PlacementFactory& placement)
      : Executor(std::make_shared<scheduling::ExecutorCore>(kind, std::move(options), placement)) {}
};

std::unique_ptr<Loop> new_wait_set_loop(GroupType, const LoopParts& parts) {
  return std::make_unique<WaitSetLoop>(parts);
}

}  // namespace

std::unique_ptr<Executor> make_baseline(std::string_view name, ExecutorOptions options) {
  using scheduling::PlacementParts;
  if (name == "single-waitset") {
    return std::make_unique<Baseline>(ExecutorKind::single_threaded, std::move(options),
                                      [](const PlacementParts& parts) {
                                        return std::make_unique<WaitSetOnOwnThread>(parts.loops);
                                      });
  }
  if (name == "multi-waitset") {
    return std::make_unique<Baseline>(
        ExecutorKind::multi_threaded, std::move(options), [](const PlacementParts& parts) {
          return std::make_unique<SharedPool>(parts, new_wait_set_loop);
        });
  }
  return std::make_unique<Baseline>(
      ExecutorKind::isolated, std::move(options), [](const PlacementParts& parts) {
        return std::make_unique<ThreadPerGroup>(parts, new_wait_set_loop);
      });
}

}  // namespace cie::executor
