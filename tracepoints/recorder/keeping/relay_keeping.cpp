#include "keeping/relay_keeping.hpp"

#include "base/machine.hpp"
#include "keeping/attempt.hpp"
#include "keeping/manifest.hpp"

#include <algorithm>
#include <exception>
#include <iterator>
#include <string>

#include <fmt/format.h>

namespace cie::record {
namespace {

constexpr std::chrono::milliseconds kAttemptInterval{1000};
// A live reader is sent what is written from now on: what it reads would have no names.
constexpr std::chrono::seconds kDescriptionInterval{5};
// The application's command is waited for, and signals are listened to, between attempts.
constexpr std::chrono::milliseconds kAttemptPatience{500};

std::string in_seconds(std::int64_t ns) {
  return fmt::format("{:.3f} s", static_cast<double>(ns) / 1e9);
}

}  // namespace

bool RelayKeeping::begin() {
  link_ = std::make_unique<RelayLink>(tracing_.options().relay.value());
  tracing_.start_daemon();
  create_session();
  tracing_.watch_processes();
  tracing_.start();
  return true;
}

void RelayKeeping::abandon() noexcept { tracing_.abandon(); }

std::vector<RelayedSession>& RelayKeeping::sessions() {
  return tracing_.manifest.relay.value().sessions;
}

void RelayKeeping::create_session() {
  tracing_.create_session(RelayDestination{.control_url = link_->control_url(),
                                           .data_url = link_->data_url(),
                                           .interval = tracing_.options().flush_interval});
  sessions().push_back({.path = host_name() + '/' + tracing_.manifest.session.name + "-*",
                        .begin = now(),
                        .lost = std::nullopt,
                        .end = std::nullopt});
}

void RelayKeeping::on_request(Target& /*target*/) { tracing_.refuse_snapshot(); }

void RelayKeeping::poll(Target& target) {
  tracing_.look_for_applications(target);
  tracing_.note_processes();
  if (tracing_.has_checked_daemon()) watch_link();
  tracing_.end_tick(target);
}

void RelayKeeping::watch_link() {
  if (tracing_.session() && !link_->is_connected()) {
    lose_link();
  }
  if (tracing_.session() && Clock::now() >= next_description_) {
    next_description_ = Clock::now() + kDescriptionInterval;
    try {
      tracing_.session()->describe_again();
    } catch (const std::exception&) {  // a reader has to wait for the next one
    }
  }
  if (!tracing_.session() && !tracing_.is_daemon_lost() && Clock::now() >= next_attempt_) {
    next_attempt_ = Clock::now() + kAttemptInterval;
    find_link_again();
  }
}

void RelayKeeping::lose_link() {
  RelayedSession& session = sessions().back();
  session.lost = now();
  tracing_.console.warn(
      fmt::format("the connection to the relay daemon at {} is lost: nothing is recorded until it "
                  "answers again",
                  link_->address().text()));
  tracing_.end_session();  // that it is not complete is known
  tracing_.drop_session();
  session.end = now();
}

void RelayKeeping::find_link_again() {
  if (!link_->reconnect(kAttemptPatience)) {
    return;
  }
  const std::size_t before = sessions().size();
  const std::int64_t lost_ns = sessions().back().lost.value().monotonic_ns;
  try {
    create_session();
    tracing_.session()->start();
  } catch (const std::exception& error) {
    tracing_.drop_session();
    sessions().resize(before);
    tracing_.console.warn(error.what());  // the next attempt may succeed
    return;
  }
  tracing_.console.warn(fmt::format("the relay daemon at {} answers again after {}",
                                    link_->address().text(),
                                    in_seconds(sessions().back().begin.monotonic_ns - lost_ns)));
}

// The files are elsewhere: the manifest is all that is written here.
Outcome RelayKeeping::finish(const std::optional<ExitStatus>& exit) {
  RecordingManifest& manifest = tracing_.manifest;
  manifest.exit = exit;
  tracing_.begin_end();
  tracing_.settle();
  end_last_session();
  manifest.end = now();
  tracing_.note_processes();
  tracing_.close();
  attempt(manifest.problems, [&] { write_manifest(tracing_.directory(), manifest); });
  tracing_.release_directory();
  return {.options = tracing_.options(), .manifest = manifest, .kept = KeptElsewhere{}};
}

void RelayKeeping::end_last_session() {
  RecordingManifest& manifest = tracing_.manifest;
  const bool is_open = tracing_.session() != nullptr;
  if (is_open && !link_->is_connected()) sessions().back().lost = now();
  if (is_open && !tracing_.is_daemon_lost()) {
    add_problems(manifest.problems, tracing_.end_session());
  }
  const Instant end = now();
  if (is_open) sessions().back().end = end;
  note_losses(end);
  if (manifest.processes.empty()) {
    tracing_.console.warn("no traced application was seen: is there anything at the relay daemon?");
  }
}

void RelayKeeping::note_losses(const Instant& end) {
  RecordingManifest& manifest = tracing_.manifest;
  for (auto session = sessions().begin(); session != sessions().end(); ++session) {
    if (!session->lost) continue;
    const auto next = std::next(session);
    const bool is_last = next == sessions().end();
    const std::int64_t lost_ns = session->lost->monotonic_ns;
    manifest.problems.push_back(fmt::format(
        "the connection to the relay daemon at {} was lost {} after the beginning, for {}{}: "
        "events from then, and some from before, are lost and not counted",
        link_->address().text(), in_seconds(lost_ns - manifest.begin.monotonic_ns),
        in_seconds((is_last ? end : next->begin).monotonic_ns - lost_ns),
        is_last ? ", to the end" : ""));
  }
}

}  // namespace cie::record
