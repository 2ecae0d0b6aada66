// For ends, of which every step is tried whatever became of the one before: a partial recording is
// worth keeping.
#pragma once

#include <cie/tracepoints/recording_manifest.hpp>

#include <exception>
#include <string>
#include <vector>

namespace cie::record {

// Adds what went wrong in `step` to the problems, once.
template <typename Step>
void attempt(std::vector<std::string>& problems, const Step& step) {
  try {
    step();
  } catch (const std::exception& error) {
    add_problem(problems, error.what());
  }
}

}  // namespace cie::record
