// Records the scheduler of the whole machine beside a session of LTTng-UST, on the same clock.
#pragma once

#include "ctf_stream.hpp"
#include "file_descriptor.hpp"
#include "kernel_events.hpp"
#include "tracefs.hpp"

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace cie::record {

// What came of it.
struct KernelSummary {
  std::uint64_t events = 0;       // recorded
  std::uint64_t lost_events = 0;  // overwritten before they were read, or dropped by the kernel
  // Switches that the kernel did not tell although no buffer overran: the thread that leaves a CPU
  // is not the one that entered it last.
  std::uint64_t untold_switches = 0;
  std::uint64_t streams = 0;  // CPUs that recorded anything
};

class KernelRecording {
 public:
  // Switches the events on; they collect in the kernel's buffers, `buffer_size` bytes for each CPU.
  // `directory` is created for the trace. Throws KernelUnavailable if this kernel or user cannot,
  // RecordError for the rest; leaves nothing behind then.
  KernelRecording(std::filesystem::path directory, std::uint64_t buffer_size,
                  std::chrono::milliseconds flush_interval);
  // Switches everything off; what was not written is lost if finish() was not called.
  ~KernelRecording();
  KernelRecording(const KernelRecording&) = delete;
  KernelRecording& operator=(const KernelRecording&) = delete;

  // Starts the thread that empties the buffers. Apart from the constructor, so that a command can
  // be started in between, from a process of one thread.
  void start_reading();

  // Takes over the clock of the user-space trace below `recording` once its metadata is there.
  void adopt_clock(const std::filesystem::path& recording);

  // Stops, empties the buffers, completes the files. Throws RecordError if anything could not be
  // written.
  KernelSummary finish();

 private:
  struct Cpu {
    std::string directory;  // in tracefs
    FileDescriptor pipe;    // trace_pipe_raw
    CtfStream stream;
    std::int32_t running = -1;  // next_tid of the last switch; -1: not known
  };

  void prepare_events();
  void open_cpus(std::uint64_t begin);
  void write_metadata() const;
  void read_loop();
  void drain(Cpu& cpu);
  void consume_page(Cpu& cpu, std::span<std::byte> bytes);
  std::uint64_t lost_by_the_kernel(const Cpu& cpu) const;
  void stop_reading();

  std::filesystem::path directory_;
  std::chrono::milliseconds flush_interval_;
  Tracefs tracefs_;
  TraceInstance instance_;
  TraceUuid uuid_;
  TraceClock clock_;
  bool has_clock_of_user_space_ = false;
  KernelEventEncoder encoder_;
  RingBufferPage page_;
  std::vector<std::byte> bytes_;  // one page
  std::string event_;             // being encoded
  std::vector<Cpu> cpus_;
  std::uint64_t untold_switches_ = 0;
  FileDescriptor stop_;  // an eventfd
  std::string failure_;  // of the thread; read after it ended
  std::thread thread_;
};

}  // namespace cie::record
