#include "session_states.hpp"

#include <algorithm>

namespace cie::live {
namespace {

bool is_lost(const SessionStates::State& state) { return state.view.state == SourceState::lost; }
bool has_ended(const SessionStates::State& state) { return state.view.state == SourceState::ended; }

// One of the session, of those that tell of their end.
bool has_unended_process(const analysis::Report& report, const SessionStates::State& state) {
  return std::ranges::any_of(report.processes, [&state](const analysis::ProcessReport& process) {
    return !process.has_ended && !process.tracetools &&
           std::ranges::find_first_of(process.traces, state.traces) != process.traces.end();
  });
}

}  // namespace

std::size_t SessionStates::add(const std::string& url, Clock::time_point now) {
  states_.push_back({.url = url, .found = now, .heard = now});
  return states_.size() - 1;
}

void SessionStates::found(const std::vector<analysis::LiveSession>& there, Clock::time_point now) {
  for (const auto& session : there) {
    const auto known = std::ranges::find(states_, session.url, &State::url);
    auto& state = known != states_.end() ? *known : states_[add(session.url, now)];
    state.view.host = session.host;
    state.view.session = session.name;
  }
  for (auto& state : states_) {
    const bool is_there =
        std::ranges::find(there, state.url, &analysis::LiveSession::url) != there.end();
    if (!is_lost(state) || is_there) {
      state.missed.reset();
      continue;
    }
    if (!state.missed) {
      state.missed = now;
      state.view.message = "the relay daemon does not have it any more";
    }
    const bool is_waited_for =
        state.has_been_followed && !has_successor(state) && now - *state.missed < kGrace;
    if (!is_waited_for) state.view.state = SourceState::ended;
  }
}

void SessionStates::connected(std::size_t session) {
  auto& state = states_[session];
  state.view.state = SourceState::waiting;
  state.view.message.clear();
  state.stopped.reset();
}

void SessionStates::followed(std::size_t session, bool has_events, Clock::time_point now) {
  auto& state = states_[session];
  state.has_been_followed = true;
  if (!has_events) return;
  state.view.state = SourceState::streaming;
  state.heard = now;
}

void SessionStates::lost(std::size_t session, const std::string& why, Clock::time_point now) {
  auto& state = states_[session];
  state.view.state = SourceState::lost;
  state.view.message = why;
  state.missed.reset();
  if (!state.stopped) state.stopped = now;
}

void SessionStates::ended(std::size_t session, Clock::time_point now) {
  auto& state = states_[session];
  state.view.state = SourceState::ended;
  if (!state.stopped) state.stopped = now;
}

void SessionStates::read(std::size_t session, const std::vector<std::uint32_t>& traces) {
  for (const auto trace : traces) {
    auto& known = states_[session].traces;
    if (std::ranges::find(known, trace) == known.end()) known.push_back(trace);
  }
}

bool SessionStates::is_over() const {
  return !states_.empty() && std::ranges::all_of(states_, has_ended);
}

std::optional<std::string> SessionStates::why_lost() const {
  const auto lost = std::ranges::find_if(states_, is_lost);
  const bool is_none_read = std::ranges::all_of(
      states_, [](const State& state) { return is_lost(state) || has_ended(state); });
  if (lost == states_.end() || !is_none_read) return std::nullopt;
  return lost->view.message;
}

bool SessionStates::has_successor(const State& state) const {
  return state.stopped && std::ranges::any_of(states_, [&state](const State& other) {
           return other.view.host == state.view.host && other.found > *state.stopped;
         });
}

std::vector<HostView> SessionStates::hosts(const analysis::Report& report,
                                           Clock::time_point now) const {
  std::vector<HostView> views;
  for (const auto& state : states_) {
    if (has_ended(state) && has_successor(state)) continue;
    auto& view = views.emplace_back(state.view);
    const auto silent = now - state.heard;
    view.silent_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(silent).count();
    if (view.state == SourceState::streaming && silent > kSilence) view.state = SourceState::silent;
    if (has_ended(state) && has_unended_process(report, state)) {
      view.message = "its processes had not ended: cut off, or switched off";
    }
  }
  return views;
}

}  // namespace cie::live
