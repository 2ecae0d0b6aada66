// Which threads may have served callbacks that nobody can see: rclcpp tells of no response that a
// client's callback was given, nor of what actions do. ROS 2's events know no groups, so it may have
// been any thread of the process that runs callbacks, unless a tracer says more.
#pragma once

#include <cie/analysis/verdict.hpp>

#include "model/facts.hpp"

#include <cstddef>
#include <map>
#include <optional>
#include <set>

namespace cie::analysis {

class HiddenCallbacks {
 public:
  explicit HiddenCallbacks(const Model& model);
  // Another executor than this project's ran one there, as ROS 2's events show.
  std::optional<Evidence> beside_own(ThreadIndex thread) const;
  // Ones that no event shows may have run there.
  std::optional<Evidence> unseen_on(ThreadIndex thread) const;

 private:
  // Why nobody knows which ones the process has; empty if they are known.
  std::optional<Evidence> may_be_unseen(const ProcessFacts& process) const;
  // Those that a thread may have served: the first, and how many.
  struct Some {
    const HiddenCallback* first = nullptr;
    std::size_t count = 0;
    void add(const HiddenCallback& hidden) {
      if (count++ == 0) first = &hidden;
    }
  };

  const Model& model_;
  // Since when streams of a machine tell what makes clients and services.
  std::map<HostIndex, Timestamp> told_since_;
  std::map<ProcessIndex, Some> anywhere_;  // on any thread of the process
  std::map<ThreadIndex, Some> on_threads_;
  std::set<ThreadIndex>
      of_other_executors_;  // of processes that tell of all callbacks of their own
};

}  // namespace cie::analysis
