// What a recording that goes on for ever does besides: snapshots of what it keeps in memory, and
// chunks.
#include "error.hpp"
#include "recording.hpp"

#include <algorithm>
#include <iterator>
#include <memory>
#include <string>

namespace cie::record {
namespace {

// Null: they are not asked for.
std::unique_ptr<KernelSnapshots> kernel_snapshots_of(const Options& options) {
  if (options.kernel != KernelChoice::yes) {
    return nullptr;
  }
  try {
    return std::make_unique<KernelSnapshots>(
        open_kernel_source(options.kernel_route, options.kernel_buffer_size), options);
  } catch (const RecordError& error) {
    throw RecordError(std::string("--kernel=yes: ") + error.what());
  }
}

}  // namespace

void Recording::start_flight_recorder() {
  if (manifest_.options.snapshot) {
    flight_ = std::make_unique<FlightRecorder>(
        manifest_.options, session_, kernel_snapshots_of(manifest_.options), manifest_.session);
  }
}

void Recording::serve_flight_recorder(bool is_asked) {
  if (is_asked && !flight_) {
    warn(
        "SIGUSR1 has a snapshot saved; this recorder, started without --snapshot, keeps "
        "everything");
  }
  if (!flight_ || is_daemon_lost_) {
    return;
  }
  try {
    if (is_asked) {
      tell(flight_->save_on_command(manifest_));
    }
    if (const auto saved = flight_->poll(manifest_)) {
      tell(*saved);
    }
  } catch (const std::exception& error) {
    warn(error.what());  // the next one may succeed
  }
}

// What a failing command did last, and a deadline that was missed last, are worth a snapshot.
void Recording::end_flight() {
  if (!flight_ || is_daemon_lost_) {
    return;
  }
  const bool is_failure = manifest_.exit && manifest_.exit->code != 0;
  try {
    const auto saved =
        is_failure ? flight_->save_unasked("the command " + describe(*manifest_.exit), manifest_)
                   : flight_->finish(manifest_);
    if (saved) {
      tell(*saved);
    }
  } catch (const std::exception& error) {
    problem(error.what());
  }
}

void Recording::serve_rotation() {
  if (!rotation_ || is_daemon_lost_) {
    return;
  }
  try {
    rotation_->poll(manifest_);
  } catch (const std::exception& error) {
    warn(error.what());
    problem(error.what());
  }
}

void Recording::end_rotation() {
  std::ranges::move(rotation_->finish(manifest_), std::back_inserter(manifest_.problems));
  if (rotation_->sealed() == 0) {
    note_nothing_recorded();
  }
}

}  // namespace cie::record
