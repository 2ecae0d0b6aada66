#include "kernel/switch_check.hpp"

#include "kernel/kernel_record.h"

#include <cstring>

namespace cie::record {

void SwitchCheck::on_event(std::string_view event) {
  cie_sched_switch change{};
  if (event.size() != sizeof change) return;
  std::memcpy(&change, event.data(), sizeof change);
  if (change.header.id != CIE_SCHED_SWITCH) return;
  ++switches_;
  if (running_ >= 0 && running_ != change.prev.thread.tid) ++untold_;
  running_ = change.next.thread.tid;
}

}  // namespace cie::record
