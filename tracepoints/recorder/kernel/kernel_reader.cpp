#include "kernel/kernel_reader.hpp"

#include "system/error.hpp"

#include <cerrno>
#include <cstdint>
#include <utility>

#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <sys/eventfd.h>
#include <unistd.h>

namespace cie::record {

KernelReader::KernelReader(KernelSource& source, std::vector<KernelEventSink*> sinks,
                           std::chrono::milliseconds interval)
    : source_(source),
      sinks_(std::move(sinks)),
      interval_(interval),
      stop_(eventfd(0, EFD_CLOEXEC)) {
  if (!stop_.is_open()) throw system_error("cannot create an eventfd", errno);
}

KernelReader::~KernelReader() { end_thread(); }

void KernelReader::start() {
  thread_ = std::thread([this] { read_loop(); });
}

void KernelReader::read_loop() {
  // Whatever the recorder was started as: it must not keep the threads it records from running.
  const sched_param ordinary{};
  sched_setscheduler(0, SCHED_OTHER, &ordinary);
  pthread_setname_np(pthread_self(), "cie-kernel");
  std::vector<pollfd> files{{.fd = stop_.get(), .events = POLLIN, .revents = 0}};
  for (std::size_t i = 0; i < sinks_.size(); ++i) {
    files.push_back({.fd = source_.descriptor(i), .events = POLLIN, .revents = 0});
  }
  while (files.front().revents == 0) {
    poll(files.data(), files.size(), static_cast<int>(interval_.count()));
    const std::lock_guard lock(mutex_);
    try {
      drain_all();
    } catch (const std::exception& error) {
      failure_ = error.what();
      return;
    }
  }
}

void KernelReader::drain_all() {
  for (std::size_t i = 0; i < sinks_.size(); ++i) {
    source_.drain(i, *sinks_[i]);
    sinks_[i]->on_drained();
  }
}

void KernelReader::drain(const std::function<void()>& look) {
  const std::lock_guard lock(mutex_);
  if (!failure_.empty()) throw RecordError(failure_);
  drain_all();
  look();
}

void KernelReader::end_thread() {
  if (!thread_.joinable()) return;
  const std::uint64_t one = 1;
  static_cast<void>(!write(stop_.get(), &one, sizeof one));
  thread_.join();
}

void KernelReader::stop() {
  end_thread();
  drain([] {});
}

}  // namespace cie::record
