// Messages linking callbacks: finds the instance that published what another one took, and measures
// path latency, reaction time and data age of the chains (definitions.md; Günzel et al. 2023).
#pragma once

#include <cie/analysis/event.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>

#include "facts.hpp"
#include "registry.hpp"

#include <deque>
#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

namespace cie::analysis {

// One instance as a link of chains. Kept alive by whoever may still descend from it.
struct ChainNode {
  CallbackIndex callback{};
  std::uint64_t seq = 0;
  EventRef start;
  std::optional<Timestamp> release;  // exact ones only
  bool is_in_window = true;          // began inside the window

  // The message it took: writer and source timestamp; parent and published are resolved from them.
  std::uint64_t writer_gid = 0;
  std::int64_t source_timestamp = 0;
  std::shared_ptr<ChainNode> parent;
  Timestamp published;  // when the parent published it
  enum class Link : std::uint8_t { source, resolved, outside, unseen };
  Link link = Link::source;  // outside: published outside any callback, or before the first seen
  std::uint32_t depth = 0;
};

class ChainTracker {
 public:
  ChainTracker(Model& model, Registry& registry, const SchedulingSpec* spec);

  // `node` is the open instance that publishes, null outside callbacks.
  void on_publish(std::uint32_t publisher, const EventRef& where, std::int64_t source_timestamp,
                  std::shared_ptr<ChainNode> node);
  // An instance began: looks up what it took.
  void link(ChainNode& node);
  // An instance in the window was completed.
  void on_complete(const std::shared_ptr<ChainNode>& node, const EventRef& end);
  void finish();

 private:
  struct Message {
    std::int64_t source_timestamp = 0;
    Timestamp time;
    std::shared_ptr<ChainNode> node;
  };
  struct Read {  // of the first callback, not yet answered by a chain that starts later
    Timestamp read;
    EventRef start;
  };
  struct Progress {
    std::vector<std::uint64_t> seqs;  // of the last chain instance, hop by hop
    Timestamp last_read;
    EventRef last_start;
    bool has_last = false;
    std::vector<Read> pending;  // ascending by read
  };
  struct Chain {
    ChainFacts facts;
    std::vector<CallbackIndex> hops;
    Progress progress;
  };
  using Path = std::vector<CallbackIndex>;

  void resolve(ChainNode& node);
  void on_specified(const std::shared_ptr<ChainNode>& node, const EventRef& end, Chain& chain);
  void on_path(const std::shared_ptr<ChainNode>& node, const EventRef& end);
  void measure(Chain& chain, const std::vector<const ChainNode*>& nodes, const EventRef& end);
  bool has_hole(const std::vector<const ChainNode*>& nodes, const Progress& progress);

  Model& model_;
  Registry& registry_;
  std::unordered_map<std::uint32_t, std::deque<Message>> messages_;  // by publisher, ascending
  std::vector<Chain> specified_;
  std::map<Path, Chain> paths_;
  bool has_spec_ = false;
};

}  // namespace cie::analysis
