// The live sessions that one analysis follows: one, or all that a relay daemon has, as they come.
#pragma once

#include <cie/analysis/live_reader.hpp>

#include "session_states.hpp"
#include "snapshot.hpp"

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace cie::live {

class Sessions {
 public:
  // `url`: a session's, or a relay daemon's, net://HOST[:PORT]: then every session there is
  // followed, those that begin later too, and the end of one is not the end of the others.
  // `analyzer` is borrowed.
  Sessions(std::string url, analysis::Analyzer& analyzer);

  // Connects to what there is to connect to, and reads what has come. `end`: every session ended,
  // and of those that were lost and are not there any more none has a successor in good time.
  // Throws UnreadableTrace when the connection to the relay daemon, or to the only session, cannot
  // be made or is lost; call again to try again.
  analysis::LiveReader::Step step();
  // Before the analyzer's: feeds it what follows from all that was read.
  void finish() { input_.finish(); }

  // None is read now, and some are tried again or waited for: why; empty otherwise.
  std::optional<std::string> why_lost() const { return states_.why_lost(); }
  // What became of each, with what the report knows of their processes; without those that had
  // ended when another one of their machine began. Empty where one session is followed.
  std::vector<HostView> hosts(const analysis::Report& report);

 private:
  using Clock = SessionStates::Clock;

  void look_for_sessions();
  void connect(std::size_t session);
  void drop(std::size_t session);
  void lose(std::size_t session, const std::string& why);

  std::string url_;
  bool follows_all_;
  analysis::LiveInput input_;
  SessionStates states_;
  std::vector<std::unique_ptr<analysis::LiveReader>> readers_;  // null: not connected, or ended
  Clock::time_point next_look_{};
};

}  // namespace cie::live
