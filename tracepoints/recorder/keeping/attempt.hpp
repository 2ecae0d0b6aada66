// For ends, of which every step is tried whatever became of the one before: a partial recording is
// worth keeping.
#pragma once

#include <cie/tracepoints/recording_manifest.hpp>

#include <exception>
#include <string>
#include <utility>
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

// Adds what went wrong in several steps, each once.
inline void add_problems(std::vector<std::string>& problems, std::vector<std::string> more) {
  for (std::string& problem : more)
    add_problem(problems, std::move(problem));
}

}  // namespace cie::record
