// What Prometheus scrapes: the text exposition format, version 0.0.4.
#pragma once

#include "snapshot.hpp"

#include <cstdint>
#include <map>
#include <string>

namespace cie::live {

// Counts what a single snapshot does not hold, and writes the metrics. Not thread-safe.
class Metrics {
 public:
  // Every snapshot, in order.
  void add(const Snapshot& snapshot);
  // Of the last snapshot added. Names and labels: README.md of this folder.
  std::string text() const;

 private:
  struct Violations {
    std::string name;
    std::uint64_t current = 0;  // subjects that violate the rule now
    std::uint64_t total = 0;    // times that one became a violation
  };
  void keep_counts_of_what_is_gone(const Snapshot& next);

  Snapshot latest_;
  std::map<std::string, CallbackView> gone_;  // their sums, by the labels of a series that is there
  std::map<std::string, Violations> violations_;  // by rule
};

}  // namespace cie::live
