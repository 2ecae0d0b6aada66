// Keeps the last events of the scheduler in memory, beside a session of LTTng-UST that does the
// same, and writes them when a snapshot is saved.
#pragma once

#include "base/directory.hpp"
#include "kernel/kernel_reader.hpp"
#include "kernel/kernel_recording.hpp"
#include "kernel/kernel_ring.hpp"
#include "options/options.hpp"

#include <cstdint>
#include <memory>
#include <vector>

namespace cie::record {

class KernelSnapshots {
 public:
  // Starts the source. Throws RecordError.
  KernelSnapshots(std::unique_ptr<KernelSource> source, const Options& options);
  KernelSnapshots(const KernelSnapshots&) = delete;
  KernelSnapshots& operator=(const KernelSnapshots&) = delete;

  // Bytes for each CPU that such options ask for at most.
  static std::uint64_t most_bytes_per_cpu(const Options& options);

  // As in KernelRecording.
  void start_reading() { reader_->start(); }
  // Writes SNAPSHOT/kernel, with the clock of the user-space trace below SNAPSHOT. Throws
  // RecordError or std::system_error.
  RecordedKernel save(const Directory& snapshot);

 private:
  std::unique_ptr<KernelSource> source_;
  std::vector<KernelRing> rings_;  // as the source lists the CPUs
  std::unique_ptr<KernelReader> reader_;
};

}  // namespace cie::record
