// What a program costs: it runs in a child process.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace bench {

struct Cost {
  double cpu_s = 0;   // of all threads
  double wall_s = 0;  // until the process was gone
  double peak_mib = 0;
};

// Times and largest memory of a child and its own children. `child` does not return, or the child
// has failed. Throws std::runtime_error when it fails.
Cost measure(const std::function<void()>& child);
// The same of a program, whose standard output is nowhere.
Cost measure_program(std::vector<std::string> words);

}  // namespace bench
