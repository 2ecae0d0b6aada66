// The stage between reader and analyzer: events of ROS 2's tracers as those of the model that follow
// from them, CallbackInit, CallbackStart, Publish, … It runs on the reader's thread.
//
// What these tracers tell of a callback's identity is spread over many events and addresses; what
// they do not tell at all (a timer's release, threads and their parameters, totals) stays absent.
#pragma once

#include <cie/analysis/event.hpp>
#include <cie/analysis/recording.hpp>

#include "message_links.hpp"
#include "model/spread_bits.hpp"
#include "process_state.hpp"
#include "publications.hpp"
#include "ros2_event.hpp"
#include "services.hpp"
#include "vocabulary/event_batch.hpp"
#include "vocabulary/session_gaps.hpp"
#include "vocabulary/translator.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace cie::analysis {

class EventTranslator final : public Translator {
 public:
  // `recordings`: those that the traces are of, by which their chunks are known.
  explicit EventTranslator(std::vector<Recording> recordings = {})
      : recordings_(std::move(recordings)) {}
  EventTranslator(const EventTranslator&) = delete;
  EventTranslator& operator=(const EventTranslator&) = delete;

  bool translate(Event& event, const Translation& translation, const Payload& fields,
                 EventBatch& batch) override;
  void observe(EventBatch& batch) override {
    begun_ = {};
    observe(batch.take_new(), batch);
  }
  void finish(EventBatch& batch) override;

 private:
  static constexpr StreamIndex kNone{std::numeric_limits<std::uint32_t>::max()};
  // Events of a stream are lost somewhere between these two.
  struct Loss {
    StreamIndex stream{};
    Timestamp from;
    Timestamp until;
    bool is_edge = false;  // the stream has ended, and others go on
  };
  struct Host {
    std::map<std::int64_t, ros2::Process> processes{};  // by pid
    bool has_clock = false;
    std::int64_t realtime_ahead = 0;  // of what tracers read of CLOCK_REALTIME: it was set since
    std::vector<Loss> losses{};       // that have not ended
    Timestamp next_bound = kLatest;   // of these, to come
    bool is_losing = false;           // one has begun
    bool has_only_edges = false;      // and each of those that have begun is one
    StreamIndex only_loser = kNone;   // the one stream that does, if there is no other
    // From when on an event has to be looked at for losses: from each, while something is lost.
    Timestamp next_look = kLatest;
    Timestamp session_begin{};  // after a gap; what spoke before and speaks again went on meanwhile
    std::uint32_t number = 0;
    std::optional<std::uint32_t> trace{};  // of an application, the first one
    bool has_several_traces = false;       // of which each may have the same events
  };
  struct alignas(32) Stream {  // looked for by every event: a shift instead of a division
    Host* host = nullptr;      // of hosts_
    std::int64_t offset_ns = 0;
    std::uint32_t trace = 0;
    std::uint32_t channel = 0;
    ContextNumber<std::int32_t> cpu{};
    enum class Progress : std::uint8_t { awaited, running, over } progress{};
    bool is_kernel = false;
    bool bounds_window = false;       // as streams of applications with events do
    bool has_callback_events = true;  // as far as is known
  };
  static_assert(sizeof(Stream) == 32);
  // Of applications.
  struct Channel {
    std::uint32_t running = 0;  // of its streams that bound its window
    Timestamp begin{};          // of the first of these
    bool describes_entities = false;
    // A stream ends with its last packet: early where its CPU was quiet, and nothing is missing then.
    std::optional<bool> ends_apart{};  // empty: not asked yet
  };
  // The thread of an event: looked up once for those that follow.
  struct alignas(32) EmittingThread {  // in one cache line
    const Host* host = nullptr;        // null: none
    ros2::Process* process = nullptr;
    ros2::Thread* thread = nullptr;
    ContextNumber<std::int64_t> pid{};
    ContextNumber<std::int64_t> tid{};  // empty: none
  };
  static_assert(sizeof(EmittingThread) == 32);
  static constexpr std::size_t kEmitting = 2048;  // a power of two
  // The same of the publisher of an own event.
  struct alignas(32) KnownPublisher {
    const Host* host = nullptr;  // null: none
    std::int64_t pid = 0;
    PublisherId id{};
    ros2::OwnPublisher* publisher = nullptr;
  };
  // The event before, if it was the start of a callback that run() translated.
  struct Begun {
    Event* event = nullptr;  // null: it was not
    ros2::Address address = 0;
    const EmittingThread* emitting = nullptr;
  };

  void observe(std::span<Event> events, EventBatch& batch);
  // Whether an own event is the copy of one that another session recorded; then it is no more than an
  // OtherEvent.
  bool leave_copy(Event& event);
  // Whose events a stream holds, and by how much its clock is behind CLOCK_REALTIME.
  void apply(const EventHead& head, const StreamBegin& event);
  // The process tells of itself in this project's own events.
  void note_own(const EventHead& head);
  void apply(const EventHead& head, const ThreadInit& event);
  void apply(const EventHead& head, const CallbackInit& event);
  void apply(const EventHead& head, const PublisherInit& event);
  // Processes that only ROS 2's events tell of may take it.
  void apply(const EventHead& head, const Publish& event);
  // Its place among those that are known. Requires a pid.
  KnownPublisher& known_publisher(const EventHead& head, PublisherId id) noexcept {
    // Processes give the same ids.
    const auto mixed = static_cast<std::uint64_t>(id) + (SpreadBits{}(*head.pid) >> 32U);
    return own_publishers_[mixed & (own_publishers_.size() - 1)];
  }
  // The event comes soon; then: sooner.
  void prefetch(const Event& event) noexcept;
  void prefetch_next(const Event& event) noexcept;
  // Somebody may ask which publication a message is: from now on topics have them all.
  void link_messages();
  // Callbacks that ROS 2's events tell of, and none of this project's.
  void tell_beside_own(const Event& run_end, EventBatch& batch);
  // An instance of this project's starts or ends.
  template <typename Edge>
  void pass_own(const Event& whole, const Edge& edge, EventBatch& batch);
  // A run in a process that tells in this project's events, too. Whether another executor runs it there,
  // and so it is an instance like any other.
  static bool is_of_other_executor(const Payload& start, const ros2::Context& context);
  // Who wrote the message that it took, if it does not say and ROS 2's events do.
  void complete(const Event& whole, CallbackStart& event, EventBatch& batch);
  // The same of one that stayed within the process, if it took one.
  static void complete_in_process(const EmittingThread& emitting, CallbackStart& event);
  // Events of a host were lost: what is open may have ended, and what ends now may have begun
  // unseen.
  void lose(const EventHead& head, Timestamp from, Timestamp until, bool is_edge = false);
  // Before the event of that thread is translated: what may have ended unseen is open no more.
  // Its next event after another stream began.
  static void pass_edge(const EventHead& head, ros2::Thread& thread);
  static void look_at_losses(Host& host, const EventHead& head, const EmittingThread& emitting);
  // Begins and ends of losses.
  static void pass_bounds(Host& host, Timestamp now);
  // Where streams of a channel begin or end at different times, as those of a flight recorder do, events
  // of one CPU are missing until then, or from then on.
  void begin_stream(const EventHead& head);
  void end_stream(const EventHead& head);
  // What the stream does not tell that of another trace does, of the same CPU.
  bool has_events_beside(const Stream& stream) const;
  // All streams of the channel are over: no more is missing than that.
  void end_losses(Host& host, std::uint32_t channel, Timestamp time) const;
  // Something of it was told since then.
  static bool has_events_since(const Host& host, Timestamp time);
  // The packet may end a gap between sessions.
  void end_gap(const Event& packet_begin, EventBatch& batch);
  static void forget_what_runs(Host& host);
  // The process that speaks now spoke before such a gap.
  void tell_lived_on(Event& event, const Translation& translation, const ros2::Process& process,
                     EventBatch& batch);
  // The end of a callback whose start is the event before becomes a part of that. False: it is not.
  inline bool end_at_once(const Begun& begun, const Event& event, const Payload& fields,
                          EventBatch& batch);
  // The end of a callback after a start; and what is no such end.
  [[gnu::noinline]] bool translate_end(Event& event, const Translation& translation,
                                       const Payload& fields, EventBatch& batch);
  [[gnu::noinline]] bool translate_other(Event& event, const Translation& translation,
                                         const Payload& fields, EventBatch& batch);
  // Whatever it is, and whoever else tells of it.
  void translate(std::uint32_t kind, bool has_emitted, const Payload& p, ros2::Context context);
  // A callback that is announced starts, or one ends, in a process that only ROS 2's events tell of.
  // False: it may be something else.
  inline bool run(ros2::Ros2Event event, const Payload& p, ros2::Context& context);
  // A callback starts inside another one on a thread as none of that process can. `start`: its fields.
  static bool is_of_another_process(const ros2::Callback& callback, const Payload& start,
                                    const ros2::Thread& thread);
  // An executor waits, or has something ready without having waited, of which the thread takes note.
  // False: it may be something else.
  static inline bool take_note(ros2::Ros2Event event, const Payload& p, ros2::Context& context);
  static inline void look(ros2::Thread& thread);
  static inline void wait(const Payload& p, ros2::Thread& thread);
  static void take(ros2::Ros2Event event, const Payload& p, ros2::Context& context);
  inline void start(ros2::Address address, ros2::Callback& callback, const Payload& p,
                    ros2::Context& context);
  static inline void end(ros2::Address address, ros2::Context& context);
  static void enqueue(const Payload& p, ros2::Context& context);
  // At that time of a host whose clock of CLOCK_REALTIME is so much ahead of what its tracer read.
  ros2::MessageLinks::Take take_at(std::int64_t realtime,
                                   std::int64_t realtime_ahead) const noexcept {
    ros2::MessageLinks::Take take{.at = detail::wrapping_add(realtime, ros2::kOffsetError)};
    if (speaking_hosts_ > 1) take.told_until = detail::wrapping_add(take.at, realtime_ahead);
    return take;
  }
  struct Taken {
    ros2::MessageLinks::Origin origin{};
    std::optional<Timestamp> release{};
  };
  // `start`: its fields.
  Taken taken_by(ros2::Callback& callback, ros2::Address address, const Payload& start,
                 ros2::Context context);
  Stream& stream_of(const EventHead& head) {
    const auto index = static_cast<std::size_t>(head.stream);
    const bool is_known = index < streams_.size() && streams_[index].host != nullptr;
    return is_known ? streams_[index] : new_stream(index);
  }
  Stream& new_stream(std::size_t index);
  Channel& channel_of(const EventHead& head) {
    const auto channel = stream_of(head).channel;
    if (channel >= channels_.size()) channels_.resize(channel + std::size_t{1});
    return channels_[channel];
  }
  Host& host_of(std::string name_and_clock);
  // Of an event that has a pid.
  const EmittingThread& emitting_thread(Host& host, const EventHead& head) {
    const auto tid = static_cast<std::uint32_t>(head.tid.value_or(ros2::LastEvent::kNoThread));
    auto& emitting = emitting_[tid % kEmitting];
    const bool is_it =
        emitting.host == &host && emitting.pid == head.pid && emitting.tid == head.tid;
    if (!is_it) find(emitting, host, head);
    return emitting;
  }
  static void find(EmittingThread& emitting, Host& host, const EventHead& head);

  std::vector<Recording> recordings_;
  std::vector<Stream> streams_;
  std::vector<Channel> channels_;
  std::size_t speaking_hosts_ = 0;                    // of which user space tells
  bool may_have_copies_ = false;                      // of an event: some host has several traces
  bool is_ros2_told_ = false;                         // anything, but by the profile `ros2`
  std::array<EmittingThread, kEmitting> emitting_{};  // by tid
  Begun begun_;
  std::map<std::string, Host> hosts_;  // by name and clock
  std::array<std::pair<const Host*, std::int64_t>, 64>
      own_{};  // by pid: some that note_own() knows
  std::vector<KnownPublisher> own_publishers_ = std::vector<KnownPublisher>(256);  // some
  std::size_t own_publisher_count_ = 0;
  bool are_messages_linked_ = false;  // see link_messages()
  ros2::MessageLinks links_;
  ros2::Publications publications_{links_};
  ros2::Services services_;
  SessionGaps session_gaps_;
};

}  // namespace cie::analysis
