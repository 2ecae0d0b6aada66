// Events of ROS 2's tracers as those of the model: CallbackInit, CallbackStart, Publish, …
//
// What these tracers tell of a callback's identity is spread over many events and addresses; what
// they do not tell at all (a timer's release, threads and their parameters, totals) stays absent.
#pragma once

#include <cie/analysis/event.hpp>

#include "../reader/field.hpp"
#include "directory.hpp"
#include "message_links.hpp"
#include "ros2_event.hpp"

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

namespace cie::analysis {

class EventTranslator {
 public:
  using Sink = std::function<void(const Event&)>;

  // Whose events a stream holds, and by how much its clock is behind CLOCK_REALTIME.
  void apply(const EventHead& head, const StreamBegin& event);
  // The process tells of itself in this project's own events.
  void apply(const EventHead& head, const RunBegin& event);
  // Events of a host were lost: what is open may have ended, and what ends now may have begun
  // unseen.
  void lose(const EventHead& head);
  // Feeds `sink` what follows from the event; all of it is_derived.
  void translate(const EventHead& head, const Untranslated& event, const Sink& sink);
  // The trace ended: what was still to be told.
  void finish(const Sink& sink);

 private:
  struct Open {  // a running callback
    ros2::Address address = 0;
    ros2::CallbackNumber callback{};
    std::uint64_t seq = 0;
  };
  struct Publishing {  // between the call and the first word of a source timestamp
    EventHead head{};
    ros2::Address message = 0;
    std::optional<ros2::Address> publisher{};
  };
  struct Queued {  // a message between callbacks of one process
    ros2::MessageLinks::Origin origin{};
    std::optional<Timestamp> release{};
  };
  struct Thread {
    std::vector<Open> open{};
    std::optional<Publishing> publishing{};
    std::shared_ptr<ros2::Publication> writing{};             // until the thread's next event
    std::optional<ros2::MessageLinks::Origin> handed_over{};  // being put into queues
    // What the next callback to start has taken.
    std::optional<std::int64_t> taken{};
    std::optional<Queued> dequeued{};
    bool is_waiting = false;
  };
  struct Process {
    EventHead last{};  // event of it
    ros2::Directory directory{};
    std::unordered_map<std::int64_t, Thread> threads{};
    std::map<std::pair<ros2::Address, std::uint64_t>, Queued> queues{};  // by buffer and index
    std::unordered_map<ros2::Address, ros2::MessageLinks::Origin> handed_over{};  // by message
    std::unordered_map<std::uint64_t, ros2::Address> agnocast_subscriptions{};  // by its own number
    std::unordered_map<ros2::Address, std::int64_t> agnocast_entries{};         // by callable
    std::set<ros2::Address> told_groups{};
    bool has_own_events = false;    // this project's, which say more and are numbered
    bool has_ros2_profile = false;  // says the same in ROS 2's words too
  };
  struct Host {
    std::map<std::int64_t, Process> processes{};  // by pid
    bool has_clock = false;
  };
  struct Stream {
    std::string host{};
    std::int64_t offset_ns = 0;
  };
  // One event on its way: where it happened and where its consequences go.
  struct Context {
    const EventHead& head;
    Process& process;
    Thread& thread;
    const Sink& sink;
  };

  static bool is_told_better(ros2::Ros2Event event, const Payload& p, Process& process);
  void describe(ros2::Ros2Event event, bool repeats, const Payload& p, Context& context);
  void describe_agnocast(ros2::Ros2Event event, const Payload& p, Context& context);
  bool publish(ros2::Ros2Event event, const Payload& p, Context& context);
  void take(ros2::Ros2Event event, const Payload& p, Context& context);
  void start(ros2::Address address, Context& context);
  static void end(ros2::Address address, Context& context);

  void begin_publishing(ros2::Address message, std::optional<ros2::Address> publisher,
                        Context& context);
  void settle_thread(Context& context);
  ros2::MessageLinks::Origin tell_publication(const Publishing& publishing,
                                              ros2::Publication publication, Context& context);
  void enqueue(const Payload& p, Context& context);
  static void tell_callback(ros2::CallbackNumber number, Context& context);
  static void tell_node(const EventHead& head, std::optional<NodeId> node, Context& context);
  static std::optional<GroupId> tell_group(const EventHead& head, const ros2::Callback& callback,
                                           Context& context);
  const Stream& stream_of(const EventHead& head) const;
  std::int64_t realtime(const EventHead& head) const;

  std::vector<Stream> streams_;
  std::map<std::string, Host> hosts_;
  ros2::MessageLinks links_;
  std::uint64_t publishers_ = 0;
};

}  // namespace cie::analysis
