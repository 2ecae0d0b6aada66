// What became of the sessions that one analysis follows, as who reads them tells.
#pragma once

#include <cie/analysis/live_reader.hpp>
#include <cie/analysis/report.hpp>
#include <cie/tracepoints/schema.hpp>

#include "snapshot.hpp"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace cie::live {

class SessionStates {
 public:
  using Clock = std::chrono::steady_clock;

  // A session that is lost and not there any more may have a successor for so long: a recorder that
  // has lost its relay daemon tries to find it every second, and begins a new one.
  static constexpr std::chrono::seconds kGrace{30};
  // A traced process tells its clock in every period; what it tells is flushed and sent in others.
  static constexpr std::chrono::nanoseconds kSilence = 3 * kClockSyncPeriod;

  struct State {
    std::string url;
    HostView view{};
    std::vector<std::uint32_t> traces{};  // that were read of it
    Clock::time_point found{};
    Clock::time_point heard{};  // or found
    bool has_been_followed = false;
    std::optional<Clock::time_point> stopped{};  // lost, or ended
    std::optional<Clock::time_point> missed{};   // lost, and not there any more since
  };

  // Sessions keep their places.
  std::size_t add(const std::string& url, Clock::time_point now);
  // The relay daemon has these; what was lost and is not among them does not come back.
  void found(const std::vector<analysis::LiveSession>& there, Clock::time_point now);
  void connected(std::size_t session);
  // The connection works, and `has_events` or not.
  void followed(std::size_t session, bool has_events, Clock::time_point now);
  void lost(std::size_t session, const std::string& why, Clock::time_point now);
  void ended(std::size_t session, Clock::time_point now);
  void read(std::size_t session, const std::vector<std::uint32_t>& traces);

  std::size_t size() const noexcept { return states_.size(); }
  const std::string& url(std::size_t session) const { return states_[session].url; }
  bool is_over(std::size_t session) const {
    return states_[session].view.state == SourceState::ended;
  }
  // When the relay daemon was asked last.
  bool is_there(std::size_t session) const { return !states_[session].missed; }
  // There were some, all have ended, and none is waited for.
  bool is_over() const;
  // None is read and not all are over: why not; empty otherwise.
  std::optional<std::string> why_lost() const;
  // With what the report knows of their processes; without those that had ended when another one
  // of their machine began.
  std::vector<HostView> hosts(const analysis::Report& report, Clock::time_point now) const;

 private:
  bool has_successor(const State& state) const;

  std::vector<State> states_;
};

}  // namespace cie::live
