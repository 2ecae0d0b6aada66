// Runs of a timer, and a spec of what they have to keep.
#pragma once

#include "support/verdicts.hpp"

#include <string>

namespace cie::test {

inline std::string spec(const std::string& bounds) {
  return "callback_groups:\n  - id: fusion\n    " + bounds + "\n";
}

// Response times 5 and 8, durations 3 and 6, inter-arrival time 10.
inline constexpr const char* kTwoRuns = R"(
  callback fusion timer period=10
  12 start fusion release=10
  15 end fusion
  22 start fusion release=20
  28 end fusion)";

inline void drop_first_instance(TextTrace& trace) {
  trace.erase<analysis::CallbackStart>(
      [](const analysis::CallbackStart& e, const analysis::EventHead&) { return e.seq == 0; });
  trace.erase<analysis::CallbackEnd>(
      [](const analysis::CallbackEnd& e, const analysis::EventHead&) { return e.seq == 0; });
}

}  // namespace cie::test
