// When nobody recorded a host's applications: from the end of one session to the begin of another.
#pragma once

#include <cie/analysis/event.hpp>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace cie::analysis {

// Between traces alone, each of which is of one session. A session that was stopped for a while looks
// like one of applications that were quiet: LTTng begins a packet with its first event, so that
// times without a packet lie in any trace.
class SessionGaps {
 public:
  // Streams are told of before their packets, packets in order of time.
  void apply(const EventHead& head, const StreamBegin& event);
  // The gap that the packet ends, the first one of its trace.
  std::optional<SessionGap> apply(const EventHead& head, const PacketBegin& event);
  void apply(const EventHead& head, const PacketEnd& event);
  void apply(const EventHead& head, const StreamEnd& event);

 private:
  struct Host {
    std::uint32_t traces = 0;  // begun and not ended
    std::optional<Timestamp> end{};
    bool has_told_runs = false;  // some trace that began
  };
  struct Trace {
    Host* host = nullptr;
    std::uint32_t streams = 0;  // not ended
    bool has_begun = false;
    bool is_open = false;
    bool has_callback_events = false;
  };
  // Null: none of an application.
  Trace* trace_of(StreamIndex stream) const noexcept {
    const auto index = static_cast<std::size_t>(stream);
    return index < streams_.size() ? streams_[index] : nullptr;
  }

  std::map<std::pair<std::string, std::string>, Host> hosts_;  // by name and clock
  std::map<std::uint32_t, Trace> traces_;
  std::vector<Trace*> streams_;
};

}  // namespace cie::analysis
