#include "kernel_recording.hpp"

#include "error.hpp"
#include "kernel_clock.hpp"

#include <utility>

namespace cie::record {

namespace fs = std::filesystem;

KernelRecording::KernelRecording(fs::path directory, std::unique_ptr<KernelSource> source,
                                 std::chrono::milliseconds flush_interval)
    : directory_(std::move(directory)),
      source_(std::move(source)),
      uuid_(random_uuid()),
      clock_(measured_clock()) {
  std::error_code error;
  fs::create_directory(directory_, error);
  if (error) throw system_error("cannot create " + in_quotes(directory_), error.value());
  write_kernel_metadata(directory_, uuid_, clock_);
  const std::uint64_t begin = monotonic_ns();
  source_->start();
  for (const std::uint32_t number : source_->cpus()) {
    cpus_.emplace_back(
        CtfStream(directory_ / ("sched_" + std::to_string(number)), uuid_, number, begin));
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
  if (has_clock_of_user_space_ || !find_clock(recording, directory_, clock_)) return;
  has_clock_of_user_space_ = true;
  write_kernel_metadata(directory_, uuid_, clock_);
}

KernelSummary KernelRecording::finish() {
  source_->stop();
  const std::uint64_t end = monotonic_ns();
  reader_->stop();
  KernelSummary summary{.route = std::string(source_->name())};
  for (std::size_t i = 0; i < cpus_.size(); ++i) {
    CtfStream& stream = cpus_[i].stream();
    stream.finish(end, source_->lost(i));
    summary.events += stream.events();
    summary.lost_events += stream.lost();
    summary.untold_switches += cpus_[i].untold_switches();
    if (stream.events() > 0) ++summary.streams;
  }
  return summary;
}

}  // namespace cie::record
