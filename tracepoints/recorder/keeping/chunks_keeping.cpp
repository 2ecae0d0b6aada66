#include "keeping/chunks_keeping.hpp"

#include "keeping/attempt.hpp"
#include "keeping/chunk_names.hpp"
#include "keeping/kernel_beside.hpp"
#include "keeping/manifest.hpp"

#include <chrono>
#include <exception>
#include <string>
#include <utility>

namespace cie::record {
namespace {

constexpr std::chrono::minutes kSilence{1};

}  // namespace

bool ChunksKeeping::begin() {
  const Options& options = tracing_.options();
  tracing_.start_daemon();
  tracing_.create_session();
  kernel_ = start_kernel(kernel_part_directory({}, 1).string(), tracing_);
  tracing_.watch_processes();
  tracing_.start();
  rotation_ = std::make_unique<Rotation>(options, tracing_.session(), kernel_.get(),
                                         tracing_.processes(), tracing_.manifest.begin);
  return true;
}

void ChunksKeeping::start_reading() {
  if (kernel_) kernel_->start_reading();
}

void ChunksKeeping::abandon() noexcept {
  rotation_.reset();
  kernel_.reset();
  tracing_.abandon();
}

void ChunksKeeping::on_request(Target& /*target*/) { tracing_.refuse_snapshot(); }

void ChunksKeeping::poll(Target& target) {
  if (!tracing_.is_asking()) poll_rotation();
  const bool is_asking = rotation_->is_asking();
  if (is_asking) {
    warn_of_silence();
  } else {
    tracing_.look_for_applications(target);
  }
  tracing_.poll_processes();  // chunks have their own lists
  if (is_asking) {
    tracing_.check_space();
  } else if (tracing_.has_checked_daemon()) {
    adopt_clock(kernel_.get(), tracing_);
    tracing_.check_space();
  }
  tracing_.end_tick(target);
}

void ChunksKeeping::warn_of_silence() {
  const bool is_long = std::chrono::steady_clock::now() - rotation_->asked() > kSilence;
  if (!is_long || std::exchange(has_warned_of_silence_, true)) return;
  tracing_.console.warn(
      "LTTng has not answered for a minute: no chunk ends until it does (is the disk slow or full?)");
}

// What is asked at the end would wait for the answer, too.
void ChunksKeeping::settle_rotation() {
  if (tracing_.is_daemon_lost()) return;
  const auto patience = tracing_.patience();
  attempt(tracing_.manifest.problems, [&] {
    if (!rotation_->settle(patience)) {
      add_problem(tracing_.manifest.problems,
                  tracing_.give_up_daemon("answer for a chunk", patience));
    }
  });
}

void ChunksKeeping::poll_rotation() {
  if (tracing_.is_daemon_lost() || !tracing_.is_directory_there()) {
    return;
  }
  try {
    rotation_->poll(tracing_.manifest);
  } catch (const std::exception& error) {
    const bool is_news = add_problem(tracing_.manifest.problems, error.what());
    if (is_news) tracing_.console.warn(error.what());
  }
}

void ChunksKeeping::end_rotation() {
  RecordingManifest& manifest = tracing_.manifest;
  add_problems(manifest.problems, rotation_->finish(manifest, tracing_.ending()));
  if (!rotation_->has_events()) {
    tracing_.note_nothing_recorded();
  }
  manifest.processes = rotation_->processes();
  manifest.removed_chunks = rotation_->removed();
}

Outcome ChunksKeeping::finish(const std::optional<ExitStatus>& exit) {
  RecordingManifest& manifest = tracing_.manifest;
  manifest.exit = exit;
  tracing_.settle();
  settle_rotation();
  tracing_.end();
  end_kernel(std::move(kernel_), tracing_);
  tracing_.poll_processes();
  tracing_.close();
  const bool is_there = tracing_.is_directory_there();
  if (is_there) {
    attempt(manifest.problems, [this] { end_rotation(); });
    attempt(manifest.problems, [&] { write_manifest(tracing_.directory(), manifest); });
  }
  tracing_.release_directory();
  return {.options = tracing_.options(),
          .manifest = manifest,
          .is_directory_there = is_there,
          .kept = KeptInChunks{.sealed = rotation_->sealed(), .removed = rotation_->removed()}};
}

}  // namespace cie::record
