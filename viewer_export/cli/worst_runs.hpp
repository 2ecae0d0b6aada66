// Each callback's longest run, noted while a trace is read.
#pragma once

#include <cie/analysis/instance.hpp>
#include <cie/viewer_export/verify_writers.hpp>

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <utility>
#include <vector>

namespace cie::cli {

// By response times, or what is certain of them where they are not known.
class WorstRuns final : public analysis::Observer {
 public:
  void on_instance(const analysis::Instance& instance) override;
  // Of callbacks that had a complete instance.
  std::vector<viewer_export::WorstRun> take() &&;

 private:
  struct Past {
    analysis::CallbackIndex callback{};
    analysis::Timestamp start;
    analysis::Timestamp end;
  };
  struct Pasts {
    std::deque<Past> runs;  // the latest few
    std::optional<analysis::Timestamp> forgotten_until{};
  };
  using Thread = std::pair<analysis::ProcessIndex, std::int64_t>;

  // Of what the instance's thread ran before it, that which took most of its start latency; empty if
  // that is less than half.
  std::optional<viewer_export::WorstRun::Behind> behind(const analysis::Instance& instance) const;

  void note(const analysis::Instance& instance);

  std::vector<std::optional<viewer_export::WorstRun>> runs_;  // by CallbackIndex
  std::map<Thread, Pasts> pasts_;
};

}  // namespace cie::cli
