// Where the scheduler's events of a recording come from.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

namespace cie::record {

// Takes the events of one CPU in order of time. What it throws comes out of KernelSource::drain().
class KernelEventSink {
 public:
  virtual ~KernelEventSink() = default;
  // `event` as it stands in the recording (kernel_record.h); valid during the call.
  virtual void on_event(std::uint64_t time, std::string_view event) = 0;
  // Events between the last one and `time` were lost: `total` on this CPU so far.
  virtual void on_loss(std::uint64_t time, std::uint64_t total) = 0;
  // The buffer is empty for the moment.
  virtual void on_drained() {}
};

// A buffer for each CPU, in the kernel. One thread at a time.
class KernelSource {
 public:
  virtual ~KernelSource() = default;
  virtual std::string_view name() const = 0;
  // The CPUs by their numbers; what follows takes a place in this list.
  virtual const std::vector<std::uint32_t>& cpus() const = 0;
  // Readable when a quarter of the CPU's buffer is full.
  virtual int descriptor(std::size_t cpu) const = 0;
  // From now on events collect; from now on none do.
  virtual void start() = 0;
  virtual void stop() = 0;
  // Empties the CPU's buffer of what is in it by now. Throws RecordError.
  virtual void drain(std::size_t cpu, KernelEventSink& sink) = 0;
  // How many events this CPU's buffer lost, told or not yet.
  virtual std::uint64_t lost(std::size_t cpu) const = 0;
};

// best: BPF where this kernel and user can, else tracefs.
enum class KernelRoute { best, bpf, tracefs };

// Buffers of `buffer_size` bytes, nothing collected yet. Removes what killed recorders left in
// tracefs. Throws KernelUnavailable if this kernel or user cannot, RecordError for the rest; leaves
// nothing behind in the kernel then, nor when it is destroyed.
std::unique_ptr<KernelSource> open_kernel_source(KernelRoute route, std::uint64_t buffer_size);

// An instance of the kernel's own tracing; full buffers overwrite the oldest events.
std::unique_ptr<KernelSource> open_tracefs_source(std::uint64_t buffer_size);
// BPF programs at the same tracepoints; full buffers drop the newest events. On some virtual
// machines it sees switches that tracing misses.
std::unique_ptr<KernelSource> open_bpf_source(std::uint64_t buffer_size);

}  // namespace cie::record
