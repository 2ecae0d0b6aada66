// Streams a run to one reader instead of recording it: what `cie live` starts.
#pragma once

#include "options.hpp"
#include "relay_daemon.hpp"
#include "session_daemon.hpp"
#include "signals.hpp"
#include "tracing_session.hpp"

#include <chrono>
#include <memory>
#include <string>
#include <string_view>

namespace cie::record {

// Streams until the command, the peer or a signal ends it. What goes wrong is told to the peer, as
// a line "failed TEXT"; false then.
bool stream_live(Options options);

// Talks over a socket, in lines: it tells "url URL" when a reader may connect, and waits for
// "start"; then come "applications N" when that number changes, "lost CHANNEL EVENTS PACKETS" at
// the end, and "exit TEXT" for the command. The peer's end of the socket closed means stop.
class LiveStream {
 public:
  // Starts the daemons and sets the session up. Throws RecordError; leaves nothing behind then.
  explicit LiveStream(Options options);

  // Runs the command, or waits for a signal or the peer; then ends the session. Throws RecordError.
  void run();

 private:
  // Whether the peer is there. A line of it is left in `received_`.
  bool listen(std::chrono::milliseconds patience);
  void tell(const std::string& line);
  void look_for_applications();
  void run_command();
  void wait_attached();
  void finish();

  Options options_;
  Signals signals_;
  std::unique_ptr<SessionDaemon> daemon_;
  std::unique_ptr<RelayDaemon> relay_;
  std::unique_ptr<TracingSession> session_;
  std::string received_;
  std::size_t applications_ = 0;
  std::chrono::steady_clock::time_point next_look_{};
};

}  // namespace cie::record
