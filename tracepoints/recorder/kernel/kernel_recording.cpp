#include "kernel/kernel_recording.hpp"

#include "kernel/kernel_clock.hpp"

#include <utility>

namespace cie::record {

namespace fs = std::filesystem;

KernelRecording::KernelRecording(Directory directory, std::unique_ptr<KernelSource> source,
                                 std::chrono::milliseconds flush_interval)
    : directory_(std::move(directory)),
      source_(std::move(source)),
      uuid_(random_uuid()),
      clock_(measured_clock()) {
  write_kernel_metadata(directory_, uuid_, clock_, source_->name());
  const std::uint64_t begin = monotonic_ns();
  source_->start();
  for (const std::uint32_t number : source_->cpus()) {
    cpus_.emplace_back(CtfStream(directory_, uuid_, number, begin));
  }
  std::vector<KernelEventSink*> sinks;
  sinks.reserve(cpus_.size());
  for (Cpu& cpu : cpus_)
    sinks.push_back(&cpu);
  reader_ = std::make_unique<KernelReader>(*source_, std::move(sinks), flush_interval);
}

void KernelRecording::Cpu::on_event(std::uint64_t time, std::string_view event) {
  stream_.add(time, event);
  check_.on_event(event);
}

void KernelRecording::Cpu::on_loss(std::uint64_t time, std::uint64_t total) {
  stream_.lose(time, total);
  check_.on_loss();
}

void KernelRecording::adopt_clock(const fs::path& recording) {
  if (has_clock_of_user_space_ || !find_clock(recording, directory_.path(), clock_)) return;
  has_clock_of_user_space_ = true;
  write_kernel_metadata(directory_, uuid_, clock_, source_->name());
}

void KernelRecording::go_on_in(Directory directory) {
  write_kernel_metadata(directory, uuid_, clock_, source_->name());
  // Each file ends with its CPU's last event: what comes between that and now is still in the kernel's
  // buffers. An empty packet would say no more, and begin when the next file does: babeltrace2, which
  // joins a stream's files by the times at which their packets begin, would read it behind that file's
  // first packet, and stop.
  reader_->drain([&] {
    directory_ = std::move(directory);
    for (Cpu& cpu : cpus_)
      cpu.stream().go_on();
  });
}

RecordedKernel KernelRecording::finish() {
  source_->stop();
  const std::uint64_t end = monotonic_ns();
  reader_->stop();
  for (std::size_t i = 0; i < cpus_.size(); ++i) {
    cpus_[i].stream().finish(end, source_->lost(i));
  }
  return summary();
}

RecordedKernel KernelRecording::summary() const {
  RecordedKernel summary;
  summary.route = source_->name();
  std::uint64_t events = 0;
  for (const Cpu& cpu : cpus_) {
    events += cpu.stream().events();
    summary.lost_events += cpu.stream().lost();
    summary.untold_switches += cpu.untold_switches();
    if (cpu.stream().events() > 0) ++summary.streams;
  }
  summary.events = events;
  return summary;
}

}  // namespace cie::record
