#include "keeping/rotation.hpp"

#include <cie/tracepoints/recording_layout.hpp>

#include "base/text.hpp"
#include "ctf/stream_check.hpp"
#include "keeping/chunk_names.hpp"
#include "keeping/manifest.hpp"
#include "system/directory_claim.hpp"
#include "system/error.hpp"

#include <algorithm>
#include <exception>
#include <iterator>
#include <system_error>
#include <utility>

#include <fmt/format.h>

namespace cie::record {
namespace {

namespace fs = std::filesystem;

// Where LTTng puts chunks that are complete.
constexpr const char* kArchives = "archives";
constexpr const char* kOnlyDomain = "ust";

// Chunks that LTTng has written, or was writing when it was killed.
std::vector<fs::path> unsealed_in(const fs::path& directory) {
  // Before the first chunk ended it has no directory of its own.
  if (fs::exists(directory / kOnlyDomain)) {
    fs::create_directories(directory / "first-0");
    fs::rename(directory / kOnlyDomain, directory / "first-0" / kOnlyDomain);
  }
  std::vector<fs::path> chunks = directories_in(directory / kArchives);
  std::ranges::copy_if(
      directories_in(directory), std::back_inserter(chunks), [](const fs::path& path) {
        return path.filename() != kArchives && !is_chunk(path) && !is_kernel_part(path);
      });
  return chunks;
}

// What LTTng takes seldom longer for.
constexpr std::chrono::seconds kUsualAnswer{1};

bool has_events_of_user(const StreamSummary& stream) {
  return stream.file.parent_path().filename() != kKernelDirectory && has_events(stream);
}

// What is said of the whole and holds for a chunk.
RecordingManifest part_of(RecordingManifest whole) {
  whole.removed_chunks.reset();
  whole.has_kernel_events = false;
  whole.channels.clear();
  whole.problems.clear();
  whole.kernel.problems.clear();
  return whole;
}

}  // namespace

Rotation::Rotation(const Options& options, std::shared_ptr<TracingSession> session,
                   KernelRecording* kernel, ProcessWatch* processes, const Instant& begin)
    : options_(options.rotate.value()),
      directory_(options.directory),
      session_(std::move(session)),
      next_(Clock::now() + options_.interval),
      chunk_begin_(now()),
      kernel_(kernel),
      processes_(processes),
      settled_ns_(begin.monotonic_ns),
      settled_next_ns_(begin.monotonic_ns) {}

void Rotation::poll(const RecordingManifest& about) {
  if (sealing_.valid()) {
    if (sealing_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
      note_sealed();
    }
  } else if (beginning_) {
    if (beginning_->is_done()) note_begun();
  } else if (!pending_ && Clock::now() >= next_) {
    begin_chunk();
  }
  if (pending_) ask_for_chunk(about);
}

bool Rotation::is_asking() const noexcept {
  return (beginning_ && !beginning_->is_done()) || (asking_ && !asking_->is_done());
}

bool Rotation::settle(std::chrono::seconds patience) {
  if (beginning_) {
    if (!beginning_->is_done(patience)) return false;
    note_begun();
  }
  if (!asking_) return true;
  if (!asking_->is_done(patience)) return false;
  asking_.reset();
  return true;
}

void Rotation::begin_chunk() {
  next_ = std::max(next_ + options_.interval, Clock::now());
  chunk_end_ = now();
  asked_ = Clock::now();
  beginning_.emplace([session = session_] {
    PendingChunk before = session->begin_chunk();
    return Begun{.before = std::move(before), .at_ns = now().monotonic_ns};
  });
  if (beginning_->is_done(kUsualAnswer)) note_begun();
}

void Rotation::note_begun() {
  auto begun = answer_of(beginning_);
  pending_ = std::make_shared<PendingChunk>(std::move(begun.before));
  is_described_ = false;
  settled_next_ns_ = begun.at_ns;
  if (kernel_ != nullptr) {
    kernel_->go_on_in(make_own(kernel_part_directory(directory_, kernel_parts_ + 1)));
    kernel_part_ = end_kernel_part(kernel_->summary());
  }
}

// Once the new chunk has its description, so that it can be read without those before it.
void Rotation::ask_for_chunk(const RecordingManifest& about) {
  if (!asking_) {
    asked_ = Clock::now();
    const bool is_described = std::exchange(is_described_, true);
    asking_.emplace([session = session_, pending = pending_, is_described] {
      Answer answer;
      try {
        if (!is_described) session->describe_again();
      } catch (const std::exception& error) {
        answer.problem = error.what();
      }
      answer.chunk = pending->poll();
      return answer;
    });
  }
  if (!asking_->is_done(kUsualAnswer)) return;
  const auto pending = std::exchange(pending_, nullptr);
  const Answer answer = answer_of(asking_);
  if (answer.chunk) {
    seal_chunk(*answer.chunk, about);
  } else {
    pending_ = pending;
  }
  if (!answer.problem.empty()) throw RecordError(answer.problem);
}

void Rotation::seal_chunk(const fs::path& chunk, const RecordingManifest& about) {
  RecordingManifest manifest = part_of(about);
  manifest.begin = std::exchange(chunk_begin_, chunk_end_);
  manifest.end = chunk_end_;
  manifest.chunk = sealed_ + 1;
  note_processes(manifest, chunk_end_);
  sealing_ = std::async(std::launch::async, &Rotation::seal, this, chunk,
                        std::exchange(kernel_part_, std::nullopt), std::move(manifest));
}

Rotation::KernelPart Rotation::end_kernel_part(const RecordedKernel& total) {
  KernelPart part{.directory = kernel_part_directory(directory_, kernel_parts_++),
                  .measured = total};
  part.measured.events = total.events.value_or(0) - kernel_before_.events.value_or(0);
  part.measured.lost_events -= kernel_before_.lost_events;
  part.measured.untold_switches -= kernel_before_.untold_switches;
  kernel_before_ = total;
  return part;
}

// A process whose `run_begin` was emitted while LTTng went on to the next chunk is in one of the
// two, so it is named where both are: by the whole.
void Rotation::note_processes(RecordingManifest& manifest, const Instant& end) {
  manifest.processes.clear();
  if (processes_ == nullptr) return;
  processes_->catch_up();
  manifest.processes = processes_->begun(settled_ns_, end.monotonic_ns);
  manifest.names_all_processes = !processes_->has_missed();
  if (settled_next_ns_ > end.monotonic_ns) {
    passing_[*manifest.chunk] = processes_->begun(end.monotonic_ns, settled_next_ns_);
  }
  settled_ns_ = settled_next_ns_;
  processes_->forget(settled_ns_);
}

std::vector<RecordedProcess> Rotation::processes() const {
  std::vector<RecordedProcess> all;
  for (const auto& [number, processes] : begun_)
    all = merged(std::move(all), processes);
  for (const auto& [number, processes] : passing_)
    all = merged(std::move(all), processes);
  return all;
}

std::vector<std::string> Rotation::finish(const RecordingManifest& about, const Instant& until) {
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
  const bool has_two = beginning_ || std::exchange(pending_, nullptr) != nullptr;
  const std::vector<fs::path> chunks = unsealed_in(directory_);
  for (const fs::path& chunk : chunks) {
    RecordingManifest manifest = part_of(about);
    manifest.begin = chunk_begin_;
    std::optional<KernelPart> kernel = std::exchange(kernel_part_, std::nullopt);
    if (!kernel && chunk == chunks.back() && about.has_kernel_events) {
      kernel = end_kernel_part(about.kernel);
    }
    const bool is_last = !has_two || chunk == chunks.back();
    if (!is_last) {
      manifest.end = chunk_begin_ = chunk_end_;
    }
    manifest.chunk = sealed_ + 1;
    note_processes(manifest, is_last ? until : chunk_end_);
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
  has_events_ = has_events_ || sealed.has_events;
  if (sealed.is_kept) {
    ++sealed_;
    begun_[sealed_] = sealed.processes;
    remove_old();
  }
  if (!sealed.problem.empty()) {
    throw RecordError(sealed.problem);
  }
}

Rotation::Sealed Rotation::seal(const fs::path& chunk, const std::optional<KernelPart>& kernel,
                                RecordingManifest manifest) {
  describe_streams(chunk, manifest);
  if (check_streams(chunk).empty()) {
    fs::remove_all(chunk);  // no application ran
    if (kernel) fs::remove_all(kernel->directory);
    return {};
  }
  if (kernel) {
    fs::rename(kernel->directory, chunk / kKernelDirectory);
    note_kernel(kernel->measured, manifest);
  }
  write_manifest(open_own(chunk), manifest);
  const fs::path sealed = chunk_directory(directory_, *manifest.chunk);
  fs::rename(chunk, sealed);
  Sealed result{.is_kept = true,
                .has_events = !manifest.processes.empty() ||
                              std::ranges::any_of(check_streams(sealed), has_events_of_user),
                .processes = manifest.processes,
                .problem = {}};
  for (const std::string& problem : manifest.problems) {
    result.problem += (result.problem.empty() ? in_quotes(sealed) + ": " : "; ") + problem;
  }
  return result;
}

// What was lost in this chunk: LTTng counts from the session's begin.
void Rotation::describe_streams(const fs::path& chunk, RecordingManifest& manifest) {
  std::map<std::string, RecordedChannel> losses;
  for (const StreamSummary& stream : check_streams(chunk)) {
    StreamEnd& before = streams_[stream.file.lexically_relative(chunk)];
    RecordedChannel& loss = losses[std::string(channel_of(stream.file.filename().string()))];
    const std::uint64_t lost =
        stream.lost_packets - std::min(stream.lost_packets, before.next_packet);
    loss.lost_packets += lost;
    if (stream.packets > 0) {
      loss.discarded_events += stream.discarded_events - before.discarded_events;
      before = {.next_packet = stream.next_packet, .discarded_events = stream.discarded_events};
    }
    if (auto why = incompleteness_of(stream); !why.empty())
      manifest.problems.push_back(std::move(why));
    if (lost > 0) {
      manifest.problems.push_back(fmt::format("{} lacks {} packets", in_quotes(stream.file), lost));
    }
  }
  for (auto& [channel, loss] : losses) {
    loss.name = channel;
    manifest.channels.push_back(std::move(loss));
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
    begun_.erase(chunk_number(chunks.front()));
    passing_.erase(chunk_number(chunks.front()));
    chunks.erase(chunks.begin());
    ++removed_;
  }
}

}  // namespace cie::record
