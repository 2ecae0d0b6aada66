// The facts a trace gives about its processes, threads, callbacks and messages: plain data, filled
// by the trackers in one pass, read by the rules and the report. Bounded: per subject, never per
// instance. Indices are dense and stable; vectors of Model are in order of first appearance, which
// is not an order to print in.
#pragma once

#include <cie/analysis/recording.hpp>

#include "callback_facts.hpp"
#include "knowledge/knowledge.hpp"
#include "recording_facts.hpp"
#include "thread_facts.hpp"

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace cie::analysis {

struct Model {
  std::vector<std::string> paths{};
  std::vector<Recording> recordings{};  // what they say of themselves
  std::vector<HostFacts> hosts{};
  std::map<HostPair, HostClockFacts> host_clocks{};  // of hosts that exchange messages
  std::vector<StreamFacts> streams{};
  std::map<std::uint32_t, ChannelFacts> channels{};
  // Where events may be missing, as trackers noticed it: every loss by itself.
  Knowledge gaps{};
  std::vector<Loss> losses{};  // of more than 100 000 some stand for several
  std::vector<RunsBetweenSessions> between_sessions{};
  std::vector<HostGap> session_gaps{};  // between sessions, whatever lived then; by time
  // Before the window that was asked for, the last one of each host and domain: state from before
  // holds in the window, and may be what was lost.
  std::vector<Loss> losses_before{};
  // Deques, because trackers hold references and observers hold views of names.
  std::deque<ProcessFacts> processes{};
  std::deque<ThreadFacts> threads{};
  std::deque<CallbackFacts> callbacks{};
  std::deque<CallbackOnThread> pairs{};  // by first start
  std::vector<NodeFacts> nodes{};
  std::deque<GroupFacts> groups{};
  std::deque<PublisherFacts> publishers{};
  std::vector<ForkFacts> forks{};
  std::vector<ChainFacts> chains{};
  // Topics that somebody writes whose publications are not recorded, where that leaves open which
  // publications of others were taken; since which message that shows.
  std::map<std::string, EventRef, std::less<>> unseen_writers{};
  std::uint64_t unlisted_chain_instances = 0;  // of paths that are too long, or too many
  std::vector<MessageEdgeFacts> edges{};
  EventCounts events{};
  TimeRegressionFacts time_regressions{};
  // Names of threads that were made after the window that was asked for, and run no callback.
  std::set<std::string> later_threads{};
  bool clocks_unrelated = false;  // streams of one host disagree about the boot, as far as is known
  // What all user channels cover (all channels, if there is no user channel); their hull where they
  // have nothing in common.
  std::optional<Timestamp> begin{};
  std::optional<Timestamp> end{};
  std::optional<Timestamp> recording_begin{};  // the same without the window that was asked for
  // What any of the streams that tell of runs covers, in the window that was asked for.
  std::optional<TimeWindow> covered_by_any{};
};

// Null: neither it nor one of a higher number has begun.
inline const StreamFacts* find_stream(const Model& model, StreamIndex index) noexcept {
  const auto place = static_cast<std::size_t>(index);
  return place < model.streams.size() ? &model.streams[place] : nullptr;
}
inline StreamFacts* find_stream(Model& model, StreamIndex index) noexcept {
  const auto place = static_cast<std::size_t>(index);
  return place < model.streams.size() ? &model.streams[place] : nullptr;
}

}  // namespace cie::analysis
