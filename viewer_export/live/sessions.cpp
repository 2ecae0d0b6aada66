#include "sessions.hpp"

#include <cie/analysis/analyzer.hpp>

#include <algorithm>
#include <iterator>
#include <utility>

namespace cie::live {
namespace {

using analysis::LiveReader;
using analysis::UnreadableTrace;
using std::chrono::milliseconds;

// Machines come and go rarely; each look is a connection.
constexpr milliseconds kBetweenLooks{1000};
// A traced process tells its clock every second.
constexpr milliseconds kSilence{3000};

bool is_over(const HostView& view) { return view.state == SourceState::ended; }

}  // namespace

Sessions::Sessions(std::string url, analysis::Analyzer& analyzer)
    : url_(std::move(url)),
      follows_all_(url_.find("/host/") == std::string::npos),
      input_(analyzer) {
  if (!follows_all_) sessions_.emplace_back().url = url_;
}

void Sessions::connect(Session& session) {
  session.reader = std::make_unique<LiveReader>(session.url, input_);
  session.view.state = SourceState::waiting;
  session.view.message.clear();
  session.heard = Clock::now();
}

void Sessions::lose(Session& session, const std::string& why) {
  session.reader.reset();
  session.view.state = SourceState::lost;
  session.view.message = why;
}

void Sessions::look_for_sessions() {
  if (Clock::now() < next_look_) return;
  next_look_ = Clock::now() + kBetweenLooks;
  std::vector<analysis::LiveSession> there;
  try {
    there = analysis::live_sessions(url_);
  } catch (const UnreadableTrace& error) {
    for (auto& session : sessions_) {
      if (!is_over(session.view)) lose(session, error.what());
    }
    throw;
  }
  for (const auto& found : there) {
    const auto known = std::ranges::find(sessions_, found.url, &Session::url);
    auto& session = known != sessions_.end() ? *known : sessions_.emplace_back();
    session.url = found.url;
    session.view.host = found.host;
    session.view.session = found.name;
    if (session.reader || is_over(session.view)) continue;
    try {
      connect(session);
    } catch (const UnreadableTrace& error) {  // it may have ended meanwhile, or have a reader
      lose(session, error.what());
    }
  }
  // What broke and is not there any more does not come back: a machine that does has a new one.
  for (auto& session : sessions_) {
    const bool is_there =
        std::ranges::find(there, session.url, &analysis::LiveSession::url) != there.end();
    if (session.view.state == SourceState::lost && !is_there) {
      session.view.state = SourceState::ended;
    }
  }
}

LiveReader::Step Sessions::step() {
  if (follows_all_) {
    look_for_sessions();
  } else if (!sessions_.front().reader && !is_over(sessions_.front().view)) {
    connect(sessions_.front());
  }
  auto result = LiveReader::Step::nothing;
  for (auto& session : sessions_) {
    if (!session.reader) continue;
    try {
      const auto step = session.reader->step();
      if (step == LiveReader::Step::events) {
        session.heard = Clock::now();
        session.view.state = SourceState::streaming;
        result = step;
      } else if (step == LiveReader::Step::end) {
        session.reader.reset();
        session.view.state = SourceState::ended;
      }
    } catch (const UnreadableTrace& error) {
      lose(session, error.what());
      if (!follows_all_) throw;
    }
  }
  const bool is_end = !sessions_.empty() &&
                      std::ranges::all_of(sessions_, [](const auto& s) { return is_over(s.view); });
  return is_end ? LiveReader::Step::end : result;
}

std::vector<HostView> Sessions::hosts(const analysis::Report& report) {
  std::vector<HostView> views;
  if (!follows_all_) return views;
  for (auto session = sessions_.begin(); session != sessions_.end(); ++session) {
    auto& view = session->view;
    const bool has_successor = std::any_of(std::next(session), sessions_.end(),
                                           [&](const auto& s) { return s.view.host == view.host; });
    if (is_over(view) && has_successor) continue;
    const auto silent = Clock::now() - session->heard;
    view.silent_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(silent).count();
    if (view.state == SourceState::streaming && silent > kSilence) view.state = SourceState::silent;
    const bool is_cut = is_over(view) && std::ranges::any_of(report.processes, [&](const auto& p) {
                          return p.host == view.host && !p.has_ended;
                        });
    if (is_cut) view.message = "its processes had not ended: cut off, or switched off";
    views.push_back(view);
  }
  return views;
}

}  // namespace cie::live
