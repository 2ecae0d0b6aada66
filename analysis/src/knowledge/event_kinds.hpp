// The kinds of events that a gap may hide, a proof accounts for and a rule asks for.
#pragma once

#include <cstdint>
#include <initializer_list>

namespace cie::analysis {

enum class EventKind : std::uint8_t {
  // State of an application: who there is, and how it is scheduled.
  process_begin,  // run_begin
  registration,   // callback_init
  announcement,   // thread_init
  applied,        // thread_sched: parameters that were set
  audit,          // thread_sched: parameters that are looked at again
  thread_exit,    // thread_fini
  callback_exit,  // callback_fini
  process_exit,   // run_end
  // What it does.
  run_start,
  run_end,
  release,
  publication,
  lost_sample,
  // The kernel's.
  context_switch,
  wakeup,
  priority_inheritance,
  fork,
  kernel_exit,
  // What no event shows.
  reuse,          // an address, a pid or a tid is given anew
  unseen_run,     // an instance of a callback that this tracer has no events for
  other_process,  // what has the same pid emits events
  other_account,  // the process's own events have the callback by another id, or leave it out
  clock_shift,    // processes of a host read clocks that differ
};

// A set of kinds.
class EventKinds {
 public:
  constexpr EventKinds() noexcept = default;
  // One kind is a set. NOLINTNEXTLINE(google-explicit-constructor)
  constexpr EventKinds(EventKind kind) noexcept : bits_{bit(kind)} {}
  constexpr EventKinds(std::initializer_list<EventKind> kinds) noexcept {
    for (const auto kind : kinds) {
      bits_ |= bit(kind);
    }
  }
  constexpr bool has(EventKind kind) const noexcept { return (bits_ & bit(kind)) != 0; }
  constexpr bool has_any(EventKinds other) const noexcept { return (bits_ & other.bits_) != 0; }
  friend constexpr EventKinds operator|(EventKinds a, EventKinds b) noexcept {
    a.bits_ |= b.bits_;
    return a;
  }
  friend constexpr EventKinds operator&(EventKinds a, EventKinds b) noexcept {
    a.bits_ &= b.bits_;
    return a;
  }
  constexpr EventKinds without(EventKinds other) const noexcept {
    EventKinds rest;
    rest.bits_ = bits_ & ~other.bits_;
    return rest;
  }
  template <typename Visit>
  constexpr void for_each(const Visit& visit) const {
    for (unsigned number = 0; number <= static_cast<unsigned>(EventKind::clock_shift); ++number) {
      if (const auto kind = static_cast<EventKind>(number); has(kind)) {
        visit(kind);
      }
    }
  }
  friend constexpr auto operator<=>(const EventKinds&, const EventKinds&) = default;

 private:
  static constexpr std::uint32_t bit(EventKind kind) noexcept {
    return std::uint32_t{1} << static_cast<unsigned>(kind);
  }

  std::uint32_t bits_ = 0;
};

inline constexpr EventKinds kStateKinds{EventKind::process_begin, EventKind::registration,
                                        EventKind::announcement,  EventKind::applied,
                                        EventKind::audit,         EventKind::thread_exit,
                                        EventKind::callback_exit, EventKind::process_exit};
inline constexpr EventKinds kReadBackKinds{EventKind::applied, EventKind::audit};
inline constexpr EventKinds kRunKinds{EventKind::run_start, EventKind::run_end, EventKind::release,
                                      EventKind::publication, EventKind::lost_sample};
inline constexpr EventKinds kUserKinds = kStateKinds | kRunKinds;
inline constexpr EventKinds kKernelKinds{EventKind::context_switch, EventKind::wakeup,
                                         EventKind::priority_inheritance, EventKind::fork,
                                         EventKind::kernel_exit};

}  // namespace cie::analysis
