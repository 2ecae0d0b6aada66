// One recording, written into a directory as it goes on.
#pragma once

#include "keeping/keeping.hpp"
#include "keeping/tracing.hpp"
#include "kernel/kernel_recording.hpp"
#include "system/console.hpp"

#include <memory>

namespace cie::record {

class DirectoryKeeping final : public Keeping {
 public:
  DirectoryKeeping(const Options& options, Console& console) : tracing_(options, console) {}

  bool begin() override;
  void start_reading() override;
  void abandon() noexcept override;
  void poll(Target& target) override;
  void on_request(Target& target) override;
  Outcome finish(const std::optional<ExitStatus>& exit) override;

 private:
  void check_files();

  Tracing tracing_;
  std::unique_ptr<KernelRecording> kernel_;  // null: no kernel events
};

}  // namespace cie::record
