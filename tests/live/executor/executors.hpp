// Every kind of executor, for tests of what they have in common.
#pragma once

#include <cie/executor/executor.hpp>

#include <cctype>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include <gtest/gtest.h>

namespace cie::test {

using Kind = std::string_view;  // of kExecutorNames

// Those of several threads have two.
inline std::unique_ptr<Executor> make(Kind kind, ExecutorOptions options = {}) {
  if (options.threads == 0) options.threads = 2;
  return make_executor(kind, std::move(options));
}

inline auto every_executor() { return testing::ValuesIn(kExecutorNames); }

// "SingleWaitset".
inline std::string name_of(const testing::TestParamInfo<Kind>& parameter) {
  std::string name;
  bool is_first = true;
  for (const char c : parameter.param) {
    if (c != '-') name += is_first ? static_cast<char>(std::toupper(c)) : c;
    is_first = c == '-';
  }
  return name;
}

}  // namespace cie::test
