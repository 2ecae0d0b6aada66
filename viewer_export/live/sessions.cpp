#include "sessions.hpp"

#include <algorithm>
#include <utility>

namespace cie::live {
namespace {

using analysis::LiveReader;
using analysis::UnreadableTrace;
using std::chrono::milliseconds;

// Machines come and go rarely; each look is a connection.
constexpr milliseconds kBetweenLooks{1000};

}  // namespace

Sessions::Sessions(std::string url, analysis::Analyzer& analyzer)
    : url_(std::move(url)),
      follows_all_(url_.find("/host/") == std::string::npos),
      input_(analyzer) {
  if (!follows_all_) states_.add(url_, Clock::now());
  readers_.resize(states_.size());
}

void Sessions::connect(std::size_t session) {
  readers_[session] = std::make_unique<LiveReader>(states_.url(session), input_);
  states_.connected(session);
}

void Sessions::drop(std::size_t session) {
  if (!readers_[session]) return;
  states_.read(session, readers_[session]->traces());
  readers_[session].reset();
}

void Sessions::lose(std::size_t session, const std::string& why) {
  if (readers_[session]) readers_[session]->give_up();
  drop(session);
  states_.lost(session, why, Clock::now());
}

void Sessions::look_for_sessions() {
  if (Clock::now() < next_look_) return;
  next_look_ = Clock::now() + kBetweenLooks;
  try {
    states_.found(analysis::live_sessions(url_), Clock::now());
  } catch (const UnreadableTrace& error) {
    for (std::size_t i = 0; i < states_.size(); ++i) {
      if (!states_.is_over(i)) lose(i, error.what());
    }
    throw;
  }
  readers_.resize(states_.size());
  for (std::size_t i = 0; i < states_.size(); ++i) {
    if (readers_[i] || states_.is_over(i) || !states_.is_there(i)) continue;
    try {
      connect(i);
    } catch (const UnreadableTrace& error) {  // it may have ended meanwhile, or have a reader
      lose(i, error.what());
    }
  }
}

LiveReader::Step Sessions::step() {
  if (follows_all_) {
    look_for_sessions();
  } else if (!readers_.front() && !states_.is_over(0)) {
    connect(0);
  }
  auto result = LiveReader::Step::nothing;
  for (std::size_t i = 0; i < readers_.size(); ++i) {
    if (!readers_[i]) continue;
    try {
      const auto step = readers_[i]->step();
      if (step == LiveReader::Step::end) {
        drop(i);
        states_.ended(i, Clock::now());
        continue;
      }
      const bool has_events = step == LiveReader::Step::events;
      states_.followed(i, has_events, Clock::now());
      if (has_events) result = step;
    } catch (const UnreadableTrace& error) {
      lose(i, error.what());
      if (!follows_all_) throw;
    }
  }
  return states_.is_over() ? LiveReader::Step::end : result;
}

std::vector<HostView> Sessions::hosts(const analysis::Report& report) {
  if (!follows_all_) return {};
  for (std::size_t i = 0; i < readers_.size(); ++i) {
    if (readers_[i]) states_.read(i, readers_[i]->traces());
  }
  return states_.hosts(report, Clock::now());
}

}  // namespace cie::live
