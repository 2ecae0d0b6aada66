// Messages linking callbacks: finds the instance that published what another one took, and measures
// path latency, reaction time and data age of the chains (definitions.md; Günzel et al. 2023).
#pragma once

#include <cie/analysis/event.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>

#include "base/prefetch.hpp"
#include "chain_node.hpp"
#include "host_clocks.hpp"
#include "model/by_index.hpp"
#include "model/facts.hpp"
#include "model/greatest.hpp"
#include "model/loss_times.hpp"
#include "model/recent.hpp"
#include "registry.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

namespace cie::analysis {

class ChainTracker {
 public:
  ChainTracker(Model& model, Registry& registry, HostClocks& clocks, const LossTimes& losses,
               const SchedulingSpec* spec);

  // A node for an instance of the callback. Valid as long as the tracker.
  ChainNodeRef new_node(CallbackIndex callback) {
    reads_[callback].keep_all();
    return nodes_.take();
  }
  // Instances that are kept, for what may still descend from them.
  std::size_t nodes_in_use() const noexcept { return nodes_.in_use(); }
  // `node` is the open instance that publishes, null outside callbacks.
  void on_publish(std::uint32_t publisher, const EventRef& where, std::int64_t source_timestamp,
                  ChainNodeRef node);
  // The same where an instance may publish that nobody saw begin.
  void on_publish_unseen(std::uint32_t publisher, std::int64_t source_timestamp);
  // An instance of the callback will begin soon; then: now.
  void prefetch(CallbackIndex callback) const noexcept {
    prefetch_to_write(reads_.find(callback));
    prefetch_to_write(lately_.find(callback));
  }
  void prefetch_start(CallbackIndex callback) const noexcept;
  // The same of a publication of the last publisher.
  void prefetch_publication(const KnownEmitter& publisher) const noexcept {
    if (publisher.published.is_any())
      prefetch_to_write(publishers_.find(publisher.published.index));
  }
  void prefetch_message(const KnownEmitter& publisher) const noexcept {
    if (!publisher.published.is_any()) return;
    const auto* known = publishers_.find(publisher.published.index);
    if (known != nullptr) known->messages.prefetch_place();
  }
  // An instance began in the window. Returns the number of its read.
  std::uint64_t add_read(CallbackIndex callback, Timestamp start) {
    return reads_[callback].add(start);
  }
  // Whether an instance that took this message (0: none) may continue a chain, or be all of one. Of
  // others nothing is told but what they publish.
  bool may_be_of_chain(std::uint64_t writer_gid, std::int64_t source_timestamp,
                       bool is_writer_undecided) const noexcept {
    return has_spec_ || (writer_gid != 0 && source_timestamp != 0) || is_writer_undecided;
  }
  // Such an instance began: looks up what it took.
  void link(ChainNode& node);
  // An instance in the window was completed. It is measured now, or waits for the ends of those that
  // led to it.
  void on_complete(ChainNode& node, const EventRef& end);
  // No more of these ends will be told.
  void measure_waiting();
  // A client took the response that an instance of a service published.
  void on_response(HostIndex host, const ResponseTaken& event, Timestamp taken);
  // Nothing is known of when the callback was released, after all.
  void forget_releases(CallbackIndex callback);
  // Whether the message that it took was published, as far as is seen now.
  bool is_published(const ChainNode& node) const;
  // Of a message that led to it more may be told yet: who wrote it, or its publication, as it came
  // from a host whose clock may be ahead, or was taken before the thread that wrote it told of that.
  bool awaits_message(ChainNode& node, Timestamp now) {
    const bool may_any_follow = model_.hosts.size() > 1 || registry_.awaits_publishers(now);
    return (may_any_follow && is_any_awaited(node)) || (is_any_ahead_ && is_any_ahead(node));
  }
  // Fills the model's chains and edges, without those that wait. May be called again after more
  // instances.
  void look();
  // Likewise, once, when there are no more: what it knows of them goes into the model.
  void finish();

 private:
  // When a message was published, by its reader's clock. Empty: nothing relates that to its writer's.
  std::optional<Timestamp> sent(HostIndex reader, HostIndex writer, Timestamp published,
                                std::int64_t source_timestamp) const noexcept;
  static constexpr std::size_t kMaxMessages = 1024;  // per publisher, waiting to be taken
  static constexpr std::size_t kMaxReads = 8192;     // per callback, waiting for an answer
  // Per callback, for ends of what led to them: what shows that one was lost comes with the next instance.
  static constexpr std::size_t kMaxWaiting = 64;

  struct Message {
    std::int64_t source_timestamp = 0;
    Timestamp time;
    mutable ChainNodeRef node;  // a copy takes its place when too much lies behind it
  };
  // These three: what is touched for every instance lies in one cache line.
  struct alignas(64) OfPublisher {
    Recent<Message, kMaxMessages> messages;
    HostIndex host{};
  };
  // When instances of one callback started, the last few, numbered from 0. Which of them begin a
  // chain is seen only when its last callback ends, so every one is kept of a callback that
  // publishes. Of one that never did, those are that may have begun since the first that will.
  class alignas(64) Reads {
   public:
    std::uint64_t add(Timestamp read) {
      if (is_publishing_) {
        times_.push(read);
      } else {
        before_.push(read);
      }
      return count_++;
    }
    // An instance of the callback has part in a chain.
    void keep_all() {
      if (is_publishing_) return;
      is_publishing_ = true;
      before_.for_each([this](Timestamp read) { times_.push(read); });
      before_ = {};
    }
    std::uint64_t oldest() const noexcept { return count_ - times_.size(); }
    std::uint64_t count() const noexcept { return count_; }
    // After keep_all(); oldest() <= number < the count.
    Timestamp operator[](std::uint64_t number) const noexcept {
      return times_.newest(static_cast<std::size_t>(count_ - 1 - number));
    }

   private:
    static constexpr std::size_t kBefore = 64;  // a thread has no more instances open
    Recent<Timestamp, kMaxReads> times_;
    std::uint64_t count_ = 0;
    bool is_publishing_ = false;
    Recent<Timestamp, kBefore> before_;
  };
  struct Progress {
    bool has_last = false;
    struct Hop {
      std::uint64_t seq = 0;
      Timestamp start;
    };
    std::vector<Hop> hops;         // of the last chain instance
    EventRef last_start;           // of its first callback
    EventRef newest_start;         // of the chain instance that read last
    std::uint64_t unanswered = 0;  // number of the first read from that one on
  };
  // An instance that was completed, when the number of one that led to it could not tell yet whether the
  // end of that was lost.
  struct Waiting {
    ChainNodeRef node;
    EventRef end;
  };
  // A chain instance some of whose publishing instances had not ended when it was measured.
  struct Unproven {
    EventRef end;
    std::vector<ChainNodeRef> publishers;
  };
  // Instances that may be of a chain, when it was not known whose they were, or who wrote what they took.
  struct Unlinked {
    CallbackIndex callback{};
    std::size_t hop = 0;            // of the chain, that they may be of
    std::uint64_t writer_gid = 0;   // of what they took; 0: it is the callback that was not known
    HostIndex host{};               // theirs
    std::int64_t last_written = 0;  // what they took last
    std::uint64_t count = 0;
    EventRef first;
  };
  struct Chain {
    ChainFacts facts;
    // What its extremes are.
    struct {
      Greatest path_latency;
      Greatest path_latency_lower;
      Greatest path_latency_upper;
      Greatest reaction_time;
      Greatest data_age;
    } longest{};
    std::vector<CallbackIndex> hops;                          // of the last instance
    const CallbackFacts* first = nullptr;                     // of the first of them
    Progress progress;                                        // of its callbacks
    std::map<std::vector<CallbackIndex>, Progress> others{};  // of other callbacks with their ids
    bool goes_on = false;                                     // in paths that are too long
    std::array<Unproven, 4> unproven{};  // of the extremes that may violate a bound
    std::vector<Unlinked> unlinked{};    // of one that a spec names
    // Of its instances those whose first message was not seen published, and by whom the last of
    // these was.
    std::uint64_t cut_instances = 0;
    std::uint32_t cut_publisher = 0;
  };
  using Path = std::vector<CallbackIndex>;
  using Paths = std::map<Path, Chain>;
  using Nodes = std::vector<const ChainNode*>;
  // What a callback's last instance was of, as the next one most often is.
  struct alignas(64) Lately {
    Paths::value_type* path = nullptr;  // that it ended; null: none yet
    Path not_kept;                      // that it ended, when there were too many
    struct Edge {
      MessageEdgeFacts* facts = nullptr;        // null: none yet
      const CallbackFacts* callback = nullptr;  // that it ended at
    } edge{};
    std::uint64_t writer_gid = 0;       // of the message it took; 0: none yet
    std::uint32_t publisher = 0;        // that has it
    std::uint32_t publishers_told = 0;  // as many had told theirs then
  };

  void resolve(ChainNode& node);
  // The same of one that was, if its message had not been read by then, or who wrote it.
  void resolve_again(ChainNode& node) {
    const bool may_be_read =
        node.link == ChainNode::Link::before || node.link == ChainNode::Link::unseen ||
        (node.link == ChainNode::Link::source &&
         (model_.hosts.size() > 1 || registry_.is_publisher_told_since(node.start.time)));
    if (may_be_read) resolve(node);
  }
  bool is_any_awaited(ChainNode& node);
  bool is_awaited(const ChainNode& node) const;
  bool is_any_ahead(ChainNode& node);
  // Its message was written later than anything that its publisher told of.
  bool is_ahead(const ChainNode& node) const;
  // The publisher of the message that it took. Empty: nobody who is known.
  std::optional<std::uint32_t> writer_of(const ChainNode& node);
  void note_edge(const ChainNode& node);
  const Message* find_message(std::uint32_t publisher, std::int64_t source_timestamp) const;
  // The instances that led to this one, first to last: whether they are one of the chain that the
  // spec names. Missing: a publication between them is unseen without excuse; those after it, the
  // last one first.
  enum class Walk : std::uint8_t { other, missing, whole, too_long };
  Walk walk(ChainNode& node, Chain& chain);
  // Likewise, as far back as anything is known. Too long: there are more than are kept.
  Walk walk(ChainNode& node);
  // It may be shown yet that it descends from another one than it is taken to.
  static bool is_end_awaited_before(const ChainNode& node) noexcept;
  // Measures the first ones, up to one that still waits, and whatever leaves no more than `most`.
  void measure_decided(std::vector<Waiting>& waiting, std::size_t most);
  inline void measure(ChainNode& node, const EventRef& end);
  void on_complete_beside_waiting(ChainNode& node, const EventRef& end);
  // An instance was completed, where no spec names chains.
  void on_path(ChainNode& node, const EventRef& end);
  void on_specified(ChainNode& node, const EventRef& end, Chain& chain);
  // Of an instance that was completed no more is known than these, the last one first.
  void interrupt(const Nodes& known);
  static void interrupt(Chain& chain, const Nodes& known);
  // The chain of a path, new if it is; null if there are too many.
  Chain* chain_of(const Nodes& nodes);
  // What to add to times of the first callback's host for those of the last one's. Empty: their
  // clocks have nothing in common.
  static std::optional<Duration> to_last(const Nodes& nodes);
  static void note_latency(Chain& chain, const Nodes& nodes, const EventRef& end, Duration to_last);
  void note_bounds(Chain& chain, const Nodes& nodes, const EventRef& end,
                   const std::optional<Duration>& to_last);
  static void note_by_starts(Chain& chain, const Nodes& nodes, const EventRef& end,
                             Duration to_last);
  void measure(Chain& chain, const Nodes& nodes, const EventRef& end);
  void note_cut_begin(Chain& chain, const ChainNode& first);
  // The last part of a path whose begin lies before what was recorded, or before the window: no
  // chain of its own.
  bool is_rest(const Chain& chain) const;
  static std::array<std::optional<ChainExtreme>*, 4> extremes_of(ChainFacts& facts);
  // Of the extremes those of this chain instance.
  static void note_unproven(Chain& chain, const Nodes& nodes, const EventRef& end);
  static void tell_unproven(const Chain& chain, ChainFacts& facts);
  // The instance may be that of the chain's hop.
  void note_unlinked(Chain& chain, const ChainNode& node, std::size_t hop) const;
  void tell_unlinked(const Chain& chain, ChainFacts& facts) const;
  void tell_unanswered(const Chain& chain, ChainFacts& facts) const;
  // Answers the reads before that of this chain instance.
  void answer(Chain& chain, const ChainNode& first, const EventRef& end, Duration to_last);
  bool has_hole(const Nodes& nodes, const Progress& progress);
  // An instance of other callbacks than the last one's follows: of another process, or a later one.
  void change_callbacks(Chain& chain, const Nodes& nodes);
  // That all its instances ran in; empty: there are several, or no instance.
  std::optional<ProcessIndex> process_of(const Chain& chain) const;
  // `take` gives the facts of a chain or of an edge, which are copied or left behind.
  template <typename Take>
  void fill_model(Take take);

  Model& model_;
  Registry& registry_;
  HostClocks& clocks_;
  const LossTimes& losses_;
  ChainNodePool nodes_;
  ByIndex<std::uint32_t, OfPublisher> publishers_;
  ByIndex<CallbackIndex, Reads> reads_;
  std::vector<Chain> specified_;
  Paths paths_;
  ByIndex<CallbackIndex, Lately> lately_;
  ByIndex<CallbackIndex, std::vector<Paths::value_type*>> ended_by_;       // those of paths_
  using EdgeKey = std::pair<CallbackIndex, std::optional<CallbackIndex>>;  // to, from
  std::map<EdgeKey, MessageEdgeFacts> edges_;
  ByIndex<CallbackIndex, std::vector<Waiting>> waiting_;  // in order of their ends
  std::size_t waiting_count_ = 0;
  Nodes scratch_;
  bool has_spec_ = false;
  bool is_any_ahead_ = false;  // some message was
  std::uint32_t most_hops_;    // of a chain
};

}  // namespace cie::analysis
