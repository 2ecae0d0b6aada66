#include "options/command_line.hpp"

#include "base/help_text.hpp"
#include "base/program.hpp"
#include "base/text.hpp"
#include "system/connection.hpp"
#include "version.hpp"

#include <algorithm>
#include <bit>
#include <ctime>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <unistd.h>

namespace cie::record {
namespace {

constexpr std::uint64_t kLeastKernelBuffer = 64 << 10;
constexpr std::uint64_t kMostKernelBuffer = 1 << 30;

std::string default_directory() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  char name[64];
  std::strftime(name, sizeof name, "cie-recording-%Y%m%d-%H%M%S", &local);
  return name;
}

// LTTng has no smaller sub-buffer. 4 KiB, or on AArch64 up to 64.
std::uint64_t page_size() { return static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE)); }

void require_power_of_two(std::uint64_t value, std::uint64_t least, const char* option) {
  if (value < least || !std::has_single_bit(value)) {
    throw UsageError(
        fmt::format("{} must be a power of two, at least {}: {}", option, least, value));
  }
}

constexpr double kLongestSnapshot = 3600;
constexpr std::uint64_t kSnapshotSubbufs = 8;
constexpr std::uint64_t kLeastSnapshotSubbuf = 16 << 10;
constexpr std::uint64_t kMostSnapshotSubbuf = 1 << 30;

// Buffers that hold the last seconds at the stated rate. One sub-buffer is always being emptied.
void size_buffers(Options& options) {
  const double bytes = std::chrono::duration<double>(options.snapshot->length).count() *
                       static_cast<double>(options.snapshot->event_rate) * kBytesPerEvent;
  const double subbuf = bytes / static_cast<double>(kSnapshotSubbufs - 1);
  if (subbuf > static_cast<double>(kMostSnapshotSubbuf)) {
    throw UsageError("--snapshot: that many seconds at that --event-rate do not fit into memory");
  }
  options.num_subbuf = kSnapshotSubbufs;
  options.subbuf_size = std::max(
      {kLeastSnapshotSubbuf, page_size(), std::bit_ceil(static_cast<std::uint64_t>(subbuf))});
}

// For CLI11: what is wrong with the text of a time; empty if nothing is.
std::string seconds_complaint(const std::string& text) {
  constexpr double kMost = 1e9;
  const auto number = parse_number<double>(text);
  if (number && *number > 0 && *number <= kMost) return {};
  return fmt::format("takes seconds, above 0 and at most {:.0f}, and not \"{}\"", kMost, text);
}

std::string snapshot_complaint(const std::string& text) {
  const double least = std::chrono::duration<double>(kLeastSnapshot).count();
  const auto number = parse_number<double>(text);
  if (number && *number >= least && *number <= kLongestSnapshot) return {};
  return fmt::format(
      "takes {:g} to {:g} seconds, and not \"{}\": what less would be saved for is overwritten "
      "before it is saved",
      least, kLongestSnapshot, text);
}

std::chrono::milliseconds milliseconds_of(double number_of_seconds) {
  return std::chrono::milliseconds(static_cast<std::int64_t>(number_of_seconds * 1000));
}

// Unless somebody chose.
void leave_out_kernel(Options& options, const char* because) {
  if (options.kernel != KernelChoice::automatic) return;
  options.kernel = KernelChoice::no;
  options.no_kernel_because = because;
}

// What --snapshot and the options that go with it say.
struct SnapshotArguments {
  double seconds = 0;
  double least_interval = 10;
  SnapshotOptions options;
  std::string save;
  std::string reason;
  CLI::Option* snapshot = nullptr;
  CLI::Option* asking = nullptr;
  CLI::Option* giving_reason = nullptr;

  void add_to(CLI::App& app) {
    snapshot =
        app.add_option("--snapshot", seconds,
                       "Flight recorder: keep the last SECONDS in memory only, and save them "
                       "as DIR/snapshot-001, … on command (--save, SIGUSR1), when a callback "
                       "misses the deadline that it declares, and when CMD fails")
            ->type_name("SECONDS")
            ->option_text("SECONDS")
            ->check(snapshot_complaint);
    app.add_option("--event-rate", options.event_rate,
                   "With --snapshot: events per second on a CPU that the memory is for (20000)")
        ->type_name("N")
        ->option_text("N")
        ->check(CLI::Range(1, 100'000'000))
        ->needs(snapshot);
    app.add_option("--max-snapshots", options.most,
                   "With --snapshot: how many are saved unasked at most (10)")
        ->type_name("N")
        ->option_text("N")
        ->needs(snapshot);
    app.add_option("--min-interval", least_interval,
                   "With --snapshot: least time from one to the next that is saved unasked (10)")
        ->type_name("SECONDS")
        ->option_text("SECONDS")
        ->check(CLI::Range(0.0, 1e6))
        ->needs(snapshot);
    asking = app.add_option(
                    "--save", save,
                    "Have the recorder that keeps snapshots in DIR save one now, and print where")
                 ->type_name("DIR");
    giving_reason =
        app.add_option("--reason", reason, "With --save: why, for the snapshot's manifest")
            ->type_name("WHY")
            ->needs(asking);
  }

  // Throws UsageError if anything but --save and --reason was given.
  void require_alone(const CLI::App& app, bool has_command) const {
    const bool is_alone = std::ranges::all_of(app.get_options(), [this](const CLI::Option* option) {
      return option->count() == 0 || option == asking || option == giving_reason;
    });
    if (has_command || !is_alone) {
      throw UsageError("--save DIR stands alone: a recorder runs already");
    }
  }

  // Whether buffers were asked for by size decides that they are not chosen by time.
  void apply_to(Options& to, bool has_sizes) {
    if (snapshot->count() == 0) {
      return;
    }
    leave_out_kernel(to,
                     "--snapshot has them with --kernel=yes only");  // their cost must be asked for
    options.length = milliseconds_of(seconds);
    options.least_interval = milliseconds_of(least_interval);
    to.snapshot = options;
    if (!has_sizes) {
      size_buffers(to);
    }
  }
};

// What --rotate and the option that goes with it say.
struct RotateArguments {
  double seconds = 0;
  std::uint64_t most = 0;
  CLI::Option* rotate = nullptr;

  void add_to(CLI::App& app) {
    rotate = app.add_option("--rotate", seconds,
                            "Begin a chunk every SECONDS: DIR/chunk-000001, …, each a recording of "
                            "its own that can be read and removed while the next one is written")
                 ->type_name("SECONDS")
                 ->option_text("SECONDS")
                 ->check(CLI::Range(1.0, 1e6));
    app.add_option("--keep", most, "With --rotate: remove the oldest chunks beyond N")
        ->type_name("N")
        ->option_text("N")
        ->check(CLI::Range(1, 1'000'000))
        ->needs(rotate);
  }

  void apply_to(Options& to) const {
    if (rotate->count() == 0) {
      return;
    }
    if (to.relay) {
      throw UsageError(
          "--rotate divides what is written here, --to writes nothing here: choose one");
    }
    if (to.snapshot) {
      throw UsageError("--rotate divides what is written, --snapshot writes nothing: choose one");
    }
    leave_out_kernel(to,
                     "--rotate has them with --kernel=yes only");  // their cost must be asked for
    to.rotate = RotateOptions{.interval = milliseconds_of(seconds), .most = most};
  }
};

// HOST[:PORT], or the same as a URL. LTTng takes control and data port; ours follow each other.
void apply_relay(Options& options, std::string_view text) {
  if (text.empty()) return;
  for (const std::string_view protocol : {"net://", "tcp://"}) {
    if (text.starts_with(protocol)) text.remove_prefix(protocol.size());
  }
  options.relay = parse_address(text, kRelayPort);
  if (!options.relay) {
    throw UsageError(
        fmt::format("--to takes HOST or HOST:PORT, of IPv6 [HOST]:PORT: \"{}\"", text));
  }
  if (options.relay->port == 0 || options.relay->port == UINT16_MAX) {
    throw UsageError(fmt::format("--to: no relay daemon has port {}", options.relay->port));
  }
  if (options.snapshot) throw UsageError("--to streams everything: it does not go with --snapshot");
  if (options.kernel == KernelChoice::yes) {
    throw UsageError(
        "--to streams what LTTng records: kernel events it cannot; leave --kernel out");
  }
  leave_out_kernel(options, "--to streams what LTTng records");
}

// A command without "--" before it leaves its own options to this program: whatever else is wrong comes
// of that.
void require_command_after_separator(const CLI::App& app) {
  if (const auto unexpected = unexpected_argument(app); !unexpected.empty())
    throw UsageError(unexpected + "; the command to record follows after --");
}

}  // namespace

ParsedCommandLine parse_command_line(const std::vector<std::string>& arguments, bool is_root) {
  const auto separator = std::ranges::find(arguments, "--");
  std::vector<std::string> own(arguments.begin(), separator);
  Options options;
  if (separator != arguments.end()) {
    options.command.assign(separator + 1, arguments.end());
  }

  CLI::App app{"Records a run of callback-isolated executors with LTTng.", "cie record"};
  lay_out_help(app,
               "cie record [OPTIONS] -- CMD [ARG...]\n"
               "       cie record [OPTIONS] --attach\n"
               "       cie record --to HOST[:PORT] [OPTIONS] -- CMD [ARG...]\n"
               "       cie record --save DIR [--reason WHY]");
  app.footer(
      "CMD runs with its output untouched; Ctrl-C, SIGTERM and SIGHUP reach it, and the recording\n"
      "ends with it. If CMD goes on, a second Ctrl-C sends it SIGTERM, and SIGKILL 5 s later or with\n"
      "a third. What was recorded is kept.\n\n"
      "Exit codes: 0 recorded, 2 wrong usage, 4 the recording failed. The status of CMD is printed and\n"
      "stands in DIR/manifest.json; with --preserve-status it takes the place of 0.\n\n"
      "CMD gets a session daemon of its own, so that nothing else is recorded (as root in a mount\n"
      "namespace with a /run/lttng of its own, where the kernel allows that). --daemon=shared "
      "uses\n"
      "the machine's, which records every traced process.");
  std::string directory;
  bool is_attach = false;
  SnapshotArguments snapshot;
  RotateArguments rotate;
  std::string relay;
  std::string kernel = "auto";
  std::string daemon = "auto";
  std::int64_t flush_ms = options.flush_interval.count();
  std::int64_t live_interval_ms = options.live_interval.count();
  double registration_s = 5;
  double duration_s = 0;
  std::vector<std::string> more_events;
  std::string profile;
  app.add_option("-o,--output", directory, "Directory to create for the recording")
      ->type_name("DIR");
  auto* attach =
      app.add_flag("--attach", is_attach, "Record applications that run already, until Ctrl-C");
  auto* duration = app.add_option("--duration", duration_s,
                                  "With --attach: stop so long after the first application "
                                  "registered, or after --registration-timeout if none has")
                       ->type_name("SECONDS")
                       ->option_text("SECONDS")
                       ->check(seconds_complaint)
                       ->needs(attach);
  app.add_flag("--preserve-status", options.preserves_status,
               "If it was recorded, exit with the status of CMD; 128+N: signal N killed it")
      ->excludes(attach);
  app.add_option(
         "--kernel", kernel,
         "Scheduler events of the kernel (root); auto (default): if possible; no; yes, or no value: "
         "it fails without; bpf, tracefs: yes, by that route (otherwise the better one)")
      ->option_text("[HOW]")
      ->check(one_of({"auto", "yes", "no", "bpf", "tracefs"}))
      ->expected(0, 1);  // without a value it is empty
  app.add_option("--kernel-buffer", options.kernel_buffer_size,
                 "Size of the kernel's buffer of each CPU")
      ->transform(CLI::AsSizeValue(false))
      ->type_name("BYTES")
      ->option_text("BYTES");
  app.add_option("--daemon", daemon,
                 "Session daemon: own (of this recording), shared, or auto (default)")
      ->option_text("WHICH")
      ->check(one_of({"auto", "own", "shared"}));
  app.add_option("--event", more_events, "Also record these events, e.g. 'ros2:*' (repeatable)")
      ->type_name("PATTERN");
  bool is_ros2 = false;
  auto* ros2 =
      app.add_flag("--ros2", is_ros2,
                   "Record applications of ROS 2: the events of its tracers (ros2_tracing, "
                   "CARET, agnocast) and the processes that emit them");
  app.add_option("--profile", profile,
                 "ros2: CMD also emits the events of ROS 2's tracers, for tools that read only "
                 "those; with --attach it must have been started with CIE_TRACE_PROFILE=ros2")
      ->option_text("NAME")
      ->check(one_of({"ros2"}))
      ->excludes(ros2);
  auto* subbuf_size =
      app.add_option("--subbuf-size", options.subbuf_size, "Size of a sub-buffer, a power of two")
          ->transform(CLI::AsSizeValue(false))
          ->type_name("BYTES")
          ->option_text("BYTES");
  auto* num_subbuf =
      app.add_option("--num-subbuf", options.num_subbuf, "Sub-buffers per CPU, a power of two")
          ->type_name("N")
          ->option_text("N");
  app.add_option("--flush-interval", flush_ms, "How often buffers are written out")
      ->type_name("MS")
      ->option_text("MS")
      ->check(CLI::Range(10, 3'600'000));
  app.add_option("--registration-timeout", registration_s,
                 "When to say that no traced application has registered yet; --duration begins "
                 "then at the latest")
      ->type_name("SECONDS")
      ->option_text("SECONDS")
      ->check(seconds_complaint);
  snapshot.add_to(app);
  rotate.add_to(app);
  auto* to =
      app.add_option("--to", relay,
                     "Stream to the relay daemon there (cie collect) rather than write to this "
                     "machine's disk; DIR gets the manifest only (default port: 5342, and the next "
                     "one for data)")
          ->type_name("HOST[:PORT]");
  app.add_option("--live", relay, "The same as --to, by a URL: net://HOST[:PORT]")
      ->type_name("URL")
      ->excludes(to);
  // Of cie doctor and cie live, which start this program: not for people.
  bool is_kernel_trial = false;
  app.add_flag("--try-kernel", is_kernel_trial)->group("");
  app.add_option("--live-socket", options.live_socket)->group("");
  app.add_option("--live-interval", live_interval_ms)->group("")->check(CLI::Range(1, 10'000));
  app.set_version_flag("--version", std::string("cie-record ") + kToolVersion);

  try {
    if (auto text = parse_arguments(app, own)) {
      return {.options = std::nullopt, .save = std::nullopt, .text = *std::move(text)};
    }
  } catch (const UsageError&) {
    require_command_after_separator(app);
    throw;
  }

  if (!snapshot.save.empty()) {
    snapshot.require_alone(app, !options.command.empty());
    return {.options = std::nullopt,
            .save = std::filesystem::absolute(snapshot.save),
            .save_reason = snapshot.reason,
            .text = {}};
  }
  if (is_attach && !options.command.empty()) {
    throw UsageError("--attach records what runs already: it takes no command");
  }
  if (is_kernel_trial) {
    return {.options = options, .save = std::nullopt, .is_kernel_trial = true, .text = {}};
  }
  if (!is_attach && options.command.empty()) {
    throw UsageError(
        "nothing to record: give a command after --, or --attach for what runs already");
  }
  require_power_of_two(options.subbuf_size, page_size(), "--subbuf-size");
  require_power_of_two(options.num_subbuf, 2, "--num-subbuf");
  if (options.kernel_buffer_size < kLeastKernelBuffer ||
      options.kernel_buffer_size > kMostKernelBuffer) {
    throw UsageError(
        fmt::format("--kernel-buffer must be 64k to 1g: {}", options.kernel_buffer_size));
  }
  options.kernel = kernel == "auto" ? KernelChoice::automatic
                   : kernel == "no" ? KernelChoice::no
                                    : KernelChoice::yes;
  options.kernel_route = kernel == "bpf"       ? KernelRoute::bpf
                         : kernel == "tracefs" ? KernelRoute::tracefs
                                               : KernelRoute::best;
  snapshot.apply_to(options, subbuf_size->count() + num_subbuf->count() > 0);
  apply_relay(options, relay);
  rotate.apply_to(options);
  if (daemon == "own" && is_attach) {
    throw UsageError("--daemon=own: running applications know the shared daemon only");
  }
  if (is_attach || daemon == "shared") {
    options.daemon = DaemonChoice::shared;
  } else {
    options.daemon =
        is_root && daemon == "auto" ? DaemonChoice::own_if_possible : DaemonChoice::own;
  }
  options.ros2 = is_ros2            ? Ros2Events::applications
                 : !profile.empty() ? Ros2Events::profile
                                    : Ros2Events::no;
  options.events.insert(options.events.end(), more_events.begin(), more_events.end());
  options.flush_interval = std::chrono::milliseconds(flush_ms);
  options.live_interval = std::chrono::milliseconds(live_interval_ms);
  options.registration_timeout = milliseconds_of(registration_s);
  if (duration->count() > 0) {
    options.duration = milliseconds_of(duration_s);
  }
  options.directory = std::filesystem::absolute(directory.empty() ? default_directory() : directory)
                          .lexically_normal();
  return {.options = std::move(options), .save = std::nullopt, .text = {}};
}

}  // namespace cie::record
