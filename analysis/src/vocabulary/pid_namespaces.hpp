// Which process of a host an event is of, where its tracer tells the pid namespace.
#pragma once

#include <cie/analysis/event_head.hpp>
#include <cie/analysis/namespaced_pid.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace cie::analysis {

// Of one host. A pid of one namespace alone stays what it is, since not all events tell it.
class PidNamespaces {
 public:
  // `inode`: the namespace's; 0: the tracer could not tell.
  void tell_apart(std::uint64_t inode, EventHead& head) {
    if (inode == 0 || !head.pid) return;
    const auto pid = *head.pid;
    auto& known = recent_[static_cast<std::size_t>(pid) % recent_.size()];
    if (known.inode != inode || known.pid != pid) {
      known = {
          .pid = pid, .inode = inode, .told_pid = pid_in_namespace(number_of(inode, pid), pid)};
    }
    head.pid = known.told_pid;
  }

 private:
  struct Known {
    std::int64_t pid = 0;
    std::uint64_t inode = 0;  // 0: none
    std::int64_t told_pid = 0;
  };

  // Among those that have the pid; 0 also if these are too many to be told apart.
  std::uint32_t number_of(std::uint64_t inode, std::int64_t pid) {
    auto& inodes = inodes_[pid];
    const auto place = std::ranges::find(inodes, inode);
    const auto number = static_cast<std::uint32_t>(place - inodes.begin());
    if (place != inodes.end()) return number;
    if (number > kMostNamespaces) return 0;
    inodes.push_back(inode);
    return number;
  }

  std::array<Known, 256> recent_{};
  std::unordered_map<std::int64_t, std::vector<std::uint64_t>> inodes_;  // by pid, as they came
};

}  // namespace cie::analysis
