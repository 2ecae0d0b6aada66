#include "live_options.hpp"

#include "base/text.hpp"
#include "command_line.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

namespace cie::cli {
namespace {

constexpr const char* kLiveDescription =
    "Watches a running system: callbacks by response time, deadline misses, missed releases,\n"
    "violated rules as they happen, lost events, CPU per thread. The numbers are those of\n"
    "cie report and cie verify, of the last 10 seconds and since the start.\n"
    "A session is net://RELAY[:PORT]/host/HOST/SESSION, or a name at net://localhost;\n"
    "net://RELAY[:PORT] is all of them there, of as many machines as stream to it.";

constexpr const char* kLiveFooter =
    "Examples:\n"
    "  cie live -- cie run app.yaml                   start it and watch it\n"
    "  cie live                                       watch what runs already on this machine\n"
    "  cie live --ros2 -- ros2 launch demo app.py     applications of ROS 2\n"
    "  cie live net://robot:5344/host/robot/drive     a live session of LTTng\n"
    "  cie live net://localhost:5344                  all machines that cie collect receives\n"
    "  cie live --batch -n 1 -- cie run app.yaml      one snapshot as text, for a log\n"
    "  cie live --json --spec app.yaml | jq .verdict  one object per line, for programs\n"
    "  cie live --listen 9464                         a web page, and /metrics for Prometheus\n"
    "\n"
    "Without --batch and --json, and on a terminal, it fills the screen: h shows the keys.\n"
    "One reader can follow a live session at a time. It sees what is written from then on; what\n"
    "an application said of itself before, lttng regenerate statedump has it say again.\n"
    "Exit codes: 0 the session or the user ended it, 2 wrong usage or spec, 4 no such session,\n"
    "connection lost for good, or tracing not possible.\n";

constexpr double kShortest = 0.1;
constexpr double kLongest = 3600;

double number_of(const std::string& option, const std::string& text, double least, double most) {
  const auto value = parse_number<double>(text);
  if (!value || !(*value >= least && *value <= most)) {
    throw UsageError(
        fmt::format("{} takes {:.10g} to {:.10g}, and not \"{}\"", option, least, most, text));
  }
  return *value;
}

std::uint64_t count_of(const std::string& option, const std::string& text) {
  constexpr std::uint64_t kMost = 1'000'000'000;
  const auto value = parse_number<std::uint64_t>(text);
  if (!value || *value < 1 || *value > kMost)
    throw UsageError(fmt::format("{} takes 1 to {}, and not \"{}\"", option, kMost, text));
  return *value;
}

NetworkAddress listen_address(const std::string& text) {
  auto address = parse_listen_address(text, std::nullopt);
  if (!address) {
    throw UsageError("--listen takes [ADDRESS:]PORT, a port from 0 (any free one) to 65535: \"" +
                     text + '"');
  }
  return *std::move(address);
}

// The limits of --save-snapshot; empty: not given.
void parse_saving(const std::string& most, const std::string& least_interval,
                  LiveOptions& options) {
  if (options.flight_directory.empty()) {
    if (!most.empty()) throw UsageError("--max-snapshots goes with --save-snapshot");
    if (!least_interval.empty()) throw UsageError("--min-interval goes with --save-snapshot");
    return;
  }
  if (!options.command.empty()) {
    throw UsageError(
        "--save-snapshot: a command that cie live starts is traced by nobody else; start it by "
        "itself, and have cie record --attach --snapshot and cie live both attach to it");
  }
  if (!most.empty()) options.save_limits.most = count_of("--max-snapshots", most);
  if (!least_interval.empty()) {
    const auto seconds = number_of("--min-interval", least_interval, 0, 1e6);
    options.save_limits.least_interval = std::chrono::milliseconds(std::lround(seconds * 1000));
  }
}

LiveOptions::View view_of(bool is_batch, bool is_json, bool is_listening) {
  if (is_batch && is_json) throw UsageError("--batch or --json, not both");
  if (is_json) return LiveOptions::View::json;
  if (is_batch) return LiveOptions::View::text;
  if (::isatty(STDIN_FILENO) == 1 && ::isatty(STDOUT_FILENO) == 1) {
    return LiveOptions::View::screen;
  }
  return is_listening ? LiveOptions::View::none : LiveOptions::View::text;
}

}  // namespace

std::optional<LiveOptions> parse_live_options(const Arguments& arguments) {
  const auto separator = std::find(arguments.begin(), arguments.end(), "--");
  const Arguments own(arguments.begin(), separator);
  LiveOptions options;
  if (separator != arguments.end()) {
    options.command.assign(separator + 1, arguments.end());
    if (options.command.empty()) throw UsageError("no command after --");
  }
  std::string interval = "1";
  std::string count;
  std::string sort(label(options.sort));
  std::string listen;
  std::string most;
  std::string least_interval;
  bool is_batch = false;
  bool is_json = false;
  CommandLine line(
      {"cie live [URL | SESSION] [OPTIONS] [-- CMD [ARG...]]", kLiveDescription, kLiveFooter});
  line.argument("SESSION", options.target,
                "A live session of LTTng (default: CMD, or what runs already)");
  line.option("--spec", "FILE", options.spec_file,
              "Scheduling spec (YAML) with deadlines, chains and what rules judge by");
  line.flag("--ros2", options.is_ros2,
            "Applications of ROS 2: CMD, or what runs already, is traced by the\n"
            "events of their tracers, as cie record --ros2 does");
  line.option("--interval", "SECONDS", interval, "Time between two snapshots (default: 1)");
  line.flag("--batch", is_batch, "Text, one snapshot after the other");
  line.flag("--json", is_json, "One JSON object per line (schema cie.live/1)");
  line.option("-n,--count", "COUNT", count, "End after so many snapshots");
  line.flag("--instances", options.with_instances,
            "With --json: the last instances of each callback too");
  line.option("--sort", "KEY", sort, "p99 (default), p50, max, rate, late, missed or name");
  line.option("--filter", "TEXT", options.filter,
              "Only callbacks whose name, host or pid contains TEXT");
  line.option("--listen", "[ADDRESS:]PORT", listen,
              "Serve a web page and /metrics there (default address: 127.0.0.1)");
  line.option("--save-snapshot", "DIR", options.flight_directory,
              "When a rule is violated or a deadline of the spec missed, have\n"
              "the recorder that keeps snapshots in DIR save one");
  line.option("--max-snapshots", "N", most, "With --save-snapshot: how many at most (default: 10)");
  line.option("--min-interval", "SECONDS", least_interval,
              "With --save-snapshot: least time between two (default: 10)");
  if (!line.parse(own)) return std::nullopt;

  if (!options.target.empty() && !options.command.empty()) {
    throw UsageError("a session or a command, not both");
  }
  if (!options.target.empty() && options.is_ros2) {
    throw UsageError(
        "--ros2 goes with a command, or with what runs already: a session has its events");
  }
  const auto seconds = number_of("--interval", interval, kShortest, kLongest);
  options.interval = std::chrono::milliseconds(std::lround(seconds * 1000));
  if (!count.empty()) options.count = count_of("--count", count);
  const auto key = live::sort_key(sort);
  check_choice("--sort", sort, {"p99", "p50", "max", "rate", "late", "missed", "name"});
  options.sort = *key;
  if (!listen.empty()) options.listen = listen_address(listen);
  parse_saving(most, least_interval, options);
  options.view = view_of(is_batch, is_json, !listen.empty());
  if (options.with_instances && !is_json) throw UsageError("--instances goes with --json");
  return options;
}

Arguments recorder_arguments(const LiveOptions& options, int socket) {
  Arguments arguments{"--live-socket=" + std::to_string(socket), "--kernel=no"};
  if (options.is_ros2) arguments.emplace_back("--ros2");
  if (options.command.empty()) {
    arguments.emplace_back("--attach");
  } else {
    arguments.emplace_back("--");
    arguments.insert(arguments.end(), options.command.begin(), options.command.end());
  }
  return arguments;
}

}  // namespace cie::cli
