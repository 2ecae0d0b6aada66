// Each callback's longest run, noted while a trace is read.
#pragma once

#include <cie/analysis/instance.hpp>
#include <cie/viewer_export/verify_writers.hpp>

#include <optional>
#include <vector>

namespace cie::cli {

// By response times, or what is certain of them where they are not known.
class WorstRuns final : public analysis::Observer {
 public:
  void on_instance(const analysis::Instance& instance) override;
  // Of callbacks that had a complete instance.
  std::vector<viewer_export::WorstRun> take() &&;

 private:
  std::vector<std::optional<viewer_export::WorstRun>> runs_;  // by CallbackIndex
};

}  // namespace cie::cli
