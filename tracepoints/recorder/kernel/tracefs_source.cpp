#include "base/file_descriptor.hpp"
#include "base/text.hpp"
#include "kernel/kernel_events.hpp"
#include "kernel/kernel_source.hpp"
#include "kernel/tracefs.hpp"
#include "system/error.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <string>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

namespace cie::record {
namespace {

constexpr const char* kWakeAtPercent = "25";

std::string event_directory(std::string_view event) { return "events/sched/" + std::string(event); }

// "overrun: 12" in a stats file.
std::uint64_t number_after(const std::string& text, std::string_view label) {
  std::size_t at = text.starts_with(label) ? 0 : text.find('\n' + std::string(label));
  if (at == std::string::npos) return 0;
  at = text.find_first_of("0123456789", at);
  std::uint64_t number = 0;
  if (at != std::string::npos) std::from_chars(text.data() + at, text.data() + text.size(), number);
  return number;
}

class TracefsSource final : public KernelSource {
 public:
  explicit TracefsSource(std::uint64_t buffer_size)
      : instance_(tracefs_), bytes_(static_cast<std::size_t>(sysconf(_SC_PAGESIZE))) {
    instance_.write("tracing_on", "0");
    try {
      instance_.write("trace_clock", "mono");  // CLOCK_MONOTONIC, as LTTng-UST uses it
    } catch (const RecordError&) {
      throw KernelUnavailable(
          "this kernel's tracing has no clock \"mono\": it needs Linux 4.1 or later");
    }
    instance_.write("buffer_size_kb",
                    std::to_string(std::max<std::uint64_t>(buffer_size >> 10, 1)));
    // Names stand in the events: no need to fill the cache of names that all tracers share.
    for (const auto& [file, value] :
         {std::pair{"options/record-cmd", "0"}, std::pair{"options/overwrite", "1"},
          std::pair{"buffer_percent", kWakeAtPercent}}) {
      if (tracefs_.has(instance_.path(file))) instance_.write(file, value);
    }
    prepare_events();
    open_cpus();
  }

  ~TracefsSource() override {
    try {
      stop();
      instance_.write("events/enable", "0");
    } catch (const RecordError&) {  // removing the instance does the same
    }
  }
  TracefsSource(const TracefsSource&) = delete;
  TracefsSource& operator=(const TracefsSource&) = delete;

  std::string_view name() const override { return "tracefs"; }
  const std::vector<std::uint32_t>& cpus() const override { return numbers_; }
  int descriptor(std::size_t cpu) const override { return cpus_[cpu].pipe.get(); }
  void start() override { instance_.write("tracing_on", "1"); }
  void stop() override { instance_.write("tracing_on", "0"); }

  void drain(std::size_t index, KernelEventSink& sink) override {
    Cpu& cpu = cpus_[index];
    // Events that come while it reads may wait: a busy CPU would never let it go.
    constexpr int kMaxPages = 1 << 16;
    for (int pages = 0; pages < kMaxPages; ++pages) {
      const ssize_t size = read(cpu.pipe.get(), bytes_.data(), bytes_.size());
      if (size < 0 && errno == EINTR) continue;
      if (size < 0 && errno != EAGAIN) {
        throw system_error("cannot read the kernel's buffer " + in_quotes(cpu.directory), errno);
      }
      if (size <= 0) return;
      consume_page(index, sink);
    }
  }

  std::uint64_t lost(std::size_t cpu) const override {
    const std::string stats = tracefs_.read(cpus_[cpu].directory + "/stats");
    return number_after(stats, "overrun:") + number_after(stats, "commit overrun:") +
           number_after(stats, "dropped events:");
  }

 private:
  struct Cpu {
    std::string directory;  // in tracefs
    FileDescriptor pipe;    // trace_pipe_raw
    std::uint64_t told_lost = 0;
  };

  void prepare_events() {
    for (const KernelEventClass& event_class : kernel_event_classes()) {
      const std::string directory = event_directory(event_class.name);
      const bool is_there = tracefs_.has(instance_.path(directory));
      if (!is_there && event_class.name == "sched_switch") {
        throw KernelUnavailable("this kernel has no tracepoint sched_switch");
      }
      if (!is_there) continue;  // e.g. no mutexes that inherit priorities
      encoder_.learn(event_class, tracefs_.read(instance_.path(directory + "/format")));
      instance_.write(directory + "/enable", "1");
    }
  }

  void open_cpus() {
    for (const std::string& name : tracefs_.list(instance_.path("per_cpu"))) {
      const auto number =
          parse_number<std::uint32_t>(name.starts_with("cpu") ? name.substr(3) : "");
      if (!number) continue;
      const std::string directory = instance_.path("per_cpu/" + name);
      numbers_.push_back(*number);
      cpus_.push_back(
          Cpu{.directory = directory,
              .pipe = tracefs_.open(directory + "/trace_pipe_raw", O_RDONLY | O_NONBLOCK)});
    }
  }

  void consume_page(std::size_t index, KernelEventSink& sink) {
    Cpu& cpu = cpus_[index];
    page_.load(bytes_);
    bool is_loss_to_tell = page_.has_missed();
    while (const auto record = page_.next()) {
      if (is_loss_to_tell) {
        is_loss_to_tell = false;
        const auto count = page_.missed_count();
        cpu.told_lost = count ? cpu.told_lost + *count : std::max(cpu.told_lost + 1, lost(index));
        sink.on_loss(record->time, cpu.told_lost);
      }
      event_.clear();
      if (encoder_.encode(*record, event_)) sink.on_event(record->time, event_);
    }
  }

  Tracefs tracefs_;
  TraceInstance instance_;
  KernelEventEncoder encoder_;
  RingBufferPage page_;
  std::vector<std::byte> bytes_;  // one page
  std::string event_;             // being encoded
  std::vector<Cpu> cpus_;
  std::vector<std::uint32_t> numbers_;
};

}  // namespace

std::unique_ptr<KernelSource> open_tracefs_source(std::uint64_t buffer_size) {
  return std::make_unique<TracefsSource>(buffer_size);
}

}  // namespace cie::record
