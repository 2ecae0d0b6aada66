// A recording that is streamed to a relay daemon. A session of LTTng does not survive its
// connection, so when that broke and somebody answers again, another session begins: traced
// processes describe themselves again, and what was emitted in between is nowhere.
#include "recording.hpp"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <iterator>

namespace cie::record {
namespace {

constexpr std::chrono::milliseconds kAttemptInterval{1000};
// A live reader is sent what is written from now on: what it reads would have no names.
constexpr std::chrono::seconds kDescriptionInterval{5};
// The application's command is waited for, and signals are listened to, between attempts.
constexpr std::chrono::milliseconds kAttemptPatience{500};

std::string in_seconds(std::int64_t ns) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f s", static_cast<double>(ns) / 1e9);
  return text;
}

}  // namespace

std::shared_ptr<TracingSession> Recording::new_relayed_session() {
  const RelayDestination destination{.control_url = relay_->control_url(),
                                     .data_url = relay_->data_url(),
                                     .interval = manifest_.options.flush_interval,
                                     .keeps_all = true};
  auto session =
      std::make_shared<TracingSession>(manifest_.session, manifest_.options, destination);
  manifest_.relayed.push_back(
      {.name = manifest_.session, .begin = now(), .lost = std::nullopt, .end = std::nullopt});
  return session;
}

void Recording::watch_relay() {
  if (!relay_) {
    return;
  }
  if (session_ && !relay_->is_connected()) {
    lose_relay();
  }
  if (session_ && Clock::now() >= next_description_) {
    next_description_ = Clock::now() + kDescriptionInterval;
    try {
      session_->describe_again();
    } catch (const std::exception&) {  // a reader has to wait for the next one
    }
  }
  if (!session_ && !is_daemon_lost_ && Clock::now() >= next_attempt_) {
    next_attempt_ = Clock::now() + kAttemptInterval;
    find_relay_again();
  }
}

void Recording::lose_relay() {
  manifest_.relayed.back().lost = now();
  warn("the connection to the relay daemon at " + relay_->address().text() +
       " is lost: nothing is recorded until it answers again");
  end_session();  // that it is not complete is known
  session_.reset();
  manifest_.relayed.back().end = now();
}

void Recording::find_relay_again() {
  if (!relay_->reconnect(kAttemptPatience)) {
    return;
  }
  const std::int64_t lost_ns = manifest_.relayed.back().lost->monotonic_ns;
  try {
    manifest_.session = new_session_name(manifest_.options);
    auto session = new_relayed_session();
    session->start();
    session_ = std::move(session);
  } catch (const std::exception& error) {
    if (manifest_.relayed.back().name == manifest_.session) manifest_.relayed.pop_back();
    warn(error.what());  // the next attempt may succeed
    return;
  }
  warn("the relay daemon at " + relay_->address().text() + " answers again after " +
       in_seconds(manifest_.relayed.back().begin.monotonic_ns - lost_ns));
}

void Recording::finish_relayed() {
  if (session_ && !relay_->is_connected()) manifest_.relayed.back().lost = now();
  if (session_ && !is_daemon_lost_) {
    auto problems = end_session();
    std::ranges::move(problems, std::back_inserter(manifest_.problems));
  }
  const Instant end = now();
  if (session_) manifest_.relayed.back().end = end;
  for (auto session = manifest_.relayed.begin(); session != manifest_.relayed.end(); ++session) {
    if (!session->lost) continue;
    const auto next = std::next(session);
    const bool is_last = next == manifest_.relayed.end();
    const Instant& until = is_last ? end : next->begin;
    problem("the connection to the relay daemon at " + relay_->address().text() + " was lost " +
            in_seconds(session->lost->monotonic_ns - manifest_.begin.monotonic_ns) +
            " after the beginning, for " +
            in_seconds(until.monotonic_ns - session->lost->monotonic_ns) +
            (is_last ? ", to the end" : "") +
            ": events from then, and some from before, are lost and not counted");
  }
  if (manifest_.processes.empty()) {
    warn("no traced application was seen: is there anything at the relay daemon?");
  }
}

}  // namespace cie::record
