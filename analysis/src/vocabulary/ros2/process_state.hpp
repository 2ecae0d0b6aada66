// What is going on in one process of ROS 2, and one event on its way through it.
#pragma once

#include <cie/analysis/event.hpp>

#include "copies.hpp"
#include "directory.hpp"
#include "message_links.hpp"
#include "own_publisher.hpp"
#include "taken_messages.hpp"
#include "vocabulary/event_batch.hpp"

#include <algorithm>
#include <compare>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

namespace cie::analysis::ros2 {

// Where the model's events go that follow from one of a batch, or from the end of all.
struct EventSink {
  EventBatch& batch;
  const Event* cause = nullptr;
};

struct RunningCallback {
  Address address = 0;
  Callback* callback = nullptr;
  std::uint64_t seq = 0;
  bool has_looked = false;  // an executor on its thread, for work: it spins inside, or was left
};

// A call of a service: the model's gid of the client, and the call's number.
using CallKey = std::pair<std::uint64_t, std::int64_t>;

// What a service's next instance is for.
struct Request {
  Address service = 0;  // rmw's
  CallKey call{};

  auto operator<=>(const Request&) const = default;
};

// A message that its publisher hands to subscriptions of its own process.
struct HandedOver {
  // What a subscription to the topic takes; of any other topic no message.
  MessageLinks::Origin origin_on(const std::string& topic) const {
    const bool is_its = publisher != nullptr && publisher->gid == origin.gid &&  // not a later one
                        publisher->topic == topic;
    return is_its ? origin : MessageLinks::Origin{};
  }

  MessageLinks::Origin origin{};
  const Publisher* publisher = nullptr;  // null: unknown; of the directory, where they stay
};

// Between the call and the first word of a source timestamp.
struct Publishing {
  EventHead head{};
  std::int64_t realtime = 0;  // of `head`
  std::uint32_t channel = 0;  // likewise
  Address message = 0;
  std::optional<Address> publisher{};
  HandedOver handed_over{};  // the same message, if subscriptions of the process were given it
  MessageTopic* written_on = nullptr;  // which knows that the call goes on
  bool is_doubtful = false;            // what its thread did meanwhile may have been lost
};

// A message between callbacks of one process.
struct QueuedMessage {
  HandedOver message{};
  const Callback* receiver = nullptr;  // null: unknown
  std::optional<Timestamp> release{};
};

// A run that ROS 2's events tell of in a process that tells in this project's events, too.
struct ToldRun {
  Callback* callback = nullptr;
  Timestamp time{};
  StreamIndex stream{};
};

// Runs of a thread of a process that tells in this project's events, too. Directly inside each instance of
// these lies one of ROS 2's at most; any other is of another executor. What is missing is told by numbers:
// an instance's start and end have the same, its callback's next one has the next.
class RunsBesideOwn {
 public:
  // False: it is none that the last own event that was seen tells of.
  bool run() { return ++runs_ == 1 && is_inside_; }
  // Such a one of another executor's, which is told by itself.
  void pass_other() { has_others_ = true; }
  // Such a one of which nothing is known.
  void leave(Callback& callback, const EventHead& head) {
    if (is_left_) return;
    is_left_ = true;
    left_ = {.callback = &callback, .time = head.time, .stream = head.stream};
  }
  // No own instance was seen on the thread, and it ran more than what one whose start is missing may be.
  bool is_of_others() const { return !has_own_ && runs_ > 1; }
  // No own instance was seen on the thread, and another executor's was.
  bool has_others_alone() const { return !has_own_ && has_others_; }
  // An own instance starts or ends: the first run since the own event before that was left, and is none of
  // its own.
  std::optional<ToldRun> start(CallbackId callback, std::uint64_t seq) {
    const bool is_next = has_own_ && !is_inside_ && callback == callback_ && seq == seq_ + 1;
    return pass(callback, seq, true, is_next);
  }
  std::optional<ToldRun> end(CallbackId callback, std::uint64_t seq) {
    return pass(callback, seq, false, is_inside_ && callback == callback_ && seq == seq_);
  }

 private:
  std::optional<ToldRun> pass(CallbackId callback, std::uint64_t seq, bool is_inside,
                              bool is_proven) {
    const auto other = is_proven && is_left_ ? std::optional(left_) : std::nullopt;
    *this = {};
    callback_ = callback;
    seq_ = seq;
    is_inside_ = is_inside;
    has_own_ = true;
    return other;
  }

  CallbackId callback_{};  // of the last own event
  std::uint64_t seq_ = 0;
  std::uint64_t runs_ = 0;   // since then
  ToldRun left_{};           // the first of them that was left
  bool is_left_ = false;     // there is one
  bool has_others_ = false;  // one was passed
  bool is_inside_ = false;   // that event was a start
  bool has_own_ = false;     // there was one
};

struct Thread {
  static constexpr auto kLongAgo = std::numeric_limits<std::int64_t>::min();

  // The latest run of the callback at the address is among those: left, for it can end no more.
  bool has_skipped(Address address) const {
    return std::ranges::any_of(skipped, [address](const RunningCallback& run) {
      return run.address == address && run.seq + 1 == run.callback->next_seq;
    });
  }

  // What every event looks at lies together, the optional's flag beside what follows it.
  std::optional<Publishing> publishing{};
  std::int64_t last = kLongAgo;  // CLOCK_REALTIME of its last event
  bool is_waiting = false;
  bool is_named = false;  // it was told what the tracer calls it
  bool is_behind_edge =
      false;  // another CPU's stream began since its last event: it may have been there before
  std::optional<StreamIndex> seen_in{};  // its last event
  WrittenRef writing{};                  // until the thread's next event
  std::vector<RunningCallback> open{};
  TakenMessages<Address, std::int64_t> taken{};  // source timestamps, by rmw's subscription
  TakenMessages<const Callback*, QueuedMessage> dequeued{};
  HandedOver handed_over{};  // being put into queues
  std::optional<Request> requested{};
  std::vector<RunningCallback> skipped{};  // open inside the last one that ended with others inside
  LastRecorded last_recorded{};            // where several sessions recorded the host
  RunsBesideOwn beside_own{};
  std::string name{};           // as the tracer calls it
  bool is_of_executor = false;  // this project's own, announced for what that has to do itself
};

// Of a process. Written member by member: a copy of a whole head waits for the reader that wrote
// that in parts.
struct LastEvent {
  static constexpr std::int64_t kNoThread = -1;

  Timestamp time{};
  StreamIndex stream{};
  std::int64_t tid = kNoThread;
};

// Those that this project's events tell of.
struct OwnSubscription {
  std::string topic{};
  bool is_queue_told =
      false;  // it was given what a buffer did, so far as anything within the process
};

struct Process {
  // What every event looks at lies together.
  LastEvent last{};
  std::uint32_t host = 0;             // its number
  bool has_emitted = false;           // in ROS 2's words
  bool has_own_events = false;        // this project's, which say more and are numbered
  bool is_repeated = false;           // what was made before is told while it runs, part by part
  bool has_begun_beside_own = false;  // an rcl_init after these
  bool has_ros2_profile = false;      // says the same in ROS 2's words too
  bool shares_pid = false;  // with another one, as its instances showed: they cannot be told apart
  std::unordered_map<Address, std::int64_t> agnocast_entries{};  // by callable
  std::unordered_set<Address>
      callables{};  // of agnocast, made for one call each and not yet called
  Directory directory{};
  std::unordered_map<std::int64_t, Thread> threads{};
  std::map<std::pair<Address, std::uint64_t>, QueuedMessage> queues{};  // by buffer and index
  std::unordered_map<Address, HandedOver> handed_over{};                // by message
  std::unordered_map<std::uint64_t, Address> agnocast_subscriptions{};  // by its own number
  std::set<Address> announced_groups{};
  std::unordered_map<Address, std::uint64_t> clients{};  // the model's gids, by rmw handle
  std::unordered_map<Address, std::string> services{};   // names, by rmw handle
  std::map<Request, RunningCallback> served{};           // by whom, until they respond
  std::optional<Address> repeated_context{};             // the last one of which CARET told
  std::unordered_map<CallbackId, OwnSubscription> own_subscriptions{};
  std::unordered_map<PublisherId, OwnPublisher> own_publishers{};
  std::set<std::string, std::less<>> own_topics{};  // that it publishes on
  std::set<std::string, std::less<>> own_ids{};     // of its callbacks
};

// One event on its way: where it happened and where its consequences go. Who is seldom called from a
// hot path takes a copy, so that it stays in registers there.
struct Context {
  const EventHead& head;
  std::int64_t realtime;  // CLOCK_REALTIME of the event
  std::int64_t before;    // of the thread's event before it
  Process& process;
  Thread& thread;
  const EventSink& sink;
  std::int64_t& realtime_ahead;  // of its host, see Publications::note_clock
  std::uint32_t channel;
};

template <typename Body>
void emit(const EventHead& head, const Body& body, const EventSink& sink) {
  sink.batch.derive(sink.cause, head, body);
}

}  // namespace cie::analysis::ros2
