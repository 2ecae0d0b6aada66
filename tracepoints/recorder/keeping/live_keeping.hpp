// Nothing is kept: what is traced is sent to one reader, `cie live`, which starts this program.
#pragma once

#include "keeping/keeping.hpp"
#include "lttng/consumer_daemons.hpp"
#include "lttng/relay_daemon.hpp"
#include "lttng/session_daemon.hpp"
#include "lttng/tracing_session.hpp"

#include <chrono>
#include <cstddef>
#include <memory>
#include <string>

namespace cie::record {

// Talks over a socket, in lines: it tells "url URL" when a reader may connect, and waits for
// "start"; then come "applications N" when that number changes, "lost CHANNEL EVENTS PACKETS" at
// the end, "exit TEXT" for the command, and "failed TEXT" if anything goes wrong; "note TEXT" at any
// time, for the user. The peer's end of the socket closed means stop: a command that goes on is
// killed.
class LiveKeeping final : public Keeping {
 public:
  explicit LiveKeeping(const Options& options);

  bool begin() override;
  void poll(Target& target) override;
  void on_request(Target& target) override;
  Outcome finish(const std::optional<ExitStatus>& exit) override;

  void tell(std::string line) const;

 private:
  // Whether the peer is there. A line of it is left in `received_`.
  bool listen(std::chrono::milliseconds patience);
  void look_for_applications();
  // Empty: all of LTTng's that it needs run.
  std::string ended_daemon() const;

  Options options_;
  std::unique_ptr<SessionDaemon> daemon_;
  ConsumerDaemons consumers_;
  std::unique_ptr<RelayDaemon> relay_;
  std::unique_ptr<TracingSession> session_;
  std::string received_;
  bool is_wanted_ = true;
  std::size_t applications_ = 0;
  std::chrono::steady_clock::time_point next_look_{};
};

}  // namespace cie::record
