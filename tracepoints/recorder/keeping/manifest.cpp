#include "keeping/manifest.hpp"

#include <cie/tracepoints/sha256.hpp>

#include "base/machine.hpp"
#include "keeping/chunk_names.hpp"
#include "lttng/session_channels.hpp"
#include "system/directory_claim.hpp"
#include "system/error.hpp"
#include "system/text.hpp"
#include "version.hpp"

#include <algorithm>
#include <cerrno>
#include <fstream>

namespace cie::record {
namespace {

namespace fs = std::filesystem;

std::vector<RelayedSession> sessions_of(const Manifest& manifest) {
  std::vector<RelayedSession> sessions;
  for (const RelaySession& session : manifest.relayed) {
    sessions.push_back({.path = host_name() + '/' + session.name + "-*",
                        .begin = session.begin,
                        .lost = session.lost,
                        .end = session.end});
  }
  return sessions;
}

RecordedKernel kernel_of(const Manifest& manifest) {
  if (!manifest.kernel) return {};
  const KernelSummary& kernel = *manifest.kernel;
  return {.route = kernel.route,
          .buffer_size = manifest.options.kernel_buffer_size,
          .streams = kernel.streams,
          .events = kernel.events,
          .lost_events = kernel.lost_events,
          .untold_switches = kernel.untold_switches};
}

std::vector<fs::path> all_files(const fs::path& directory) {
  std::vector<fs::path> paths;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(directory)) {
    if (entry.is_regular_file() && entry.path().filename() != DirectoryClaim::kFileName) {
      paths.push_back(entry.path());
    }
  }
  std::ranges::sort(paths);
  return paths;
}

std::vector<fs::path> manifests_of_chunks(const fs::path& directory) {
  std::vector<fs::path> paths = chunks_in(directory);
  for (fs::path& path : paths) {
    path /= kManifestName;
  }
  return paths;
}

std::vector<RecordedFile> files_of(const fs::path& directory, const std::vector<fs::path>& paths) {
  std::vector<RecordedFile> files;
  files.reserve(paths.size());
  for (const fs::path& path : paths) {
    files.push_back({.path = path.lexically_relative(directory).string(),
                     .size = fs::file_size(path),
                     .sha256 = sha256_file(path)});
  }
  return files;
}

}  // namespace

void write_manifest(const Manifest& manifest) {
  const Options& options = manifest.options;
  const fs::path path = options.directory / kManifestName;
  const bool is_divided = options.rotate && !manifest.chunk;
  RecordingManifest said;
  said.tool_version = kToolVersion;
  said.mode = options.is_attach() ? "attach" : "command";
  said.command = options.command;
  said.exit = manifest.exit;
  said.host = host_name();
  said.boot_id = boot_id();
  said.begin = manifest.begin;
  said.end = manifest.end;
  if (manifest.snapshot) {
    said.snapshot = {.reason = manifest.snapshot->reason,
                     .held_ns = manifest.snapshot->held.count()};
  }
  if (options.relay) {
    said.relay = {.address = options.relay->text(), .sessions = sessions_of(manifest)};
  }
  said.chunk = manifest.chunk;
  if (is_divided) said.removed_chunks = manifest.removed_chunks;
  said.has_kernel_events = manifest.kernel.has_value();
  said.kernel = kernel_of(manifest);
  said.kernel_reason =
      manifest.no_kernel_because.empty() ? "--kernel=no" : manifest.no_kernel_because;
  said.session = {.name = manifest.session,
                  .events = event_patterns(options),
                  .subbuf_size = options.subbuf_size,
                  .num_subbuf = options.num_subbuf,
                  .flush_interval_ms = options.flush_interval.count()};
  said.processes = manifest.processes;
  said.names_all_processes = manifest.names_all_processes;
  for (const ChannelLoss& loss : manifest.losses) {
    said.channels.push_back({.name = loss.name,
                             .discarded_events = loss.discarded_events,
                             .lost_packets = loss.lost_packets});
  }
  said.problems = manifest.problems;
  said.files = files_of(options.directory, is_divided ? manifests_of_chunks(options.directory)
                                                      : all_files(options.directory));

  const fs::path draft = options.directory / "manifest.json.part";
  std::ofstream file(draft, std::ios::binary);
  file << to_json(said);
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
