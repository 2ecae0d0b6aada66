// Every kind of executor, for tests of what they have in common.
#pragma once

#include <cie/executor/executor.hpp>

#include <memory>
#include <utility>

#include <gtest/gtest.h>

namespace cie::test {

enum class Kind { isolated, single, events, multi };

inline std::unique_ptr<Executor> make_executor(Kind kind, ExecutorOptions options = {}) {
  if (options.threads == 0) options.threads = 2;
  switch (kind) {
    case Kind::isolated:
      return std::make_unique<CallbackIsolatedExecutor>(std::move(options));
    case Kind::single:
      return std::make_unique<SingleThreadedExecutor>(std::move(options));
    case Kind::events:
      return std::make_unique<EventsExecutor>(std::move(options));
    default:
      return std::make_unique<MultiThreadedExecutor>(std::move(options));
  }
}

inline auto every_executor() {
  return testing::Values(Kind::isolated, Kind::single, Kind::events, Kind::multi);
}

inline const char* name_of(const testing::TestParamInfo<Kind>& parameter) {
  switch (parameter.param) {
    case Kind::isolated:
      return "Isolated";
    case Kind::single:
      return "Single";
    case Kind::events:
      return "Events";
    default:
      return "Multi";
  }
}

}  // namespace cie::test
