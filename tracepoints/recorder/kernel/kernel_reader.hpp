// Empties a source's buffers in a thread, while what it found is looked at in another one.
#pragma once

#include "base/file_descriptor.hpp"
#include "kernel/kernel_source.hpp"

#include <chrono>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace cie::record {

class KernelReader {
 public:
  // `source` and `sinks`, one for each of its CPUs, are borrowed. Buffers are emptied when they are
  // a quarter full, and every `interval`. Throws RecordError.
  KernelReader(KernelSource& source, std::vector<KernelEventSink*> sinks,
               std::chrono::milliseconds interval);
  ~KernelReader();
  KernelReader(const KernelReader&) = delete;
  KernelReader& operator=(const KernelReader&) = delete;

  // Starts the thread.
  void start();
  // Empties the buffers of what is in them by now, and calls `look` before anything more comes.
  // Throws RecordError: also what the thread ended with.
  void drain(const std::function<void()>& look);
  // Ends the thread, and empties the buffers. Throws as drain() does.
  void stop();

 private:
  void read_loop();
  void drain_all();
  void end_thread();

  KernelSource& source_;
  std::vector<KernelEventSink*> sinks_;
  std::chrono::milliseconds interval_;
  FileDescriptor stop_;  // an eventfd
  std::mutex mutex_;     // held while the source or a sink is used
  std::string failure_;  // of the thread
  std::thread thread_;
};

}  // namespace cie::record
