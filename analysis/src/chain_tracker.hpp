// Messages linking callbacks: finds the instance that published what another one took, and measures
// path latency, reaction time and data age of the chains (definitions.md; Günzel et al. 2023).
#pragma once

#include <cie/analysis/event.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>

#include "by_index.hpp"
#include "chain_node.hpp"
#include "facts.hpp"
#include "host_clocks.hpp"
#include "recent.hpp"
#include "registry.hpp"

#include <cstddef>
#include <map>
#include <optional>
#include <utility>
#include <vector>

namespace cie::analysis {

class ChainTracker {
 public:
  ChainTracker(Model& model, Registry& registry, HostClocks& clocks, const SchedulingSpec* spec);

  // A node for an instance that begins. Valid as long as the tracker.
  ChainNodeRef new_node() { return nodes_.take(); }
  // `node` is the open instance that publishes, null outside callbacks.
  void on_publish(std::uint32_t publisher, const EventRef& where, std::int64_t source_timestamp,
                  ChainNodeRef node);
  // An instance began: looks up what it took.
  void link(ChainNode& node);
  // An instance in the window was completed.
  void on_complete(ChainNode& node, const EventRef& end);
  // Fills the model's chains and edges. May be called again after more instances.
  void finish();

 private:
  static constexpr std::size_t kMaxMessages = 1024;  // per publisher, waiting to be taken

  struct Message {
    std::int64_t source_timestamp = 0;
    Timestamp time;
    ChainNodeRef node;
  };
  struct Read {  // of the first callback, not yet answered by a chain that starts later
    Timestamp read;
    EventRef start;
  };
  // What is measured of one instance of a chain, all by the clock of its last callback's host.
  struct Spans {
    bool is_exact = true;             // all releases are
    std::optional<Duration> to_last;  // what to add to the first callback's times
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
  using Paths = std::map<Path, Chain>;
  using Nodes = std::vector<const ChainNode*>;

  void resolve(ChainNode& node);
  void note_edge(const ChainNode& node);
  void on_specified(const ChainNode& node, const EventRef& end, Chain& chain);
  void on_path(const ChainNode& node, const EventRef& end);
  // The chain of a path, new if it is; null if there are too many.
  Chain* chain_of(const Nodes& nodes);
  static Spans spans_of(const Nodes& nodes);
  static void note_latency(ChainFacts& facts, const Nodes& nodes, const EventRef& end);
  void measure(Chain& chain, const Nodes& nodes, const EventRef& end);
  bool has_hole(const Nodes& nodes, const Progress& progress);

  Model& model_;
  Registry& registry_;
  HostClocks& clocks_;
  ChainNodePool nodes_;
  ByIndex<std::uint32_t, Recent<Message, kMaxMessages>> messages_;  // by publisher
  std::vector<Chain> specified_;
  Paths paths_;
  ByIndex<CallbackIndex, Paths::value_type*> last_path_to_;                // null: none yet
  using EdgeKey = std::pair<CallbackIndex, std::optional<CallbackIndex>>;  // to, from
  std::map<EdgeKey, MessageEdgeFacts> edges_;
  ByIndex<CallbackIndex, MessageEdgeFacts*> last_edge_to_;  // null: none yet
  Nodes scratch_;
  bool has_spec_ = false;
};

}  // namespace cie::analysis
