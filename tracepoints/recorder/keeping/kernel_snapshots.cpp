#include "keeping/kernel_snapshots.hpp"

#include "kernel/kernel_clock.hpp"

#include <string>
#include <utility>

namespace cie::record {
namespace {

// Of the scheduler's events in memory, on average (34 to 66).
constexpr std::uint64_t kBytesPerKernelEvent = 56;

// What a ring replays, as a stream of a trace.
class Writer final : public KernelEventSink {
 public:
  explicit Writer(CtfStream& stream) : stream_(stream) {}
  void on_event(std::uint64_t time, std::string_view event) override {
    stream_.add(time, event);
    check_.on_event(event);
  }
  void on_loss(std::uint64_t time, std::uint64_t total) override {
    stream_.lose(time, total);
    check_.on_loss();
  }
  std::uint64_t untold_switches() const noexcept { return check_.untold(); }

 private:
  CtfStream& stream_;
  SwitchCheck check_;
};

}  // namespace

std::uint64_t KernelSnapshots::most_bytes_per_cpu(const Options& options) {
  const SnapshotOptions& snapshot = options.snapshot.value();
  const double seconds = std::chrono::duration<double>(snapshot.length).count();
  return static_cast<std::uint64_t>(seconds * static_cast<double>(snapshot.event_rate) *
                                    static_cast<double>(kBytesPerKernelEvent));
}

KernelSnapshots::KernelSnapshots(std::unique_ptr<KernelSource> source, const Options& options)
    : source_(std::move(source)) {
  const std::uint64_t begin = monotonic_ns();
  rings_.assign(source_->cpus().size(),
                KernelRing(options.snapshot.value().length, most_bytes_per_cpu(options), begin));
  std::vector<KernelEventSink*> sinks;
  sinks.reserve(rings_.size());
  for (KernelRing& ring : rings_)
    sinks.push_back(&ring);
  reader_ = std::make_unique<KernelReader>(*source_, std::move(sinks), options.flush_interval);
  source_->start();
}

RecordedKernel KernelSnapshots::save(const Directory& snapshot) {
  const Directory directory = snapshot.make_below(kKernelDirectory);
  TraceClock clock = measured_clock();
  find_clock(snapshot.path(), directory.path(), clock);
  const TraceUuid uuid = random_uuid();
  write_kernel_metadata(directory, uuid, clock, source_->name());
  RecordedKernel summary;
  summary.route = source_->name();
  std::uint64_t events = 0;
  const std::uint64_t end =
      monotonic_ns();  // what comes later may still be in the kernel's buffers
  reader_->drain([&] {
    for (std::size_t i = 0; i < rings_.size(); ++i) {
      const std::uint32_t cpu = source_->cpus()[i];
      CtfStream stream(directory, uuid, cpu, rings_[i].begin());
      Writer writer(stream);
      rings_[i].replay(writer);
      stream.finish(end, rings_[i].lost_since_begin(source_->lost(i)));
      events += stream.events();
      summary.lost_events += stream.lost();
      summary.untold_switches += writer.untold_switches();
      if (stream.events() > 0) ++summary.streams;
    }
  });
  summary.events = events;
  return summary;
}

}  // namespace cie::record
