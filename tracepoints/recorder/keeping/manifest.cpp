#include "keeping/manifest.hpp"

#include <cie/tracepoints/sha256.hpp>

#include "base/machine.hpp"
#include "keeping/chunk_names.hpp"
#include "lttng/session_channels.hpp"
#include "system/directory_claim.hpp"
#include "version.hpp"

#include <algorithm>
#include <utility>

namespace cie::record {
namespace {

namespace fs = std::filesystem;

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

void note_nothing_recorded(const Options& options, bool is_anybody, RecordingManifest& manifest) {
  // What could not be written may have been its events.
  if (is_anybody && !manifest.problems.empty()) return;
  const std::string events = joined(event_patterns(options));
  const std::string why =
      options.is_attach()
          ? ". One that runs already may take some 5 s to find a session daemon that was just "
            "started: wait longer (--registration-timeout 15)"
          : "";
  const std::string of_ros2 =
      options.ros2 == Ros2Events::no ? ". Of applications of ROS 2: --ros2" : "";
  add_problem(
      manifest.problems,
      is_anybody
          ? "nothing was recorded: an application registered with the session daemon, and emitted "
            "no event of " +
                events
          : "nothing was recorded: no application with events of " + events +
                " registered with the session daemon" + why + of_ros2);
}

RecordingManifest manifest_of(const Options& options) {
  RecordingManifest manifest;
  manifest.tool_version = kToolVersion;
  manifest.mode = options.is_attach() ? "attach" : "command";
  manifest.command = options.command;
  manifest.host = host_name();
  manifest.boot_id = boot_id();
  if (options.relay) manifest.relay = {.address = options.relay->text(), .sessions = {}};
  if (options.rotate) manifest.removed_chunks = 0;
  manifest.kernel.buffer_size = options.kernel_buffer_size;
  manifest.kernel_reason = options.no_kernel_because;
  manifest.session = {.name = {},
                      .events = event_patterns(options),
                      .subbuf_size = options.subbuf_size,
                      .num_subbuf = options.num_subbuf,
                      .flush_interval_ms = options.flush_interval.count()};
  return manifest;
}

void note_kernel(RecordedKernel measured, RecordingManifest& manifest) {
  measured.buffer_size = manifest.kernel.buffer_size;
  measured.problems = std::move(manifest.kernel.problems);
  manifest.kernel = std::move(measured);
  manifest.has_kernel_events = true;
}

void write_manifest(const Directory& directory, RecordingManifest manifest) {
  if (manifest.kernel_reason.empty()) manifest.kernel_reason = "--kernel=no";
  const bool is_divided = manifest.removed_chunks.has_value();
  const fs::path way = directory.way();
  manifest.files = files_of(way, is_divided ? manifests_of_chunks(way) : all_files(way));
  directory.put(kManifestName, to_json(manifest));
}

}  // namespace cie::record
