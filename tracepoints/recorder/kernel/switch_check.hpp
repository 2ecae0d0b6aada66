// Finds switches of threads that a kernel did not tell.
#pragma once

#include <cstdint>
#include <string_view>

namespace cie::record {

// Of one CPU, in order of time.
class SwitchCheck {
 public:
  // An event as it stands in the recording (kernel_record.h).
  void on_event(std::string_view event);
  // What ran then is not known.
  void on_loss() noexcept { running_ = -1; }
  std::uint64_t switches() const noexcept { return switches_; }
  // How often the thread that left the CPU was not the one that had entered it last.
  std::uint64_t untold() const noexcept { return untold_; }

 private:
  std::int32_t running_ = -1;  // next_tid of the last switch; -1: not known
  std::uint64_t switches_ = 0;
  std::uint64_t untold_ = 0;
};

}  // namespace cie::record
