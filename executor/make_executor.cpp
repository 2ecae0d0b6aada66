#include <cie/executor/executor.hpp>

#include "baselines/baselines.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace cie {

std::unique_ptr<Executor> make_executor(std::string_view name, ExecutorOptions options) {
  if (std::ranges::find(kExecutorNames, name) == kExecutorNames.end()) {
    throw std::invalid_argument{"there is no executor \"" + std::string{name} + "\""};
  }
  if (name.ends_with("-waitset")) return executor::make_baseline(name, std::move(options));
  if (name == "single") return std::make_unique<SingleThreadedExecutor>(std::move(options));
  if (name == "multi") return std::make_unique<MultiThreadedExecutor>(std::move(options));
  if (name == "events") return std::make_unique<EventsExecutor>(std::move(options));
  return std::make_unique<CallbackIsolatedExecutor>(std::move(options));
}

}  // namespace cie
