// Turns running times of threads into the kernel's switch events, as Perfetto wants them: each
// CPU's switches join up, so a gap between two slices becomes a switch to idle and back, or to a task
// "not recorded" where no event tells what ran. Wake-ups say who woke whom.
#pragma once

#include <cie/analysis/instance.hpp>

#include "output/name_table.hpp"
#include "output/spool.hpp"
#include "perfetto_packets.hpp"

#include <compare>
#include <cstdint>
#include <filesystem>
#include <map>
#include <ostream>
#include <utility>
#include <vector>

namespace cie::viewer_export::perfetto {

class SchedRecorder {
 public:
  explicit SchedRecorder(std::filesystem::path spill_directory)
      : spool_(spill_directory), wakings_(std::move(spill_directory)) {}

  // Slices of one CPU come in order of time. False: it cannot be drawn and is left out.
  bool add(const analysis::SchedSlice& slice);
  // False: it cannot be drawn, because it is not known where it happened.
  bool add(const analysis::Waking& waking);
  // Writes all packets.
  void finish(std::ostream& out);

 private:
  struct Running {
    std::int64_t tid = 0;
    std::int32_t priority = 120;
    std::uint32_t comm = 0;
    std::int64_t end = 0;
    std::int64_t end_state = 0;
  };
  struct Cpu {
    Running last;
    bool has_last = false;
    std::vector<SwitchEvent> pending;  // one packet's worth
  };
  struct CpuKey {
    analysis::HostIndex host{};
    std::int32_t number = 0;
    // NOLINTNEXTLINE(modernize-use-nullptr): see time.hpp
    friend auto operator<=>(const CpuKey&, const CpuKey&) = default;
  };
  using Comms = std::map<std::pair<analysis::HostIndex, std::int64_t>, std::uint32_t>;

  // With a tid that Linux never gives.
  Running unrecorded();
  void switch_task(const CpuKey& key, Cpu& cpu, std::int64_t time, const Running& prev,
                   const Running& next);
  void flush(const CpuKey& key, Cpu& cpu);
  void write_wakings(std::ostream& out);

  NameTable names_;
  std::map<CpuKey, Cpu> cpus_;
  Comms comms_;  // of each thread that ran: host and tid
  PacketBuffer packets_;
  Spool spool_;
  Spool wakings_;  // as they came: a thread's name may be told later
};

}  // namespace cie::viewer_export::perfetto
