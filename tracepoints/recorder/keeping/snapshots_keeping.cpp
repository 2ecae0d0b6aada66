#include "keeping/snapshots_keeping.hpp"

#include "base/text.hpp"
#include "keeping/kernel_snapshots.hpp"
#include "system/error.hpp"

#include <exception>
#include <string>

#include <fmt/format.h>

namespace cie::record {
namespace {

using FloatSeconds = std::chrono::duration<double>;

std::string in_mib(std::uint64_t bytes) {
  return fmt::format("{} MiB", (bytes + (1U << 20U) - 1) >> 20U);
}

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

bool SnapshotsKeeping::begin() {
  tracing_.start_daemon();
  state_cost();
  tracing_.create_session();
  tracing_.watch_processes();
  flight_ =
      std::make_unique<FlightRecorder>(tracing_.options(), tracing_.directory(), tracing_.session(),
                                       kernel_snapshots_of(tracing_.options()),
                                       tracing_.manifest.session.name, tracing_.processes());
  tracing_.start();
  return true;
}

// Refuses what does not fit: LTTng would let the applications run untraced.
void SnapshotsKeeping::state_cost() {
  const Options& options = tracing_.options();
  const SnapshotCost cost = snapshot_cost(options);
  if (cost.bytes > cost.free_bytes) {
    throw RecordError(
        fmt::format("keeping that in memory takes {}, and /dev/shm has {} left: ask for less with "
                    "--snapshot, --event-rate or --subbuf-size",
                    in_mib(cost.bytes), in_mib(cost.free_bytes)));
  }
  std::string text = fmt::format(
      "keeping the last {:.3g} s in memory: {} per CPU, {} in all, enough for {:.0f} events per "
      "second on each CPU\n",
      FloatSeconds(options.snapshot.value().length).count(), in_mib(cost.bytes_per_cpu),
      in_mib(cost.bytes), cost.event_rate);
  if (options.kernel == KernelChoice::yes) {
    text += fmt::format("kernel events besides: up to {} per CPU\n",
                        in_mib(KernelSnapshots::most_bytes_per_cpu(options)));
  }
  tracing_.console.say(text + fmt::format("to save them: cie record --save {}\n",
                                          shell_quoted(options.directory.string())));
}

void SnapshotsKeeping::start_reading() { flight_->start_reading(); }

void SnapshotsKeeping::abandon() noexcept {
  flight_.reset();
  tracing_.abandon();
}

void SnapshotsKeeping::on_request(Target& /*target*/) {
  if (!tracing_.is_daemon_lost()) flight_->request();
}

void SnapshotsKeeping::poll(Target& target) {
  const bool may_ask = !tracing_.is_daemon_lost() && !tracing_.is_asking();
  if (may_ask || flight_->is_saving()) look_at_flight();
  if (!flight_->is_saving()) {
    tracing_.look_for_applications(target);
    forget_processes();
  }
  if (tracing_.has_checked_daemon()) {
    tracing_.check_space();
  }
  tracing_.end_tick(target);
}

void SnapshotsKeeping::look_at_flight() {
  try {
    if (const auto saved = flight_->poll(tracing_.manifest)) tell(*saved);
  } catch (const std::exception& error) {
    tracing_.console.warn(error.what());  // the next one may succeed
  }
}

// Snapshots have their own lists.
void SnapshotsKeeping::forget_processes() {
  constexpr std::chrono::nanoseconds kLongestSaving = std::chrono::seconds{60};
  if (tracing_.poll_processes()) {
    tracing_.processes()->forget(now().monotonic_ns - kLongestSaving.count());
  }
}

void SnapshotsKeeping::tell(const SavedSnapshot& snapshot) {
  const FloatSeconds held = snapshot.held.common;
  const FloatSeconds wanted = tracing_.options().snapshot.value().length;
  tracing_.console.say(fmt::format("saved {}: the last {:.3f} s ({})\n",
                                   shell_quoted(snapshot.directory.string()), held.count(),
                                   snapshot.reason));
  if (snapshot.held.overwritten && *snapshot.held.overwritten < wanted * 0.9) {
    tracing_.console.warn(
        fmt::format("the buffers are too small for {:f} s of this application's events: a larger "
                    "--event-rate makes them larger",
                    wanted.count()));
  }
}

// What a failing command did last, and a deadline that was missed last, are worth a snapshot.
void SnapshotsKeeping::save_at_the_end() {
  RecordingManifest& manifest = tracing_.manifest;
  flight_->settle();
  if (flight_->is_saving()) look_at_flight();
  if (tracing_.is_daemon_lost()) {
    return;
  }
  if (tracing_.is_nobody_told_of()) {
    tracing_.note_nothing_recorded();
    return;
  }
  const bool is_failure = manifest.exit && manifest.exit->code != 0;
  const std::string why = is_failure ? "the command " + describe(*manifest.exit) : "";
  for (bool is_any = true; is_any;) {
    try {
      const auto saved = flight_->finish(manifest, why);
      is_any = saved.has_value();
      if (saved) tell(*saved);
    } catch (const std::exception& error) {
      add_problem(manifest.problems, error.what());
    }
  }
}

// Every snapshot has its own manifest.
Outcome SnapshotsKeeping::finish(const std::optional<ExitStatus>& exit) {
  tracing_.manifest.exit = exit;
  tracing_.settle();
  save_at_the_end();
  tracing_.end();
  const KeptInSnapshots kept{.saved = flight_->saved(),
                             .left_out = flight_->left_out(),
                             .has_kernel_events = flight_->has_kernel_events()};
  flight_.reset();
  tracing_.close();
  tracing_.release_directory();
  return {.options = tracing_.options(), .manifest = tracing_.manifest, .kept = kept};
}

}  // namespace cie::record
