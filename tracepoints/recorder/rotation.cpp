#include "rotation.hpp"

#include "error.hpp"
#include "stream_check.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <string_view>
#include <system_error>
#include <utility>

namespace cie::record {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPrefix = "chunk-";
// Where LTTng puts chunks that are complete.
constexpr const char* kArchives = "archives";
constexpr const char* kOnlyDomain = "ust";

constexpr std::string_view kKernelPrefix = "kernel-";

fs::path numbered(const fs::path& directory, std::string_view prefix, std::uint64_t number) {
  char digits[32];
  std::snprintf(digits, sizeof digits, "%06llu", static_cast<unsigned long long>(number));
  return directory / (std::string(prefix) + digits);
}

// LTTng ends their names with "-" and their number.
std::uint64_t number_of(const fs::path& chunk) {
  const std::string name = chunk.filename().string();
  return std::strtoull(name.c_str() + name.rfind('-') + 1, nullptr, 10);
}

std::vector<fs::path> directories_in(const fs::path& directory) {
  std::vector<fs::path> found;
  if (fs::is_directory(directory)) {
    for (const fs::directory_entry& entry : fs::directory_iterator(directory)) {
      if (entry.is_directory()) {
        found.push_back(entry.path());
      }
    }
  }
  std::ranges::sort(found, {}, number_of);
  return found;
}

bool is_sealed(const fs::path& directory) {
  return directory.filename().string().starts_with(kPrefix);
}

// Chunks that LTTng has written, or was writing when it was killed.
std::vector<fs::path> unsealed_in(const fs::path& directory) {
  // Before the first chunk ended it has no directory of its own.
  if (fs::exists(directory / kOnlyDomain)) {
    fs::create_directories(directory / "first-0");
    fs::rename(directory / kOnlyDomain, directory / "first-0" / kOnlyDomain);
  }
  std::vector<fs::path> chunks = directories_in(directory / kArchives);
  std::ranges::copy_if(directories_in(directory), std::back_inserter(chunks),
                       [](const fs::path& path) {
                         return path.filename() != kArchives && !is_sealed(path) &&
                                !path.filename().string().starts_with(kKernelPrefix);
                       });
  return chunks;
}

// "events_1": the stream of CPU 1 of the channel "events".
std::string channel_of(const fs::path& stream) {
  const std::string name = stream.filename().string();
  return name.substr(0, name.rfind('_'));
}

}  // namespace

std::vector<fs::path> chunks_in(const fs::path& directory) {
  std::vector<fs::path> chunks = directories_in(directory);
  std::erase_if(chunks, [](const fs::path& path) { return !is_sealed(path); });
  return chunks;
}

fs::path kernel_part_directory(const fs::path& recording, std::uint64_t number) {
  return numbered(recording, kKernelPrefix, number);
}

Rotation::Rotation(const Options& options, std::shared_ptr<TracingSession> session,
                   KernelRecording* kernel)
    : options_(options.rotate.value()),
      directory_(options.directory),
      session_(std::move(session)),
      next_(Clock::now() + options_.interval),
      chunk_begin_(now()),
      kernel_(kernel) {}

void Rotation::poll(const Manifest& about) {
  if (sealing_.valid()) {
    if (sealing_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
      note_sealed();
    }
  } else if (pending_) {
    PendingChunk pending = std::move(*std::exchange(pending_, std::nullopt));
    const auto chunk = pending.poll();
    if (!chunk) {
      pending_.emplace(std::move(pending));
      return;
    }
    Manifest manifest = about;
    manifest.problems.clear();
    manifest.begin = std::exchange(chunk_begin_, chunk_end_);
    manifest.end = chunk_end_;
    manifest.chunk = sealed_ + 1;
    sealing_ = std::async(std::launch::async, &Rotation::seal, this, *chunk,
                          std::exchange(kernel_part_, std::nullopt), std::move(manifest));
  } else if (Clock::now() >= next_) {
    begin_chunk();
  }
}

void Rotation::begin_chunk() {
  next_ = std::max(next_ + options_.interval, Clock::now());
  chunk_end_ = now();
  pending_.emplace(session_->begin_chunk());
  if (kernel_ != nullptr) {
    kernel_->go_on_in(kernel_part_directory(directory_, kernel_parts_ + 1));
    kernel_part_ = end_kernel_part(kernel_->summary());
  }
  session_->describe_again();  // so that the new chunk can be read without those before it
}

Rotation::KernelPart Rotation::end_kernel_part(const KernelSummary& total) {
  KernelPart part{.directory = kernel_part_directory(directory_, kernel_parts_++),
                  .summary = total};
  part.summary.events -= kernel_before_.events;
  part.summary.lost_events -= kernel_before_.lost_events;
  part.summary.untold_switches -= kernel_before_.untold_switches;
  kernel_before_ = total;
  return part;
}

std::vector<std::string> Rotation::finish(const Manifest& about) {
  std::vector<std::string> problems;
  const auto note = [&] {
    try {
      note_sealed();
    } catch (const std::exception& error) {
      problems.emplace_back(error.what());
    }
  };
  if (sealing_.valid()) {
    note();
  }
  const bool has_two = std::exchange(pending_, std::nullopt).has_value();
  const std::vector<fs::path> chunks = unsealed_in(directory_);
  for (const fs::path& chunk : chunks) {
    Manifest manifest = about;
    manifest.begin = chunk_begin_;
    manifest.losses.clear();
    manifest.problems.clear();
    std::optional<KernelPart> kernel = std::exchange(kernel_part_, std::nullopt);
    if (!kernel && chunk == chunks.back() && about.kernel) {
      kernel = end_kernel_part(*about.kernel);
    }
    if (has_two && chunk != chunks.back()) {
      manifest.end = chunk_begin_ = chunk_end_;
    }
    manifest.chunk = sealed_ + 1;
    sealing_ = std::async(std::launch::deferred, &Rotation::seal, this, chunk, kernel,
                          std::move(manifest));
    note();
  }
  std::error_code ignored;
  fs::remove(directory_ / kArchives, ignored);
  return problems;
}

void Rotation::note_sealed() {
  const Sealed sealed = sealing_.get();
  if (sealed.is_kept) {
    ++sealed_;
    remove_old();
  }
  if (!sealed.problem.empty()) {
    throw RecordError(sealed.problem);
  }
}

Rotation::Sealed Rotation::seal(const fs::path& chunk, const std::optional<KernelPart>& kernel,
                                Manifest manifest) {
  manifest.options.directory = chunk;
  describe_streams(manifest);
  manifest.kernel.reset();
  if (check_streams(chunk).empty()) {
    fs::remove_all(chunk);  // no application ran
    if (kernel) fs::remove_all(kernel->directory);
    return {};
  }
  if (kernel) {
    fs::rename(kernel->directory, chunk / "kernel");
    manifest.kernel = kernel->summary;
  }
  write_manifest(manifest);
  const fs::path sealed = numbered(directory_, kPrefix, *manifest.chunk);
  fs::rename(chunk, sealed);
  Sealed result{.is_kept = true, .problem = {}};
  for (const std::string& problem : manifest.problems) {
    result.problem += (result.problem.empty() ? in_quotes(sealed) + ": " : "; ") + problem;
  }
  return result;
}

// What was lost in this chunk: LTTng counts from the session's begin.
void Rotation::describe_streams(Manifest& manifest) {
  std::map<std::string, ChannelLoss> losses;
  for (const StreamSummary& stream : check_streams(manifest.options.directory)) {
    StreamEnd& before = streams_[stream.file.lexically_relative(manifest.options.directory)];
    ChannelLoss& loss = losses[channel_of(stream.file)];
    const std::uint64_t lost =
        stream.lost_packets - std::min(stream.lost_packets, before.next_packet);
    loss.lost_packets += lost;
    if (stream.packets > 0) {
      loss.discarded_events += stream.discarded_events - before.discarded_events;
      before = {.next_packet = stream.next_packet, .discarded_events = stream.discarded_events};
    }
    if (stream.is_damaged) {
      manifest.problems.push_back(in_quotes(stream.file) +
                                  " ends within a packet (is the disk full?)");
    }
    if (lost > 0) {
      manifest.problems.push_back(in_quotes(stream.file) + " lacks " + std::to_string(lost) +
                                  " packets");
    }
  }
  for (auto& [channel, loss] : losses) {
    loss.name = channel;
    manifest.losses.push_back(std::move(loss));
  }
}

void Rotation::remove_old() noexcept {
  if (options_.most == 0) {
    return;
  }
  std::error_code ignored;
  std::vector<fs::path> chunks = chunks_in(directory_);
  while (chunks.size() > options_.most) {
    fs::remove_all(chunks.front(), ignored);
    chunks.erase(chunks.begin());
    ++removed_;
  }
}

}  // namespace cie::record
