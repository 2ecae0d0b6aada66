// Turns running times of threads into the kernel's switch events, as Perfetto wants them: each
// CPU's switches join up, so a gap between two slices becomes a switch to idle and back.
#pragma once

#include <cie/analysis/instance.hpp>

#include "name_table.hpp"
#include "perfetto_packets.hpp"
#include "spool.hpp"

#include <cstdint>
#include <filesystem>
#include <map>
#include <ostream>
#include <vector>

namespace cie::viewer_export::perfetto {

class SchedRecorder {
 public:
  explicit SchedRecorder(std::filesystem::path spill_directory)
      : spool_(std::move(spill_directory)) {}

  // Slices of one CPU come in order of time. False: it cannot be drawn and is left out.
  bool add(const analysis::SchedSlice& slice);
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

  void switch_task(std::int32_t number, Cpu& cpu, std::int64_t time, const Running& prev,
                   const Running& next);
  void flush(std::int32_t number, Cpu& cpu);

  NameTable names_;
  std::map<std::int32_t, Cpu> cpus_;
  PacketBuffer packets_;
  Spool spool_;
};

}  // namespace cie::viewer_export::perfetto
