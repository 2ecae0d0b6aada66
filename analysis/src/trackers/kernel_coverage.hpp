// Which kernel traces are evidence at all, and of which CPUs: a kernel stream is evidence if its
// clock is that of the host's user-space streams, and it tells of one CPU. Where two traces tell of the
// same switches, as overlapping snapshots do, the one that began first is heard, until it ends.
#pragma once

#include <cie/analysis/event.hpp>

#include "model/by_index.hpp"
#include "model/facts.hpp"
#include "model/kernel_record.hpp"
#include "model/optional_time.hpp"

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

namespace cie::analysis {

class KernelCoverage {
 public:
  explicit KernelCoverage(Model& model) : model_(model) {}

  // A stream began, of that CPU if its first packet tells already.
  void begin(const EventHead& head, const StreamBegin& event, HostIndex host);
  // The CPU, if none of its streams was open since that of another trace ended, some time before.
  std::optional<std::int32_t> begin_packet(const EventHead& head);
  void end(StreamIndex index, Timestamp time);
  // A switch on the CPU: the stream tells of it, and its channel of switches.
  void note_switch(StreamIndex index, std::int32_t cpu, Timestamp time) {
    auto* stream = streams_.find(index);
    if (stream == nullptr) return;
    stream->last_switch = time;
    if (!(stream->has_switches && stream->cpu == cpu)) note_switches(*stream, cpu);
  }
  // The host has so many CPUs.
  void expect(HostIndex host, std::uint32_t online_cpus);
  // The host has this CPU. False: some kernel stream of the host is open, and none of this CPU.
  bool see(HostIndex index, std::int32_t cpu) {
    const auto place = static_cast<std::size_t>(cpu);
    const auto* host = hosts_.find(index);
    if (host == nullptr || place >= host->cpus.size() || !host->cpus[place].is_seen) {
      return see_first(index, cpu);
    }
    return host->cpus[place].open > 0 || host->open == 0;
  }

  // The events of a user-space stream, or of a kernel stream that shares its clock with them. What
  // shares no clock is neither for nor against anything: rule T6 says that it is there.
  bool is_evidence(StreamIndex index) const noexcept {
    const auto* stream = streams_.find(index);
    return stream == nullptr || !stream->is_kernel || stream->is_evidence;
  }
  // Evidence, and the event is no other trace's over again.
  bool tells(const EventHead& head) const noexcept {
    const auto* stream = streams_.find(head.stream);
    return stream == nullptr || !stream->is_kernel ||
           (stream->is_evidence && head.time > stream->told_until);
  }
  // A loss of the stream that lasted until `end` counts: no other trace told what was lost.
  bool costs(const EventHead& head, Timestamp end) const noexcept {
    return is_evidence(head.stream) && (tells(head) || end > head.time);
  }
  // Some kernel stream is evidence.
  bool is_any() const noexcept { return evidence_ != 0; }
  bool has_kernel(HostIndex host) const noexcept {
    if (evidence_ == 0) return false;
    const auto* state = hosts_.find(host);
    return state != nullptr && state->streams > 0;
  }
  bool covers(HostIndex host, std::int32_t cpu) const;
  // Every one of the CPUs, of which there is at least one.
  bool covers(HostIndex host, std::span<const std::uint32_t> cpus) const;
  // Every CPU that the host is known to have.
  bool covers_all(HostIndex host) const;
  // Of a trace whose channels these are; empty: not known yet.
  std::set<std::int32_t> cpus_of(HostIndex host, std::span<const std::uint32_t> channels) const;
  std::optional<std::int32_t> cpu_of(StreamIndex stream) const;
  // How often one of these answers may have changed.
  std::uint64_t changes() const noexcept { return changes_; }

  // Writes down what is missing on each host.
  void finish();

 private:
  struct Stream {
    bool is_kernel = false;
    bool is_evidence = false;
    bool is_open = false;  // between its first packet's begin and its end
    bool has_switches = false;
    bool may_repeat = false;   // its trace declares sched_switch
    bool is_left_out = false;  // it covers nothing of the time that the others do
    HostIndex host{};
    std::uint32_t channel = 0;
    std::uint32_t trace = 0;
    Timestamp last_switch = kEarliest;
    // Another trace's stream tells, or told, of the same until then.
    Timestamp told_until = kEarliest;
    std::optional<std::int32_t> cpu;
  };
  struct Channel {
    std::set<std::int32_t> cpus;
    bool has_switches = false;  // seen yet
  };
  struct Cpu {
    bool is_seen = false;    // the host has it
    std::uint32_t open = 0;  // kernel streams of it
    // The last of them that ended.
    OptionalTime ended;
    std::uint32_t ended_trace = 0;
  };
  struct Host {
    std::optional<std::string> user_clock;  // of its first user-space stream
    bool has_other_user_clock = false;
    std::uint32_t streams = 0;  // of the kernel, that are evidence
    std::uint32_t open = 0;     // of them
    std::map<std::uint32_t, Channel> channels;
    std::uint32_t online_cpus = 0;
    std::vector<Cpu> cpus;  // by number
    // Found out, until something changes.
    std::optional<std::set<std::int32_t>> covered;
    std::optional<bool> is_whole;
  };

  bool see_first(HostIndex host, std::int32_t cpu);
  // Null: no such number is believed.
  static Cpu* cpu_of(Host& host, std::int32_t number);
  // CPUs of the channels that have switches, or, as long as none is known to, of all.
  static const std::set<std::int32_t>& covered(Host& host);
  static std::uint32_t missing(Host& host);
  void change(Host& host);
  // Both are open, and of one CPU.
  static bool are_beside(const Stream& one, const Stream& other);
  // The trace that is open beside it is heard from now on.
  void hand_over(const Stream& ended);
  template <typename Function>
  void each_kernel_stream(const Function& function);
  bool is_related(const Stream& stream, const std::string& clock) const;
  void relate();
  void set_open(Stream& stream, bool is_open);
  void note_cpu(Stream& stream, std::int32_t cpu);
  void note_switches(Stream& stream, std::int32_t cpu);

  Model& model_;
  ByIndex<StreamIndex, Stream> streams_;
  mutable ByIndex<HostIndex, Host> hosts_;
  std::size_t evidence_ = 0;  // kernel streams that are, of all hosts
  std::uint64_t changes_ = 0;
};

}  // namespace cie::analysis
