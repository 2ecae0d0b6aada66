// A set of points in time, kept as windows that neither overlap nor touch. Insertion and search are logarithmic.
#pragma once

#include "cie/analysis/time.hpp"

#include <map>
#include <optional>

namespace cie::analysis {

class Windows {
 public:
  // An empty window (its end before its begin) adds nothing.
  void add(TimeWindow window);

  // The end of the window that has this point in it.
  std::optional<Timestamp> end_of_window_at(Timestamp time) const noexcept;

  bool empty() const noexcept { return ends_.empty(); }

 private:
  std::map<Timestamp, Timestamp> ends_;  // by begin
};

}  // namespace cie::analysis
