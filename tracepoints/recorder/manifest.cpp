#include "manifest.hpp"

#include <cie/tracepoints/sha256.hpp>

#include "error.hpp"
#include "rotation.hpp"
#include "version.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <fstream>

#include <nlohmann/json.hpp>
#include <unistd.h>

namespace cie::record {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kManifest = "manifest.json";

std::int64_t now_ns(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

std::string boot_id() {
  std::ifstream file("/proc/sys/kernel/random/boot_id");
  std::string id;
  std::getline(file, id);
  return id;
}

Json exit_of(const std::optional<ExitStatus>& exit) {
  if (!exit) {
    return nullptr;
  }
  return exit->code ? Json{{"status", *exit->code}} : Json{{"signal", *exit->signal}};
}

Json kernel_of(const Manifest& manifest) {
  if (!manifest.kernel) {
    return {{"reason",
             manifest.no_kernel_because.empty() ? "--kernel=no" : manifest.no_kernel_because}};
  }
  const KernelSummary& kernel = *manifest.kernel;
  return {{"route", kernel.route},
          {"buffer_size", manifest.options.kernel_buffer_size},
          {"streams", kernel.streams},
          {"events", kernel.events},
          {"lost_events", kernel.lost_events},
          {"untold_switches", kernel.untold_switches}};
}

Json snapshot_of(const Manifest& manifest) {
  if (!manifest.snapshot) {
    return nullptr;
  }
  return {{"reason", manifest.snapshot->reason}, {"held_ns", manifest.snapshot->held.count()}};
}

Json in_json(const Instant& instant) {
  return {{"monotonic_ns", instant.monotonic_ns}, {"realtime_ns", instant.realtime_ns}};
}

Json relay_of(const Manifest& manifest) {
  if (!manifest.options.relay) {
    return nullptr;
  }
  Json sessions = Json::array();
  for (const RelaySession& session : manifest.relayed) {
    sessions.push_back({{"path", host_name() + '/' + session.name + "-*"},
                        {"begin", in_json(session.begin)},
                        {"lost", session.lost ? in_json(*session.lost) : nullptr},
                        {"end", session.end ? in_json(*session.end) : nullptr}});
  }
  return {{"address", manifest.options.relay->text()}, {"sessions", sessions}};
}

std::vector<fs::path> all_files(const fs::path& directory) {
  std::vector<fs::path> paths;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(directory)) {
    if (entry.is_regular_file()) {
      paths.push_back(entry.path());
    }
  }
  std::ranges::sort(paths);
  return paths;
}

std::vector<fs::path> manifests_of_chunks(const fs::path& directory) {
  std::vector<fs::path> paths = chunks_in(directory);
  for (fs::path& path : paths) {
    path /= kManifest;
  }
  return paths;
}

Json files_of(const fs::path& directory, const std::vector<fs::path>& paths) {
  Json files = Json::array();
  for (const fs::path& path : paths) {
    files.push_back({{"path", path.lexically_relative(directory).string()},
                     {"size", fs::file_size(path)},
                     {"sha256", sha256_file(path)}});
  }
  return files;
}

}  // namespace

std::string host_name() {
  std::array<char, 256> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

Instant now() { return {now_ns(CLOCK_MONOTONIC), now_ns(CLOCK_REALTIME)}; }

std::string describe(const ExitStatus& exit) {
  return exit.code ? "exited with status " + std::to_string(*exit.code)
                   : "was killed by signal " + std::to_string(*exit.signal) + " (" +
                         strsignal(*exit.signal) + ')';
}

void write_manifest(const Manifest& manifest) {
  const Options& options = manifest.options;
  const fs::path path = options.directory / kManifest;
  const bool is_divided = options.rotate && !manifest.chunk;
  Json channels = Json::array();
  for (const ChannelLoss& loss : manifest.losses) {
    channels.push_back({{"name", loss.name},
                        {"discarded_events", loss.discarded_events},
                        {"lost_packets", loss.lost_packets}});
  }
  Json processes = Json::array();
  for (const TracedProcess& process : manifest.processes) {
    processes.push_back({{"pid", process.pid}, {"name", process.name}});
  }
  const Json json{
      {"schema", "cie.recording/1"},
      {"tool", {{"name", "cie-record"}, {"version", kToolVersion}}},
      {"mode", options.is_attach() ? "attach" : "command"},
      {"command", options.command},
      {"exit", exit_of(manifest.exit)},
      {"host", host_name()},
      {"boot_id", boot_id()},
      {"begin", in_json(manifest.begin)},
      {"end", in_json(manifest.end)},
      {"snapshot", snapshot_of(manifest)},
      {"relay", relay_of(manifest)},
      {"chunk", manifest.chunk ? Json(*manifest.chunk) : Json(nullptr)},
      {"kernel_events", manifest.kernel.has_value()},
      {"kernel", kernel_of(manifest)},
      {"session",
       {{"name", manifest.session},
        {"events", options.events},
        {"subbuf_size", options.subbuf_size},
        {"num_subbuf", options.num_subbuf},
        {"flush_interval_ms", options.flush_interval.count()}}},
      {"processes", processes},
      {"channels", channels},
      {"problems", manifest.problems},
      {"files", files_of(options.directory, is_divided ? manifests_of_chunks(options.directory)
                                                       : all_files(options.directory))}};

  const fs::path draft = options.directory / "manifest.json.part";
  std::ofstream file(draft, std::ios::binary);
  // Names of files and arguments are bytes; what is no UTF-8 is written with replacement
  // characters.
  file << json.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
  file.close();
  if (!file) {
    const int error = errno;
    std::error_code ignored;
    fs::remove(draft, ignored);
    throw system_error("cannot write " + in_quotes(path), error);
  }
  fs::rename(draft, path);
}

}  // namespace cie::record
