// The window of a whole recording, of the windows of its channels.
#pragma once

#include <cie/analysis/identity.hpp>
#include <cie/analysis/time.hpp>

#include "covered_window.hpp"

#include <algorithm>
#include <cstdint>
#include <map>

namespace cie::analysis {

// What windows on one clock have in common; their hull where that is nothing, as of processes that
// ran one after the other.
class CommonWindow {
 public:
  void add(CoveredWindow window, Duration shift = {}) {
    if (window.begin) {
      const auto begin = *window.begin + shift;
      common_.begin = std::max(common_.begin.value_or(begin), begin);
      hull_.begin = std::min(hull_.begin.value_or(begin), begin);
    }
    if (window.end) {
      const auto end = *window.end + shift;
      common_.end = std::min(common_.end.value_or(end), end);
      hull_.end = std::max(hull_.end.value_or(end), end);
    }
  }
  CoveredWindow result() const {
    const bool is_common = !common_.begin || !common_.end || *common_.begin <= *common_.end;
    return is_common ? common_ : hull_;
  }
  CoveredWindow hull() const { return hull_; }

 private:
  CoveredWindow common_;
  CoveredWindow hull_;
};

// Of a recording: what the channels of a session cover together, from the first session of a machine
// to its last, and what machines have in common.
class RecordedWindow {
 public:
  void add(HostIndex host, std::uint32_t trace, CoveredWindow channel, Duration shift) {
    hosts_[host][trace].add(channel, shift);
  }
  CoveredWindow result() const {
    CommonWindow all;
    for (const auto& [host, traces] : hosts_) {
      CommonWindow sessions;
      for (const auto& [trace, channels] : traces)
        sessions.add(channels.result());
      all.add(sessions.hull());
    }
    return all.result();
  }

 private:
  std::map<HostIndex, std::map<std::uint32_t, CommonWindow>> hosts_;
};

}  // namespace cie::analysis
