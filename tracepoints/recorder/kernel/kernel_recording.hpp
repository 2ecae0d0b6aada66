// Records the scheduler of the whole machine beside a session of LTTng-UST, on the same clock.
#pragma once

#include <cie/tracepoints/recording_manifest.hpp>

#include "kernel/ctf_stream.hpp"
#include "kernel/kernel_reader.hpp"
#include "kernel/kernel_source.hpp"
#include "kernel/switch_check.hpp"

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

namespace cie::record {

class KernelRecording {
 public:
  // Starts the source; events collect in its buffers. The trace is written into `directory`. Throws
  // RecordError or std::system_error.
  KernelRecording(Directory directory, std::unique_ptr<KernelSource> source,
                  std::chrono::milliseconds flush_interval);
  KernelRecording(const KernelRecording&) = delete;
  KernelRecording& operator=(const KernelRecording&) = delete;

  // Starts the thread that empties the buffers. Apart from the constructor, so that a command can
  // be started in between, from a process of one thread.
  void start_reading() { reader_->start(); }

  // Takes over the clock of the user-space trace below `recording` once its metadata is there.
  void adopt_clock(const std::filesystem::path& recording);

  // Writes what there is to the files, and goes on in `directory`. Losses that no event followed yet
  // are told there. Throws as finish() does.
  void go_on_in(Directory directory);

  // Stops, empties the buffers, completes the files. Throws RecordError or std::system_error if
  // anything could not be written.
  RecordedKernel finish();
  // What there is so far, in all directories. Not how large the buffers are.
  RecordedKernel summary() const;

 private:
  // One CPU's part of the trace.
  class Cpu final : public KernelEventSink {
   public:
    explicit Cpu(CtfStream stream) : stream_(std::move(stream)) {}
    void on_event(std::uint64_t time, std::string_view event) override;
    void on_loss(std::uint64_t time, std::uint64_t total) override;
    void on_drained() override { stream_.flush(); }
    CtfStream& stream() noexcept { return stream_; }
    const CtfStream& stream() const noexcept { return stream_; }
    std::uint64_t untold_switches() const noexcept { return check_.untold(); }

   private:
    CtfStream stream_;
    SwitchCheck check_;
  };

  Directory directory_;
  std::unique_ptr<KernelSource> source_;
  TraceUuid uuid_;
  TraceClock clock_;
  bool has_clock_of_user_space_ = false;
  std::vector<Cpu> cpus_;  // as the source lists them
  std::unique_ptr<KernelReader> reader_;
};

}  // namespace cie::record
