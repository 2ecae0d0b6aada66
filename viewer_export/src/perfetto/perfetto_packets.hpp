// Encodes Perfetto trace packets into a buffer. Times are nanoseconds on one timeline, which
// Perfetto is told is its BOOTTIME (see viewer_export/docs/viewers.md).
#pragma once

#include <cie/analysis/identity.hpp>
#include <cie/analysis/time.hpp>

#include "output/field_writer.hpp"
#include "perfetto_annotations.hpp"
#include "perfetto_fields.hpp"

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace cie::viewer_export::perfetto {

enum class Category : std::uint8_t { callback = 1, wait, publish, enforcement };

struct Slice {
  std::uint64_t track = 0;
  Category category{};
  std::uint64_t name_iid = 0;
};

// A value on a curve.
struct CounterValue {
  std::uint64_t track = 0;
  std::int64_t value = 0;
};

struct SwitchEvent {
  std::int64_t time = 0;
  std::int64_t prev_tid = 0;
  std::int32_t prev_prio = 0;
  std::int64_t prev_state = 0;
  std::string_view prev_comm;
  std::int64_t next_tid = 0;
  std::int32_t next_prio = 0;
  std::string_view next_comm;
};

struct WakingEvent {
  std::int64_t time = 0;
  std::int64_t waker_tid = 0;
  std::int64_t tid = 0;
  std::string_view comm;
  std::int32_t prio = 0;
  std::optional<std::int32_t> target_cpu;
};

class PacketBuffer {
 public:
  // Which machine the packets from here on are of; 0, at first, is the one that Perfetto calls the
  // default. Equal pids of different machines are different processes.
  void set_machine(analysis::HostIndex host) noexcept {
    machine_ = static_cast<std::uint32_t>(host);
  }

  // The clocks at one moment and the kernel whose task states are used. First in a file.
  void preamble(std::int64_t time, std::optional<std::int64_t> clock_offset_ns);
  // What to add to the machine's times for those of the default one.
  void clock_of_machine(analysis::Duration shift);
  // What later slices of this machine name by number: names[i] is name_iid i + 1, and
  // logical_ids[i] is Annotations::add_logical_id(i). After the preamble, before slices.
  void interned(std::int64_t time, std::span<const std::string> names,
                std::span<const std::string> logical_ids);
  void process(std::int64_t time, std::uint64_t uuid, std::int64_t pid, std::string_view name);
  void thread(std::int64_t time, std::uint64_t uuid, std::int64_t pid, std::int64_t tid,
              std::string_view name);
  // `parent` 0: none.
  void track(std::uint64_t uuid, std::uint64_t parent, std::string_view name);
  // Never merged with another one of its name.
  void counter_track(std::uint64_t uuid, std::uint64_t parent, std::string_view name,
                     CounterUnit unit);

  // `flow`: the arrow that ends here; 0 for none.
  void slice_begin(std::int64_t time, const Slice& slice, const Annotations& notes,
                   std::uint64_t flow = 0);
  // `counter`: what also changes then.
  void slice_end(std::int64_t time, std::uint64_t track,
                 const std::optional<CounterValue>& counter = {});
  // `flows`: arrows that leave from here.
  void instant(std::int64_t time, const Slice& slice, const Annotations& notes,
               std::span<const std::uint64_t> flows);
  // An instant whose name is not interned.
  void named_instant(std::int64_t time, std::uint64_t track, Category category,
                     std::string_view name, const Annotations& notes);
  void count(std::int64_t time, const CounterValue& counter);
  void switches(std::int32_t cpu, std::span<const SwitchEvent> events);
  void wakings(std::int32_t cpu, std::span<const WakingEvent> events);

  std::string_view bytes() const noexcept { return bytes_.view(); }
  void clear() noexcept { bytes_.clear(); }

 private:
  // Appends a packet; `fill` adds to it.
  template <typename Fill>
  void packet(const Fill& fill);
  template <typename Fill>
  void packet_at(std::int64_t time, const Fill& fill);
  // A packet of kernel events; `fill` adds to each what is beside its time.
  template <typename Event, typename Fill>
  void ftrace_bundle(std::int32_t cpu, std::span<const Event> events, const Fill& fill);
  // Appends a packet of a track event; `fill` writes at most `size` bytes of its fields.
  template <typename Fill>
  void event(std::int64_t time, EventType type, std::uint64_t track, std::size_t size,
             const Fill& fill);

  EncodedBytes bytes_;
  std::string packet_;  // one of those that are few
  std::uint32_t machine_ = 0;
};

}  // namespace cie::viewer_export::perfetto
