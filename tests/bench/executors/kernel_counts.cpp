#include "kernel_counts.hpp"

#include <charconv>
#include <filesystem>
#include <fstream>
#include <string>

#include <linux/perf_event.h>
#include <sys/ioctl.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace bench {
namespace {

std::vector<pid_t> threads_of(pid_t process) {
  std::vector<pid_t> tids;
  const std::filesystem::path tasks{"/proc/" + std::to_string(process) + "/task"};
  for (const auto& entry : std::filesystem::directory_iterator{tasks}) {
    const std::string name = entry.path().filename();
    pid_t tid = 0;
    std::from_chars(name.data(), name.data() + name.size(), tid);
    tids.push_back(tid);
  }
  return tids;
}

std::optional<std::uint64_t> system_call_event() {
  for (const char* const root : {"/sys/kernel/tracing", "/sys/kernel/debug/tracing"}) {
    std::ifstream file{std::string{root} + "/events/raw_syscalls/sys_enter/id"};
    std::uint64_t id = 0;
    if (file >> id) return id;
  }
  return std::nullopt;
}

void open_counter(std::vector<int>& counters, pid_t tid, std::uint32_t type, std::uint64_t config) {
  perf_event_attr attributes{};
  attributes.size = sizeof attributes;
  attributes.type = type;
  attributes.config = config;
  attributes.disabled = 1;
  const long counter = syscall(SYS_perf_event_open, &attributes, tid, -1, -1, PERF_FLAG_FD_CLOEXEC);
  if (counter >= 0) counters.push_back(static_cast<int>(counter));
}

std::optional<std::uint64_t> sum(const std::vector<int>& counters) {
  if (counters.empty()) return std::nullopt;
  std::uint64_t total = 0;
  for (const int counter : counters) {
    std::uint64_t value = 0;
    if (read(counter, &value, sizeof value) == sizeof value) total += value;
  }
  return total;
}

}  // namespace

KernelCounter::KernelCounter(const std::vector<pid_t>& processes) {
  const auto event = system_call_event();
  for (const pid_t process : processes) {
    for (const pid_t tid : threads_of(process)) {
      if (event) open_counter(system_calls_, tid, PERF_TYPE_TRACEPOINT, *event);
      open_counter(context_switches_, tid, PERF_TYPE_SOFTWARE, PERF_COUNT_SW_CONTEXT_SWITCHES);
      open_counter(cpu_time_, tid, PERF_TYPE_SOFTWARE, PERF_COUNT_SW_TASK_CLOCK);
    }
  }
  for (const auto* counters : {&system_calls_, &context_switches_, &cpu_time_}) {
    for (const int counter : *counters)
      ioctl(counter, PERF_EVENT_IOC_ENABLE, 0);
  }
}

KernelCounter::~KernelCounter() {
  for (const auto* counters : {&system_calls_, &context_switches_, &cpu_time_}) {
    for (const int counter : *counters)
      close(counter);
  }
}

KernelCounts KernelCounter::stop() {
  for (const auto* counters : {&system_calls_, &context_switches_, &cpu_time_}) {
    for (const int counter : *counters)
      ioctl(counter, PERF_EVENT_IOC_DISABLE, 0);
  }
  return {.system_calls = sum(system_calls_),
          .context_switches = sum(context_switches_),
          .cpu_ns = sum(cpu_time_).value_or(0)};
}

}  // namespace bench
