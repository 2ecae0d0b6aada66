// A recording that is divided into chunks while it goes on.
#pragma once

#include "keeping/keeping.hpp"
#include "keeping/rotation.hpp"
#include "keeping/tracing.hpp"
#include "kernel/kernel_recording.hpp"
#include "system/console.hpp"

#include <memory>

namespace cie::record {

class ChunksKeeping final : public Keeping {
 public:
  ChunksKeeping(const Options& options, Console& console) : tracing_(options, console) {}

  bool begin() override;
  void start_reading() override;
  void abandon() noexcept override;
  void poll(Target& target) override;
  void on_request(Target& target) override;
  Outcome finish(const std::optional<ExitStatus>& exit) override;

 private:
  void poll_rotation();
  void warn_of_silence();
  void settle_rotation();
  void end_rotation();

  Tracing tracing_;
  std::unique_ptr<KernelRecording> kernel_;  // null: no kernel events
  std::unique_ptr<Rotation> rotation_;       // null: not begun
  bool has_warned_of_silence_ = false;
};

}  // namespace cie::record
