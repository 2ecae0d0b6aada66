// Facts about callbacks, and about what links them: publishers and chains.
#pragma once

#include <cie/analysis/event.hpp>
#include <cie/analysis/instance.hpp>
#include <cie/analysis/rare.hpp>
#include <cie/analysis/statistics.hpp>
#include <cie/tracepoints/schema.hpp>

#include "optional_time.hpp"
#include "recording_facts.hpp"
#include "thread_facts.hpp"

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace cie::analysis {

template <typename Value>
struct Extreme {
  Value value{};
  std::uint64_t seq = 0;
  EventRef start{};
  std::optional<EventRef> end{};
  OptionalTime release{};  // or the bound of it that the source names
  ReleaseSource release_source = ReleaseSource::exact;
};

struct CallbackTotals {
  EventRef at{};
  std::uint64_t started = 0;
  std::uint64_t ended = 0;
  std::uint64_t released = 0;
  std::uint64_t overwritten = 0;
  std::uint64_t lost = 0;
};

// So many are listed of a callback.
inline constexpr std::size_t kMaxOpenListed = 64;

// An instance without an end when the trace (or its process) ended, or so far.
struct OpenInstance {
  EventRef start{};
  std::uint64_t seq = 0;
  std::optional<Timestamp> release{};
  bool release_exact = false;
  std::uint32_t missed = 0;
  ThreadIndex thread{};
  bool is_left = false;                     // ROS 2's: an exception ended it, which no event tells
  std::optional<Timestamp> next_release{};  // exact, of the instance numbered one more
  EventRef next_start{};                    // of that one
  std::optional<std::pair<Duration, Timestamp>> executed{};  // at least so long until then
};

// A callback went on on another thread, where it had not run before, without a callback_init in between: one from each
// thread that it ran on before, not from the last alone.
struct Move {
  ThreadIndex from{};
  ThreadIndex to{};
  EventRef last_on_from{};
  EventRef first_on_to{};
  std::uint64_t first_seq = 0;  // on `to`
};

// The same with a callback_init in between, which may be a mere announcement whose run_begin was lost.
struct RegisteredMove {
  Move move{};
  EventRef registered{};
};

// R1 directly: release of k+1 at or before the end of k.
struct ReleaseBeforeEnd {
  std::uint64_t seq = 0;
  EventRef start{};
  EventRef end{};
  Timestamp next_release{};
  EventRef next_start{};
};

// Recorded where not all streams were: in the window that was asked for, if any was, and not in that of
// their channel. No number counts them; a violation among them stands in the trace all the same.
struct InstancesOutside {
  std::uint64_t count = 0;  // of which the window has no part
  // Of those that began and ended, also of those that an edge cuts: what is certain of them.
  std::optional<Extreme<Duration>> max_response{};
  Rare<Extreme<Duration>> max_execution{};
  // Of consecutive seqs, both exact, of which one or both are such.
  std::optional<Extreme<Duration>> min_inter_arrival{};
  std::optional<Extreme<Duration>> max_inter_arrival{};
  bool is_reordered = false;  // one was released before that of the number before
  std::optional<ReleaseBeforeEnd> release_before_end{};
};

// Of the instances that were the callback's own for certain, where others may be another one's (see
// CallbackStart::may_be_another): violations rest on these.
struct OwnInstances {
  EventRef others_since{};  // the first start that may be another one's
  std::uint64_t missed = 0;
  std::optional<Extreme<std::uint32_t>> first_missed{};
  std::uint64_t overwritten = 0;
  std::optional<Extreme<Duration>> max_response{};
  std::optional<Extreme<Duration>> max_response_lower{};
  Rare<Extreme<Duration>> max_execution{};
};

// What every instance reads or writes comes first and together, so that it takes few cache lines.
struct alignas(64) CallbackFacts {
  ProcessIndex process{};
  CallbackId id{};
  bool is_accounted = true;  // its recorder numbers instances and counts losses
  // What is certain of the response times of those whose release is not known is the duration of
  // every one, most often, as of callbacks of ROS 2. Then `response_time_lower` has none.
  bool is_lower_duration = true;
  bool is_reordered = false;            // one was released before that of the number before
  bool is_identified = true;            // its first callback_init told its logical id in full
  bool may_be_another = false;          // of that id: see doubt_numbered_ids()
  bool is_beside_partly_known = false;  // another one is known in part only, and may be of that id
  bool is_after_rcl_init = false;       // see InferredCallback
  std::optional<CallbackKind> kind{};
  std::optional<EventRef> registered{};  // first callback_init; empty: never seen
  Rare<OwnInstances> own{};              // empty: all are its own

  SequenceFacts starts{};
  Timestamp made{};          // or registered, where only that is told
  SequenceFacts ended{};     // missing: of instances from the first start seen to the last end seen
  std::uint64_t missed = 0;  // skipped periods, those before open instances included

  // Complete instances in the window, by what their release is known from.
  std::uint64_t instances = 0;
  std::uint64_t exact_instances = 0;                 // their release is known
  std::uint64_t messages_told = 0;                   // of which it is told what they took
  std::array<std::uint64_t, 5> by_release_source{};  // indexed by ReleaseSource exact..start
  Statistics response_time{};
  Statistics start_latency{};
  Statistics duration{};
  Statistics inter_arrival{};
  std::optional<Duration>
      response_deadline{};                  // to be kept: that of the spec, else the declared one
  std::uint64_t late = 0;                   // certainly beyond response_deadline
  std::uint64_t late_by_duration = 0;       // of these, those whose duration alone is
  std::optional<Timestamp> first_expiry{};  // of a timer whose others follow from it
  struct Overlap {
    std::uint64_t first_seq = 0;
    EventRef first_start{};
    std::optional<EventRef> first_end{};
    std::uint64_t second_seq = 0;
    EventRef second_start{};
  };
  Rare<Overlap> overlap{};  // the first one did end: proven
  Rare<ReleaseBeforeEnd> release_before_end{};

  // Of samples.
  std::uint64_t releases = 0;
  std::uint64_t overwritten = 0;                 // last running total of callback_release
  std::optional<std::uint64_t> first_release{};  // the least release_seq seen
  std::uint64_t last_release = 0;                // and the largest
  std::uint64_t first_next_seq = 0;  // of the first callback_init seen; or next at window's begin
  // That were released and not overwritten, and whose instance had not started: the most.
  std::uint64_t longest_queue = 0;
  // That were released and not overwritten before the first callback_init and start: the most.
  std::uint64_t left_unregistered = 0;
  // Running totals when the first event that tells them was seen, that of lost samples just before it: at
  // most so many were counted before the recording, or the window. Empty: no event did.
  std::optional<std::uint64_t> overwritten_at_first{};
  std::optional<std::uint64_t> lost_at_first{};

  // The least number of one of its id that was not seen since this one was made: see doubt_numbered_ids().
  std::uint32_t least_number = 0;           // 0: there is none
  std::vector<CallbackOnThread*> ran_on{};  // of the model's pairs, by first start
  Rare<Overlap> overlap_unproven{};         // the first one never ended
  // Of a timer with `first_expiry`.
  struct Grid {
    std::uint64_t unresolved =
        0;                    // instances before which periods may have been skipped, uncounted
    bool is_refuted = false;  // its expiries do not follow from `first_expiry`
    bool is_steady = false;   // no reset moved it by more than `error`
    Duration error = kTimerError;
    Duration spread{};  // all may be earlier by up to that: its thread may have been preempted
    std::uint64_t prompt_starts = 0;
  };
  Grid grid{};

  // Of complete instances in the window.
  std::uint64_t without_status = 0;       // whose end does not tell
  std::uint64_t exceptions = 0;           // that an exception ended
  std::uint64_t without_upper_bound = 0;  // whose release has no earliest time
  std::uint64_t with_doubtful_bound = 0;  // of these: CLOCK_REALTIME may have been set meanwhile
  Statistics response_time_lower{};
  Statistics response_time_upper{};
  Statistics execution_time{};
  Statistics preempted{};
  Statistics blocked{};
  Statistics wake_delay{};
  Statistics wakeup_latency{};

  std::uint32_t inits = 0;
  // The first callback_init may be an announcement's: one came before, by no other thread, which
  // told nothing since that an announcement tells behind its callbacks.
  bool may_repeat = false;
  std::uint32_t queue_depth = 0;
  std::optional<EventRef> last_init{};      // last callback_init that was not a mere announcement
  std::uint64_t announcements_at_init = 0;  // of its process, at the last callback_init
  std::optional<Timestamp> last_told{};     // by a callback_init of either kind
  // The last one that was taken for an announcement, and the one before it: where what it announces was
  // lost it may be a registration.
  Rare<std::pair<Timestamp, EventRef>> announced_after{};
  std::string logical_id{};  // "?<id>" when none was told
  std::string node{};
  NodeId node_id{};
  std::optional<GroupId> group{};
  std::string source{};
  std::string symbol{};
  std::uint64_t period_ns = 0;
  std::uint64_t deadline_ns = 0;  // declared; 0: none
  std::optional<CallbackTotals> fini{};
  // What was lost and overwritten in the window; else at least that many.
  bool are_totals_told = true;

  std::uint64_t starts_outside = 0;      // of the window that was asked for, or of a snapshot's
  std::uint64_t starts_left_out = 0;     // of these, those within the window that was asked for
  std::uint64_t started_in_all = 0;      // that `fini` told before the window cut it
  std::uint64_t ends_without_start = 0;  // seq not below the first start seen
  std::uint64_t ends_before_first = 0;   // of instances cut by the window's begin
  Rare<std::pair<std::uint64_t, EventRef>> first_end_without_start{};
  std::uint64_t second_ends = 0;
  struct SecondEnd {
    std::uint64_t seq = 0;
    EventRef first{};
    EventRef second{};
  };
  Rare<SecondEnd> first_second_end{};
  // Instances that ended on another thread than the one they had started on, and the first of them.
  std::uint64_t ends_elsewhere = 0;
  struct EndElsewhere {
    std::uint64_t seq = 0;
    EventRef start{};
    EventRef end{};
  };
  Rare<EndElsewhere> first_end_elsewhere{};
  std::vector<Move> moves{};                             // the first 1024
  Rare<std::vector<RegisteredMove>> registered_moves{};  // the first 1024
  std::uint64_t starts_without_tid = 0;

  Rare<std::pair<std::uint64_t, EventRef>> first_exception{};  // seq, its end
  std::uint64_t cut_instances = 0;
  std::uint64_t cut_by_begin = 0;  // of these, by the begin of the window that was asked for
  Rare<InstancesOutside> outside{};
  // The longest that one may have executed or been blocked for, of those (cut ones included) of which
  // that is not known.
  std::optional<Duration> longest_unmeasured{};
  std::vector<OpenInstance> open{};     // capped at kMaxOpenListed
  std::vector<OpenInstance> running{};  // likewise: so far, of an analysis that goes on
  std::uint64_t open_count = 0;
  Rare<std::map<std::int64_t, Preemptor>> preempted_by{};  // by tid
  // The longest that threads outside callbacks preempted an instance. Empty: not measured.
  std::optional<Duration> max_preempted_outside{};
  std::uint64_t identity_failures = 0;

  // Witnesses of the extremes, over complete instances in the window.
  std::optional<Extreme<Duration>> max_response{};        // known ones
  ResponseParts max_response_parts{};                     // of that one
  std::optional<Extreme<Duration>> max_response_lower{};  // what is certain of it
  std::optional<Extreme<Duration>> max_response_upper{};  // exact value or upper bound
  std::optional<Extreme<Duration>> max_duration{};
  Rare<Extreme<Duration>> max_execution{};
  std::optional<Extreme<Duration>> max_duration_without_execution{};  // CPU time unknown
  // Inter-arrival of consecutive seqs, both exact; seq and start are the later one's.
  std::optional<Extreme<Duration>> min_inter_arrival{};
  std::optional<Extreme<Duration>> max_inter_arrival{};

  Rare<Extreme<std::uint32_t>> first_missed{};
  // Told by instances that had started before.
  struct ImpossibleReleases {
    std::uint64_t count = 0;
    std::uint64_t seq = 0;  // of the first one
    EventRef start{};
    Timestamp release{};
  };
  Rare<ImpossibleReleases> impossible_releases{};
  std::uint64_t lost = 0;  // last running total of sample_lost
  Rare<EventRef> overwritten_at{};
  Rare<EventRef> lost_at{};

  bool has_grid_releases() const noexcept {
    return by_release_source[static_cast<std::size_t>(ReleaseSource::timer_grid)] != 0;
  }
  // What evidence of these releases is good to, either way; zero where they were recorded.
  Duration release_error() const noexcept { return has_grid_releases() ? grid.error : Duration{}; }
  // By so much more they may be earlier.
  Duration release_spread() const noexcept {
    return has_grid_releases() ? grid.spread : Duration{};
  }
  bool are_releases_certain() const noexcept { return !has_grid_releases() || grid.is_steady; }
  // What is seen next may be another callback's: what was seen until now is kept apart.
  void keep_own_apart(const EventRef& since) {
    own = OwnInstances{.others_since = since,
                       .missed = missed,
                       .first_missed = first_missed ? std::optional(*first_missed) : std::nullopt,
                       .overwritten = overwritten,
                       .max_response = max_response,
                       .max_response_lower = max_response_lower,
                       .max_execution = max_execution};
  }
};

// What every publication reads or writes comes first and together, so that it takes few cache lines.
struct alignas(64) PublisherFacts {
  ProcessIndex process{};
  PublisherId id{};
  std::optional<EventRef> registered{};
  bool is_accounted = true;                 // its recorder numbers publications and counts them
  OptionalTime awaited_since{};             // it published, and was not announced yet
  std::int64_t first_source_timestamp = 0;  // of those that tell one; 0: none did
  SequenceFacts published{};
  std::uint64_t first_next_seq = 0;
  std::string topic{};
  std::uint64_t writer_gid = 0;
  std::optional<NodeId> node{};
  std::optional<std::pair<EventRef, std::uint64_t>> fini{};  // total published
  // Running totals of messages that were not sent, the least and the largest that was told.
  std::optional<std::uint64_t> first_unsent{};
  std::uint64_t last_unsent = 0;

  std::uint64_t unsent() const noexcept {
    return first_unsent ? last_unsent - *first_unsent + 1 : 0;
  }
};

// Messages that instances of one callback took from another, or from outside any callback seen.
struct MessageEdgeFacts {
  std::optional<CallbackIndex> from{};
  CallbackIndex to{};
  std::uint64_t messages = 0;
  std::uint64_t unrecorded = 0;       // of these: nobody was seen to publish them
  Statistics communication{};         // exact releases only
  Statistics handover{};              // publish to start, of callbacks that ROS 2's events tell
  std::optional<HostPair> crosses{};  // hosts, if they are two
};

// Chain instance as a witness.
struct ChainExtreme {
  Duration value{};
  EventRef first_start{};  // of the first callback's instance
  EventRef last_end{};
  bool is_unproven = false;  // an instance that led to it was not seen to end: see ChainNode
};

// By message of a chain: from which host to which, if they are two.
using HostRoute = std::vector<std::optional<HostPair>>;

// What every instance reads or writes comes first and together, so that it takes few cache lines.
struct ChainFacts {
  std::uint64_t instances = 0;
  Statistics path_latency{};
  Statistics reaction_time{};
  Statistics data_age{};
  // The hop table. Of instances with a path latency, each cell those whose releases it needs are
  // known of; the rest of their path latency is undivided, so that all together add up.
  Statistics undivided{};
  std::vector<Statistics> processing{};     // one per hop
  std::vector<Statistics> communication{};  // one fewer
  std::string name{};
  bool specified = false;
  std::vector<std::string> hops{};
  std::vector<CallbackIndex> last_callbacks{};  // resolved hops of the last instance seen
  std::optional<ProcessIndex> process{};        // empty when it spans processes or never ran
  std::uint64_t incomplete = 0;                 // a hop's publish is unseen without excuse
  std::optional<EventRef> first_incomplete{};
  // Of instances that may be of it nobody knew by then which callback they were of, or who wrote what they
  // took: that was announced too late. How many, at least.
  std::uint64_t unlinked = 0;
  std::optional<EventRef> first_unlinked{};
  // Their first release is not exact, or the clocks of its hosts cannot be related.
  std::uint64_t inexact = 0;
  std::uint64_t without_upper_bound = 0;   // of them: not even bounds of the release are known
  std::uint64_t unrelated = 0;             // the clocks of their hosts cannot be related
  EventRef first_unrelated{};              // its end
  std::set<CallbackIndex> bounded_from{};  // first callbacks of those with an upper bound
  // Of what ROS 2's events tell, where releases are most often not known: by starts in their place.
  Statistics from_start{};             // of the first callback, to the end: at least the latency
  Statistics path_latency_upper{};     // from what its first release was not before
  std::vector<Statistics> running{};   // start to publish, or to the end; one per hop
  std::vector<Statistics> handover{};  // publish to start; one fewer
  Statistics
      response{};  // of a service that ends it: from its being sent to the client's taking it
  std::uint64_t reads_not_kept = 0;  // too many without an answer: in no reaction time
  // Reads of the first callback that no instance answered until the end: of one that a spec names.
  struct Unanswered {
    std::uint64_t reads = 0;  // behind that of the last instance
    Timestamp first{};        // of those that are kept
    Timestamp last{};
  };
  std::optional<Unanswered> unanswered{};
  std::set<HostRoute> routes{};  // taken; one unless callbacks changed hosts
  std::optional<ChainExtreme> max_path_latency{};
  std::optional<ChainExtreme> max_path_latency_lower{};  // of inexact ones: from the first start
  std::optional<ChainExtreme> max_path_latency_upper{};  // from what the release was not before
  std::optional<ChainExtreme> max_reaction_time{};
  std::optional<ChainExtreme> max_data_age{};
};

}  // namespace cie::analysis
