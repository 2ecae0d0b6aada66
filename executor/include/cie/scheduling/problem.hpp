// What can be wrong with the parameters of a thread.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

namespace cie {

// A thread does not run as the spec says, or an id of the spec is nobody's.
struct SchedulingProblem {
  std::string file{};    // the spec's name
  int line = 0;          // 1-based; of the entry
  std::string entry{};   // its id
  std::string thread{};  // empty: it is about the spec alone
  int error = 0;  // errno of the refused request; 0: accepted, but another value was read back
  std::string reason{};  // in words, with the remedy
  // An audit found it: the thread ran as asked, until somebody else changed it.
  bool is_from_outside = false;
  // Nothing has the entry's id when spinning begins, and it was probably meant to be another one: a
  // warning, under OnError::refuse too. A node that is added later may still have it.
  bool is_misspelt = false;

  // "demo.yaml:12: \"/lidar@Timer(100000000)\": cannot set SCHED_FIFO 80: … ".
  std::string text() const;
};

// Thrown under OnError::refuse: by spin() and add_node() before any callback of the threads
// concerned runs, by reload_spec() after everything is as it was.
class SchedulingRefused : public std::runtime_error {
 public:
  explicit SchedulingRefused(std::vector<SchedulingProblem> problems);
  const std::vector<SchedulingProblem>& problems() const noexcept { return problems_; }

 private:
  std::vector<SchedulingProblem> problems_;
};

}  // namespace cie
