#include "kernel_recording.hpp"

#include "error.hpp"
#include "kernel_events.hpp"
#include "kernel_record.h"

#include <cerrno>
#include <cstring>
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

}  // namespace

KernelRecording::KernelRecording(fs::path directory, std::unique_ptr<KernelSource> source,
                                 std::chrono::milliseconds flush_interval)
    : directory_(std::move(directory)),
      flush_interval_(flush_interval),
      source_(std::move(source)),
      uuid_(random_uuid()),
      clock_(measured_clock()),
      stop_(eventfd(0, EFD_CLOEXEC)) {
  if (!stop_.is_open()) throw system_error("cannot create an eventfd", errno);
  std::error_code error;
  fs::create_directory(directory_, error);
  if (error) throw system_error("cannot create " + in_quotes(directory_), error.value());
  write_metadata();
  const std::uint64_t begin = clock_ns(CLOCK_MONOTONIC);
  source_->start();
  for (const std::uint32_t number : source_->cpus()) {
    cpus_.emplace_back(
        CtfStream(directory_ / ("sched_" + std::to_string(number)), uuid_, number, begin));
  }
}

KernelRecording::~KernelRecording() { stop_reading(); }

void KernelRecording::Cpu::on_event(std::uint64_t time, std::string_view event) {
  stream_.add(time, event);
  cie_sched_switch change{};
  if (event.size() != sizeof change) return;
  std::memcpy(&change, event.data(), sizeof change);
  if (change.header.id != CIE_SCHED_SWITCH) return;
  if (running_ >= 0 && running_ != change.prev.thread.tid) ++untold_switches_;
  running_ = change.next.thread.tid;
}

void KernelRecording::Cpu::on_loss(std::uint64_t time, std::uint64_t total) {
  stream_.lose(time, total);
  running_ = -1;
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
  for (std::size_t i = 0; i < cpus_.size(); ++i) {
    files.push_back({.fd = source_->descriptor(i), .events = POLLIN, .revents = 0});
  }
  while (files.front().revents == 0) {
    poll(files.data(), files.size(), static_cast<int>(flush_interval_.count()));
    for (std::size_t i = 0; i < cpus_.size(); ++i) {
      source_->drain(i, cpus_[i]);
      cpus_[i].stream().flush();
    }
  }
}

void KernelRecording::stop_reading() {
  if (!thread_.joinable()) return;
  const std::uint64_t one = 1;
  static_cast<void>(!write(stop_.get(), &one, sizeof one));
  thread_.join();
}

KernelSummary KernelRecording::finish() {
  source_->stop();
  const std::uint64_t end = clock_ns(CLOCK_MONOTONIC);
  stop_reading();
  if (!failure_.empty()) throw RecordError(failure_);
  KernelSummary summary{.route = std::string(source_->name())};
  for (std::size_t i = 0; i < cpus_.size(); ++i) {
    source_->drain(i, cpus_[i]);
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
