#include "keeping/directory_keeping.hpp"

#include "base/text.hpp"
#include "ctf/stream_check.hpp"
#include "keeping/attempt.hpp"
#include "keeping/kernel_beside.hpp"
#include "keeping/manifest.hpp"

#include <algorithm>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace cie::record {
namespace {

constexpr std::string_view kWhyNoBuffers =
    "(is /dev/shm full, or a limit of the size of files, ulimit -f, below that of a buffer?)";

}  // namespace

bool DirectoryKeeping::begin() {
  tracing_.start_daemon();
  tracing_.create_session();
  // Before the first user event, so that no instance begins without its thread's record.
  kernel_ = start_kernel(kKernelDirectory, tracing_);
  tracing_.watch_processes();
  tracing_.start();
  return true;
}

void DirectoryKeeping::start_reading() {
  if (kernel_) kernel_->start_reading();
}

void DirectoryKeeping::abandon() noexcept {
  kernel_.reset();
  tracing_.abandon();
}

void DirectoryKeeping::on_request(Target& /*target*/) { tracing_.refuse_snapshot(); }

void DirectoryKeeping::poll(Target& target) {
  tracing_.look_for_applications(target);
  tracing_.note_processes();
  if (tracing_.has_checked_daemon()) {
    adopt_clock(kernel_.get(), tracing_);
    tracing_.check_space();
  }
  tracing_.end_tick(target);
}

Outcome DirectoryKeeping::finish(const std::optional<ExitStatus>& exit) {
  RecordingManifest& manifest = tracing_.manifest;
  manifest.exit = exit;
  tracing_.end();
  end_kernel(std::move(kernel_), tracing_);
  tracing_.note_processes();
  tracing_.close();
  const bool is_there = tracing_.is_directory_there();
  if (is_there) {
    attempt(manifest.problems, [this] { check_files(); });
    attempt(manifest.problems, [&] { write_manifest(tracing_.directory(), manifest); });
  }
  tracing_.release_directory();
  return {.options = tracing_.options(),
          .manifest = manifest,
          .is_directory_there = is_there,
          .kept = KeptInDirectory{}};
}

void DirectoryKeeping::check_files() {
  namespace fs = std::filesystem;
  const fs::path& directory = tracing_.options().directory;
  RecordingManifest& manifest = tracing_.manifest;
  std::vector<std::string>& problems = manifest.problems;
  const auto problems_of = [&](const fs::path& file) -> std::vector<std::string>& {
    const bool is_of_kernel = file.parent_path() == directory / kKernelDirectory;
    return is_of_kernel ? manifest.kernel.problems : problems;
  };
  for (const fs::path& file : empty_metadata(directory)) {
    problems_of(file).push_back(in_quotes(file) +
                                " is empty: its streams cannot be read (is the disk full?)");
  }
  std::vector<StreamSummary> of_applications;
  for (const StreamSummary& stream : check_streams(directory)) {
    if (stream.file.parent_path() != directory / kKernelDirectory)
      of_applications.push_back(stream);
    if (auto why = incompleteness_of(stream); !why.empty())
      problems_of(stream.file).push_back(std::move(why));
    if (stream.lost_packets > 0) {
      problems_of(stream.file)
          .push_back(
              fmt::format("{} lacks {} packets", in_quotes(stream.file), stream.lost_packets));
    }
  }
  // Buffers are written out for who registered, whether it emitted anything or not.
  const bool has_any = std::ranges::any_of(of_applications, has_events);
  if (!has_any && tracing_.manifest.processes.empty()) {
    tracing_.note_nothing_recorded();
  } else if (of_applications.empty()) {
    problems.emplace_back(
        fmt::format("nothing was recorded: LTTng could make no buffers for the applications {}",
                    kWhyNoBuffers));
  }
  std::vector<std::string> channels;
  for (const RecordedChannel& channel : tracing_.manifest.channels)
    channels.push_back(channel.name);
  for (const auto& [trace, channel] : absent_channels(of_applications, channels)) {
    problems.push_back(fmt::format(
        "nothing of the channel \"{}\" was recorded in {}: LTTng could make no buffers for it {}",
        channel, in_quotes(trace), kWhyNoBuffers));
  }
}

}  // namespace cie::record
