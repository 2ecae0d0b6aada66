#include "kernel_recording.hpp"

#include "error.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <ctime>
#include <fstream>
#include <iterator>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <sys/eventfd.h>
#include <unistd.h>

namespace cie::record {
namespace {

namespace fs = std::filesystem;

// The thread wakes when a quarter of a buffer is full, or when it is time to write to the disk.
constexpr const char* kWakeAtPercent = "25";

std::uint64_t clock_ns(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return static_cast<std::uint64_t>(time.tv_sec) * 1'000'000'000 +
         static_cast<std::uint64_t>(time.tv_nsec);
}

std::string read_all(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

TraceClock measured_clock() {
  TraceClock clock{.uuid = read_all("/proc/sys/kernel/random/boot_id"),
                   .offset_ns = clock_ns(CLOCK_REALTIME) - clock_ns(CLOCK_MONOTONIC)};
  while (!clock.uuid.empty() && clock.uuid.back() == '\n')
    clock.uuid.pop_back();
  return clock;
}

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

}  // namespace

KernelRecording::KernelRecording(fs::path directory, std::uint64_t buffer_size,
                                 std::chrono::milliseconds flush_interval)
    : directory_(std::move(directory)),
      flush_interval_(flush_interval),
      instance_(tracefs_),
      uuid_(random_uuid()),
      clock_(measured_clock()),
      bytes_(static_cast<std::size_t>(sysconf(_SC_PAGESIZE))),
      stop_(eventfd(0, EFD_CLOEXEC)) {
  if (!stop_.is_open()) throw system_error("cannot create an eventfd", errno);
  instance_.write("tracing_on", "0");
  try {
    instance_.write("trace_clock", "mono");  // CLOCK_MONOTONIC, as LTTng-UST uses it
  } catch (const RecordError&) {
    throw KernelUnavailable(
        "this kernel's tracing has no clock \"mono\": it needs Linux 4.1 or later");
  }
  instance_.write("buffer_size_kb", std::to_string(std::max<std::uint64_t>(buffer_size >> 10, 1)));
  // Names stand in the events: no need to fill the cache of names that all tracers share.
  for (const auto& [file, value] :
       {std::pair{"options/record-cmd", "0"}, std::pair{"options/overwrite", "1"},
        std::pair{"buffer_percent", kWakeAtPercent}}) {
    if (tracefs_.has(instance_.path(file))) instance_.write(file, value);
  }
  prepare_events();
  std::error_code error;
  fs::create_directory(directory_, error);
  if (error) throw system_error("cannot create " + in_quotes(directory_), error.value());
  write_metadata();
  const std::uint64_t begin = clock_ns(CLOCK_MONOTONIC);
  instance_.write("tracing_on", "1");
  open_cpus(begin);
}

KernelRecording::~KernelRecording() {
  stop_reading();
  try {
    instance_.write("tracing_on", "0");
    instance_.write("events/enable", "0");
  } catch (const RecordError&) {  // removing the instance does the same
  }
}

void KernelRecording::prepare_events() {
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

void KernelRecording::open_cpus(std::uint64_t begin) {
  for (const std::string& name : tracefs_.list(instance_.path("per_cpu"))) {
    std::uint32_t number = 0;
    const std::string digits = name.starts_with("cpu") ? name.substr(3) : "";
    const auto [rest, error] =
        std::from_chars(digits.data(), digits.data() + digits.size(), number);
    if (error != std::errc{} || rest != digits.data() + digits.size()) continue;
    const std::string directory = instance_.path("per_cpu/" + name);
    cpus_.push_back(
        Cpu{.directory = directory,
            .pipe = tracefs_.open(directory + "/trace_pipe_raw", O_RDONLY | O_NONBLOCK),
            .stream = CtfStream(directory_ / ("sched_" + digits), uuid_, number, begin)});
  }
}

// Whole or not at all: a reader may look at any time.
void KernelRecording::write_metadata() const {
  const fs::path file = directory_ / "metadata";
  const fs::path draft = directory_ / ".metadata.part";
  std::ofstream stream(draft, std::ios::binary);
  stream << kernel_metadata(uuid_, clock_);
  stream.close();
  if (!stream) throw system_error("cannot write " + in_quotes(file), errno);
  fs::rename(draft, file);
}

void KernelRecording::adopt_clock(const fs::path& recording) {
  if (has_clock_of_user_space_) return;
  std::error_code ignored;  // directories come and go while LTTng works
  for (auto entry = fs::recursive_directory_iterator(recording, ignored);
       entry != fs::recursive_directory_iterator(); entry.increment(ignored)) {
    if (ignored) return;
    const fs::path& file = entry->path();
    if (file.filename() != "metadata" || file.parent_path() == directory_) continue;
    if (read_clock(read_all(file), clock_)) {
      has_clock_of_user_space_ = true;
      write_metadata();
      return;
    }
  }
}

void KernelRecording::start_reading() {
  thread_ = std::thread([this] {
    try {
      read_loop();
    } catch (const std::exception& error) {
      failure_ = error.what();
    }
  });
}

void KernelRecording::read_loop() {
  // Whatever the recorder was started as: it must not keep the threads it records from running.
  const sched_param ordinary{};
  sched_setscheduler(0, SCHED_OTHER, &ordinary);
  pthread_setname_np(pthread_self(), "cie-kernel");
  std::vector<pollfd> files{{.fd = stop_.get(), .events = POLLIN, .revents = 0}};
  for (const Cpu& cpu : cpus_) {
    files.push_back({.fd = cpu.pipe.get(), .events = POLLIN, .revents = 0});
  }
  while (files.front().revents == 0) {
    poll(files.data(), files.size(), static_cast<int>(flush_interval_.count()));
    for (Cpu& cpu : cpus_) {
      drain(cpu);
      cpu.stream.flush();
    }
  }
}

void KernelRecording::drain(Cpu& cpu) {
  // Events that come while it reads may wait: a busy CPU would never let it go.
  constexpr int kMaxPages = 1 << 16;
  for (int pages = 0; pages < kMaxPages; ++pages) {
    const ssize_t size = read(cpu.pipe.get(), bytes_.data(), bytes_.size());
    if (size < 0 && errno == EINTR) continue;
    if (size < 0 && errno != EAGAIN) {
      throw system_error("cannot read the kernel's buffer " + in_quotes(cpu.directory), errno);
    }
    if (size <= 0) return;
    consume_page(cpu, bytes_);
  }
}

void KernelRecording::consume_page(Cpu& cpu, std::span<std::byte> bytes) {
  page_.load(bytes);
  bool is_loss_to_tell = page_.has_missed();
  while (const auto record = page_.next()) {
    if (is_loss_to_tell) {
      is_loss_to_tell = false;
      const std::uint64_t so_far = cpu.stream.lost();
      const auto count = page_.missed_count();
      cpu.stream.lose(record->time,
                      count ? so_far + *count : std::max(so_far + 1, lost_by_the_kernel(cpu)));
      cpu.running = -1;
    }
    event_.clear();
    const auto encoded = encoder_.encode(*record, event_);
    if (!encoded) continue;
    cpu.stream.add(record->time, event_);
    if (encoded->next_tid) {
      if (cpu.running >= 0 && cpu.running != *encoded->prev_tid) ++untold_switches_;
      cpu.running = *encoded->next_tid;
    }
  }
}

std::uint64_t KernelRecording::lost_by_the_kernel(const Cpu& cpu) const {
  const std::string stats = tracefs_.read(cpu.directory + "/stats");
  return number_after(stats, "overrun:") + number_after(stats, "commit overrun:") +
         number_after(stats, "dropped events:");
}

void KernelRecording::stop_reading() {
  if (!thread_.joinable()) return;
  const std::uint64_t one = 1;
  static_cast<void>(!write(stop_.get(), &one, sizeof one));
  thread_.join();
}

KernelSummary KernelRecording::finish() {
  instance_.write("tracing_on", "0");
  const std::uint64_t end = clock_ns(CLOCK_MONOTONIC);
  stop_reading();
  if (!failure_.empty()) throw RecordError(failure_);
  KernelSummary summary;
  for (Cpu& cpu : cpus_) {
    drain(cpu);
    cpu.stream.finish(end, lost_by_the_kernel(cpu));
    summary.events += cpu.stream.events();
    summary.lost_events += cpu.stream.lost();
    if (cpu.stream.events() > 0) ++summary.streams;
  }
  summary.untold_switches = untold_switches_;
  return summary;
}

}  // namespace cie::record
