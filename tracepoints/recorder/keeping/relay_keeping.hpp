// A recording that is streamed to a relay daemon. A session of LTTng does not survive its
// connection, so when that broke and somebody answers again, another session begins: traced
// processes describe themselves again, and what was emitted in between is nowhere.
#pragma once

#include "keeping/keeping.hpp"
#include "keeping/tracing.hpp"
#include "lttng/relay_link.hpp"
#include "system/console.hpp"

#include <chrono>
#include <memory>
#include <vector>

namespace cie::record {

class RelayKeeping final : public Keeping {
 public:
  RelayKeeping(const Options& options, Console& console) : tracing_(options, console) {}

  bool begin() override;
  void abandon() noexcept override;
  void poll(Target& target) override;
  void on_request(Target& target) override;
  Outcome finish(const std::optional<ExitStatus>& exit) override;

 private:
  using Clock = std::chrono::steady_clock;

  // One after the other.
  std::vector<RelayedSession>& sessions();
  void create_session();
  void watch_link();
  void lose_link();
  void find_link_again();
  void end_last_session();
  // Of each time that the connection was lost, until `end`.
  void note_losses(const Instant& end);

  Tracing tracing_;
  std::unique_ptr<RelayLink> link_;  // null: not begun
  Clock::time_point next_attempt_ = Clock::now();
  Clock::time_point next_description_ = Clock::now();  // of traced processes, by themselves
};

}  // namespace cie::record
