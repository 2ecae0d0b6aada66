// Who emitted the last events, and when each was last seen: for most events this takes the place of
// look-ups in three tables of the registry, and of writing to the facts.
#pragma once

#include <cie/analysis/context_number.hpp>
#include <cie/analysis/event.hpp>

#include "base/prefetch.hpp"
#include "flat_map.hpp"
#include "model/by_index.hpp"
#include "model/facts.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace cie::analysis {

// What an emitter's events named last, which they often name again.
template <typename Id, typename Index>
struct LastNamed {
  static constexpr auto kNothing = static_cast<Index>(~std::uint32_t{0});
  Id id{};
  Index index = kNothing;

  bool is_any() const noexcept { return index != kNothing; }
  bool is(Id other) const noexcept { return is_any() && id == other; }
};

struct KnownEmitter {
  ThreadFacts* thread_facts = nullptr;  // null: nothing
  ProcessFacts* process_facts = nullptr;
  HostIndex host{};
  ProcessIndex process{};
  ThreadIndex thread{};
  ContextNumber<std::int64_t> pid;
  ContextNumber<std::int64_t> tid;
  // Its last event, not yet in its facts and its process's; and which of all it was.
  ContextNumber<std::int32_t> last_cpu;
  Timestamp last_time;
  std::uint64_t last_turn = 0;
  LastNamed<CallbackId, CallbackIndex> ran;
  CallbackFacts* ran_facts = nullptr;             // of that callback
  LastNamed<CallbackId, CallbackIndex> released;  // whose release or lost sample it told
  LastNamed<PublisherId, std::uint32_t> published;

  bool is_of(const EventHead& head, HostIndex of_host) const noexcept {
    return thread_facts != nullptr && head.tid == tid && head.pid == pid && host == of_host;
  }
  EventRef last_seen() const noexcept {
    return {.time = last_time, .cpu = last_cpu, .pid = pid, .tid = tid};
  }
};

static_assert(sizeof(KnownEmitter) <= 88, "there are two for each of many threads");

class KnownEmitters {
 public:
  // Borrowed. The facts' `last_seen` are up to date after forget_all().
  explicit KnownEmitters(Model& model) : model_(model) {}

  // It will be looked for soon.
  void prefetch(const EventHead& head) const noexcept {
    prefetch_to_write(&places_[place(head.pid, head.tid)]);
  }
  // Null: its emitter must be looked up. Valid until another one is kept.
  [[gnu::always_inline]] const KnownEmitter* peek(const EventHead& head,
                                                  HostIndex host) const noexcept {
    const auto& known = places_[place(head.pid, head.tid)];
    return known.is_of(head, host) ? &known : nullptr;
  }
  [[gnu::always_inline]] KnownEmitter* peek(const EventHead& head, HostIndex host) noexcept {
    return const_cast<KnownEmitter*>(std::as_const(*this).peek(head, host));
  }
  // Notes another event of it.
  void see_again(KnownEmitter& known, ContextNumber<std::int32_t> cpu, Timestamp time) noexcept {
    known.last_cpu = cpu;
    known.last_time = time;
    known.last_turn = ++turn_;
  }
  // After process_seen(): what was looked up of an event with a pid and a tid.
  KnownEmitter& keep(const EventHead& head, HostIndex host, ProcessIndex process,
                     ThreadIndex thread);
  // An event of a process whose emitter was not found here.
  void process_seen(ProcessIndex process, const EventRef& event) {
    note_last_seen(process, event, ++turn_);
  }
  // Before that thread's incarnation is replaced by another one.
  void forget(std::int64_t pid, std::int64_t tid) { forget(places_[place(pid, tid)]); }
  // Before incarnations of processes are replaced, or what is known of emitters is read.
  void forget_all();

 private:
  // Powers of two. There are twice as many places as threads, as long as that is not too many; of few
  // threads hardly two share one.
  static constexpr std::size_t kFewest = 2048;
  static constexpr std::size_t kMost = std::size_t{1} << 16U;

  // Threads of one process have tids close to each other: they do not meet in one place.
  std::size_t place(std::optional<std::int64_t> pid,
                    std::optional<std::int64_t> tid) const noexcept {
    const auto mixed =
        static_cast<std::uint64_t>(tid.value_or(0)) + (SpreadBits{}(pid.value_or(0)) >> 32U);
    return mixed & last_place_;
  }
  void forget(KnownEmitter& known);
  void note_last_seen(ProcessIndex process, const EventRef& event, std::uint64_t turn);

  Model& model_;
  std::vector<KnownEmitter> places_ = std::vector<KnownEmitter>(kFewest);
  std::size_t last_place_ = kFewest - 1;                // places_.size() is a division
  std::uint64_t turn_ = 0;                              // of events, counted up
  ByIndex<ProcessIndex, std::uint64_t> process_turns_;  // of the event that is its last_seen
};

}  // namespace cie::analysis
