// The live sessions that one analysis follows: one, or all that a relay daemon has, as they come.
#pragma once

#include <cie/analysis/live_reader.hpp>

#include "snapshot.hpp"

#include <chrono>
#include <memory>
#include <string>
#include <vector>

namespace cie::live {

class Sessions {
 public:
  // `url`: a session's, or a relay daemon's, net://HOST[:PORT]: then every session there is
  // followed, those that begin later too, and the end of one is not the end of the others.
  // `analyzer` is borrowed.
  Sessions(std::string url, analysis::Analyzer& analyzer);

  // Connects to what there is to connect to, and reads what has come. `end`: every session ended.
  // Throws UnreadableTrace when the connection to the relay daemon, or to the only session, cannot
  // be made or is lost; call again to try again.
  analysis::LiveReader::Step step();
  // Before the analyzer's: feeds it what follows from all that was read.
  void finish() { input_.finish(); }

  // What became of each, with what the report knows of their processes; without those that ended
  // and were followed by another one of their machine. Empty where one session is followed.
  std::vector<HostView> hosts(const analysis::Report& report);

 private:
  using Clock = std::chrono::steady_clock;
  struct Session {
    std::string url;
    HostView view;
    std::unique_ptr<analysis::LiveReader> reader;  // null: not connected, or ended
    Clock::time_point heard = Clock::now();
  };

  void look_for_sessions();
  void connect(Session& session);
  void lose(Session& session, const std::string& why);

  std::string url_;
  bool follows_all_;
  analysis::LiveInput input_;
  std::vector<Session> sessions_;
  Clock::time_point next_look_{};
};

}  // namespace cie::live
