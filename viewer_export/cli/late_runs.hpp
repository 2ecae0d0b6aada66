// How often callbacks missed their deadlines, counted while a trace is read.
#pragma once

#include <cie/analysis/instance.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>
#include <cie/viewer_export/verify_writers.hpp>

#include <optional>
#include <vector>

namespace cie::cli {

// As rule R3 judges: by the spec's deadline, else the callback's own, and by what is certain of a
// response time.
class LateRuns final : public analysis::Observer {
 public:
  // Borrows the spec, which may be null.
  explicit LateRuns(const SchedulingSpec* spec) : spec_(spec) {}

  void on_instance(const analysis::Instance& instance) override;
  // Of callbacks that have a deadline.
  std::vector<viewer_export::Lateness> take() &&;

 private:
  struct OfCallback {
    bool is_known = false;  // whether it has a deadline has been looked up
    std::optional<viewer_export::Lateness> lateness;
  };

  std::optional<viewer_export::Lateness> look_up(const analysis::Instance& instance) const;

  const SchedulingSpec* spec_;
  std::vector<OfCallback> callbacks_;  // by CallbackIndex
};

}  // namespace cie::cli
