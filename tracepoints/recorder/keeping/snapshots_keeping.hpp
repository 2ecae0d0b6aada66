// A flight recorder: the last seconds are in memory, and saved when something happens.
#pragma once

#include "keeping/flight_recorder.hpp"
#include "keeping/keeping.hpp"
#include "keeping/tracing.hpp"
#include "system/console.hpp"

#include <memory>

namespace cie::record {

class SnapshotsKeeping final : public Keeping {
 public:
  SnapshotsKeeping(const Options& options, Console& console) : tracing_(options, console) {}

  bool begin() override;
  void start_reading() override;
  void abandon() noexcept override;
  void poll(Target& target) override;
  void on_request(Target& target) override;
  Outcome finish(const std::optional<ExitStatus>& exit) override;

 private:
  void state_cost();
  void look_at_flight();
  void tell(const SavedSnapshot& snapshot);
  void forget_processes();
  void save_at_the_end();

  Tracing tracing_;
  std::unique_ptr<FlightRecorder> flight_;  // null: not begun, or ended
};

}  // namespace cie::record
