#include "doctor.hpp"

#include <cie/analysis/analyzer.hpp>
#include <cie/tracepoints/recording_layout.hpp>
#include <cie/tracepoints/recording_manifest.hpp>

#include "commands.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace cie::cli {
namespace {

namespace fs = std::filesystem;

// Numbers of the kernel's (linux/capability.h).
constexpr unsigned kSysAdmin = 21;
constexpr unsigned kSysNice = 23;
constexpr unsigned kPerfmon = 38;
constexpr unsigned kBpf = 39;

// What `cie record` takes by default: the channels "state" and "events".
constexpr std::uint64_t kBuffersPerCpu =
    kStateSubbufSize * kStateSubbufs + kDefaultSubbufSize * kDefaultSubbufs;

Finding fine(std::string_view id, std::string what) {
  return {.id = id, .health = Health::ok, .what = std::move(what), .advice = {}};
}
Finding warning(std::string_view id, std::string what, std::string advice) {
  return {
      .id = id, .health = Health::warning, .what = std::move(what), .advice = std::move(advice)};
}
Finding problem(std::string_view id, std::string what, std::string advice) {
  return {
      .id = id, .health = Health::problem, .what = std::move(what), .advice = std::move(advice)};
}

Finding session_daemon(const Machine& machine) {
  constexpr std::string_view kId = "session-daemon";
  constexpr std::string_view kSocket = "/client-lttng-sessiond";  // of root's daemon
  constexpr std::string_view kUserSocket = "/.lttng/client-lttng-sessiond";
  std::vector<std::string> homes;
  bool is_roots = false;
  for (const auto& path : machine.listening_sockets()) {
    if (path.ends_with(kUserSocket)) {
      homes.push_back(path.substr(0, path.size() - kUserSocket.size()));
    } else if (path.ends_with(kSocket)) {
      is_roots = true;
    }
  }
  if (is_roots && !machine.is_root() && !machine.is_in_group("tracing")) {
    return warning(
        kId, "root's runs, and this user may not use it",
        "to record with it (cie record --attach): sudo usermod -aG tracing USER, and log "
        "in again");
  }
  if (is_roots && !homes.empty()) {
    return warning(kId, fmt::format("several run: root's, and in {}", fmt::join(homes, ", ")),
                   "an application registers with root's and with its own user's: say which with "
                   "LTTNG_HOME, or end those that nobody needs");
  }
  if (is_roots) return fine(kId, "root's runs");
  if (!homes.empty()) return fine(kId, fmt::format("runs, in {}", fmt::join(homes, ", ")));
  if (std::getenv("LTTNG_SESSIOND_PATH") == nullptr && !machine.has_program("lttng-sessiond")) {
    return problem(kId, "none runs, and cie record finds no lttng-sessiond in PATH to start one",
                   "install LTTng's tools (Debian: lttng-tools), or name the program in "
                   "LTTNG_SESSIOND_PATH");
  }
  return fine(kId, "none runs; cie record starts one when it needs it");
}

Finding real_time(const Machine& machine) {
  constexpr std::string_view kId = "real-time";
  if (machine.has_right(kSysNice)) {
    return fine(kId, "CAP_SYS_NICE: every policy and priority");
  }
  const auto most = machine.limit("Max realtime priority").value_or(0);
  if (most == 0) {
    return problem(kId, "neither CAP_SYS_NICE nor RLIMIT_RTPRIO: no real-time policy at all",
                   "a line `USER - rtprio 98` in /etc/security/limits.conf and a new login, or "
                   "`setcap cap_sys_nice+ep` on the program");
  }
  return warning(kId,
                 most == kUnlimited
                     ? "RLIMIT_RTPRIO is unlimited: SCHED_FIFO and SCHED_RR at every priority, no "
                       "SCHED_DEADLINE"
                     : fmt::format("RLIMIT_RTPRIO {}: SCHED_FIFO and SCHED_RR up to that priority, "
                                   "no SCHED_DEADLINE",
                                   most),
                 "CAP_SYS_NICE lifts that: `setcap cap_sys_nice+ep` on the program");
}

Finding throttling(const Machine& machine) {
  constexpr std::string_view kId = "throttling";
  const auto runtime = machine.number("/proc/sys/kernel/sched_rt_runtime_us");
  const auto period = machine.number("/proc/sys/kernel/sched_rt_period_us");
  if (!runtime || !period || *period <= 0) return fine(kId, "this kernel has none");
  if (*runtime < 0) return fine(kId, "off");
  if (*runtime == 0) {
    return problem(kId, "real-time threads get no time at all",
                   "sysctl kernel.sched_rt_runtime_us=950000");
  }
  if (*runtime >= *period) return fine(kId, "real-time threads may use all of the time");
  return warning(kId,
                 fmt::format("real-time threads get {} us of each {} us of a CPU, and then wait",
                             *runtime, *period),
                 "where they may need more: sysctl kernel.sched_rt_runtime_us=-1 (a runaway thread "
                 "then keeps its CPU for good)");
}

// Kernels with CONFIG_RT_GROUP_SCHED ask every group for a budget.
Finding group_budget(const Machine& machine) {
  constexpr std::string_view kId = "group-budget";
  const auto group = machine.control_group("cpu");
  const auto budget = group ? group->folder / "cpu.rt_runtime_us" : fs::path();
  if (!group || machine.number(budget) != 0) return fine(kId, "no cgroup forbids real-time tasks");
  return problem(kId, "this process's control group has no real-time budget",
                 "echo 950000 > " + budget.string() + ", and likewise in the groups above it");
}

constexpr const char* kUseOfKernelEvents =
    "without them execution times and preemption stay unknown; give the recorder CAP_BPF and "
    "CAP_PERFMON (`setcap cap_bpf,cap_perfmon+ep` on cie-record), or run it as root";

Finding kernel_events(const Machine& machine) {
  constexpr std::string_view kId = "kernel-events";
  const bool may_bpf =
      machine.has_right(kSysAdmin) || (machine.has_right(kBpf) && machine.has_right(kPerfmon));
  const bool has_btf = machine.has("/sys/kernel/btf/vmlinux");
  if (may_bpf && has_btf) return fine(kId, "by BPF");
  const bool has_tracefs =
      machine.has("/sys/kernel/tracing") || machine.has("/sys/kernel/debug/tracing");
  if (machine.is_root() && has_tracefs) return fine(kId, "by tracefs");
  if (!may_bpf) return warning(kId, "this user may not record the scheduler", kUseOfKernelEvents);
  return warning(
      kId, "this kernel has neither BTF nor tracefs",
      "build it with CONFIG_DEBUG_INFO_BTF or CONFIG_FTRACE; without them execution times "
      "and preemption stay unknown");
}

Finding lttng_modules(const Machine& machine) {
  constexpr std::string_view kId = "lttng-modules";
  return fine(kId, machine.has("/sys/module/lttng_tracer") ? "loaded; cie record does not need them"
                                                           : "not loaded, and not needed");
}

Finding governor(const Machine& machine) {
  constexpr std::string_view kId = "governor";
  std::map<std::string, std::vector<unsigned>> slow;
  bool has_any = false;
  for (const auto cpu : machine.online_cpus()) {
    const auto name =
        machine.text(fmt::format("/sys/devices/system/cpu/cpu{}/cpufreq/scaling_governor", cpu));
    if (!name) continue;
    has_any = true;
    if (*name != "performance") slow[*name].push_back(cpu);
  }
  if (!has_any) return fine(kId, "the kernel does not change the CPUs' frequency");
  if (slow.empty()) return fine(kId, "performance");
  std::vector<std::string> which;
  which.reserve(slow.size());
  for (const auto& [name, cpus] : slow)
    which.push_back(fmt::format("{} on CPU {}", name, fmt::join(cpus, ", ")));
  return warning(
      kId, fmt::format("{}", fmt::join(which, "; ")),
      "callbacks take longer while a CPU wakes up to its work: cpupower frequency-set -g "
      "performance");
}

Finding clock_source(const Machine& machine) {
  constexpr std::string_view kId = "clock-source";
  // Those that the vDSO reads without a system call.
  constexpr std::array<std::string_view, 4> kFast{"tsc", "arch_sys_counter", "kvm-clock",
                                                  "hyperv_clocksource_tsc_page"};
  const auto source =
      machine.text("/sys/devices/system/clocksource/clocksource0/current_clocksource");
  if (!source) return fine(kId, "unknown");
  if (std::ranges::find(kFast, *source) != kFast.end()) return fine(kId, *source);
  return problem(
      kId, *source + ": every event's time is a system call",
      "find out in the kernel's log why the processor's counter was given up "
      "(dmesg | grep -i clocksource); clocksource=tsc on the kernel's command line if it "
      "was wrong");
}

Finding shared_memory(const Machine& machine) {
  constexpr std::string_view kId = "shared-memory";
  const auto need = kBuffersPerCpu * machine.online_cpus().size();
  const auto left = machine.free_bytes("/dev/shm");
  const auto in_mib = [](std::uint64_t bytes) { return bytes >> 20U; };
  if (!left) {
    return problem(kId, "there is no /dev/shm: no application can be traced",
                   "mount -t tmpfs tmpfs /dev/shm");
  }
  const auto text =
      fmt::format("{} MiB left in /dev/shm, cie record takes {} MiB", in_mib(*left), in_mib(need));
  if (*left >= 2 * need) return fine(kId, text);
  constexpr const char* kAdvice =
      "make it larger (mount -o remount,size=1G /dev/shm; docker run --shm-size=1g), or record "
      "with "
      "a smaller --subbuf-size";
  return *left >= need ? warning(kId, text, kAdvice)
                       : problem(kId, text + ": applications run untraced", kAdvice);
}

}  // namespace

std::string_view label(Health health) noexcept {
  constexpr std::array<std::string_view, 3> kLabels{"ok", "warning", "problem"};
  return kLabels[static_cast<std::size_t>(health)];
}

std::vector<Finding> examine(const Machine& machine) {
  std::vector<Finding> findings;
  for (const auto check : {session_daemon, real_time, throttling, group_budget, kernel_events,
                           lttng_modules, governor, clock_source, shared_memory}) {
    findings.push_back(check(machine));
  }
  return findings;
}

Finding examine_recorder(const std::optional<std::string>& program) {
  constexpr std::string_view kId = "recorder";
  if (program) return fine(kId, *program);
  return problem(kId, "cie-record is not installed: nothing can be recorded here",
                 fmt::format("install the package {}, or name the folder of cie-record in PATH",
                             kRobotPackage));
}

Finding examine_kernel_trial(const std::string& trial, const Finding& promised) {
  constexpr std::string_view kId = "kernel-events";
  constexpr double kNanosecond = 1e-9;
  const auto told = nlohmann::json::parse(trial, nullptr, false);
  if (!told.is_object() || told.value("schema", "") != "cie.kernel-trial/1") {
    throw std::runtime_error("cie-record is of another version");
  }
  try {
    if (told.contains("reason")) {
      return warning(kId, "they cannot be recorded: " + told.at("reason").get<std::string>(),
                     promised.advice.empty() ? kUseOfKernelEvents : promised.advice);
    }
    std::uint64_t switches = 0;
    std::uint64_t untold = 0;
    std::uint64_t lost = 0;
    std::vector<std::string> holes;
    for (const auto& cpu : told.at("cpus")) {
      const auto here = cpu.at("untold").get<std::uint64_t>();
      const auto all = cpu.at("switches").get<std::uint64_t>() + here;
      switches += all;
      untold += here;
      lost += cpu.at("lost").get<std::uint64_t>();
      if (here > 0) {
        holes.push_back(
            fmt::format("{} of {} on CPU {}", here, all, cpu.at("cpu").get<unsigned>()));
      }
    }
    const auto text =
        fmt::format("by {}, tried for {:.1f} s: ", told.at("route").get<std::string>(),
                    kNanosecond * told.at("length_ns").get<double>());
    if (switches == 0) {
      return warning(kId, text + "the kernel told no switch of threads", kUseOfKernelEvents);
    }
    // Full buffers come first: larger ones help, whatever else the kernel does not tell.
    std::vector<std::string> what;
    std::vector<std::string> advice;
    if (lost > 0) {
      what.push_back(fmt::format("{} events were lost, the buffers were full", lost));
      advice.emplace_back("cie record --kernel-buffer 16m");
    }
    if (untold > 0) {
      const auto percent = 100 * static_cast<double>(untold) / static_cast<double>(switches);
      const auto share =
          percent < 10 ? fmt::format("{:.2g}", percent) : fmt::format("{:.0f}", percent);
      what.push_back(fmt::format("the kernel did not report {} of {} context switches, {} %: {}",
                                 untold, switches, share, fmt::join(holes, ", ")));
      advice.emplace_back(
          "execution times of instances around them are not measured, all others are; virtual "
          "machines do this, and the machine itself does not");
    }
    if (!what.empty()) {
      return warning(kId, fmt::format("{}{}", text, fmt::join(what, "; besides, ")),
                     fmt::format("{}", fmt::join(advice, "; of the switches: ")));
    }
    return fine(kId, fmt::format("{}{} switches, none is missing", text, switches));
  } catch (const nlohmann::json::exception& error) {
    throw std::runtime_error(std::string("cie-record is of another version: ") + error.what());
  }
}

namespace {

RecordingManifest manifest_of(const fs::path& recording) {
  analysis::require_trace_directory(recording);
  try {
    if (auto manifest = load_recording_manifest(recording)) return *std::move(manifest);
  } catch (const ManifestError& error) {
    throw std::runtime_error("\"" + (recording / kManifestName).string() +
                             "\" is damaged: " + error.what());
  }
  throw std::runtime_error("\"" + recording.string() +
                           "\" is no recording of cie record: it has no manifest.json of one");
}

// Bytes of the channel's fullest stream, which is one CPU's.
std::uint64_t most_bytes_of_a_cpu(const fs::path& recording, std::string_view channel) {
  std::uint64_t most = 0;
  for (const auto& entry : fs::recursive_directory_iterator(recording)) {
    const auto name = entry.path().filename().string();
    const bool is_stream = entry.is_regular_file() && channel_of(name) == channel &&
                           entry.path().extension().empty() &&
                           entry.path().parent_path().filename() != "index";
    if (is_stream) most = std::max<std::uint64_t>(most, entry.file_size());
  }
  return most;
}

// As an option takes it: "8m".
std::string in_binary_units(std::uint64_t bytes) {
  constexpr std::uint64_t kKibi = 1024;
  if (bytes % (kKibi * kKibi) == 0) return fmt::format("{}m", bytes / (kKibi * kKibi));
  return bytes % kKibi == 0 ? fmt::format("{}k", bytes / kKibi) : fmt::format("{}", bytes);
}

}  // namespace

Finding examine_buffers(const fs::path& recording) {
  constexpr std::string_view kId = "buffers";
  constexpr double kNanosecond = 1e-9;
  constexpr double kEnough = 2;  // seconds; a consumer daemon that must wait waits shorter
  const auto manifest = manifest_of(recording);
  std::uint64_t discarded = 0;
  for (const auto& channel : manifest.channels)
    discarded += channel.discarded_events;
  const auto& session = manifest.session;
  const double seconds = kNanosecond * (static_cast<double>(manifest.end.monotonic_ns) -
                                        static_cast<double>(manifest.begin.monotonic_ns));
  const auto bytes = static_cast<double>(most_bytes_of_a_cpu(recording, kEventChannel));
  const double rate = seconds > 0 ? bytes / seconds : 0;
  const double lasts =
      rate > 0 ? static_cast<double>(session.subbuf_size * session.num_subbuf) / rate : INFINITY;
  const auto more_subbufs = fmt::format("--num-subbuf {}", 2 * session.num_subbuf);
  const auto advice = "cie record " + more_subbufs;
  const auto lost_by_kernel = manifest.kernel.lost_events;
  if (discarded > 0 || lost_by_kernel > 0) {
    std::vector<std::string> what;
    std::vector<std::string> options;
    if (discarded > 0) {
      what.push_back(fmt::format("{} events were discarded", discarded));
      options.push_back(more_subbufs);
    }
    if (lost_by_kernel > 0) {
      what.push_back(fmt::format("the kernel's lost {} events", lost_by_kernel));
      options.push_back("--kernel-buffer " + in_binary_units(2 * manifest.kernel.buffer_size));
    }
    return problem(kId, fmt::format("too small: {}", fmt::join(what, ", ")),
                   fmt::format("cie record {}", fmt::join(options, " ")));
  }
  if (rate == 0) return fine(kId, "the recording holds no events of callbacks");
  const auto what = fmt::format("the busiest CPU wrote {:.1f} kB/s, for which they last {:.1f} s",
                                rate / 1000, lasts);
  return lasts >= kEnough ? fine(kId, what) : warning(kId, what, advice);
}

}  // namespace cie::cli
