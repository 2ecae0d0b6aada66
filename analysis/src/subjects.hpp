// Names of subjects as verdicts print them, and the orders in which things are printed.
#pragma once

#include "facts.hpp"

#include <string>
#include <vector>

namespace cie::analysis {

// "callback LOGICAL_ID" and the like, with " (pid N)" when the trace holds several processes,
// " (pid N on HOST)" when they are of several hosts.
class Subjects {
 public:
  explicit Subjects(const Model& model);

  // What tells the process at the end of each; empty if there is only one.
  std::string suffix(ProcessIndex index) const;
  std::string process(ProcessIndex index) const;  // "process PID"
  std::string callback(CallbackIndex index) const;
  std::string thread(ThreadIndex index) const;
  std::string group(const GroupFacts& group) const;
  std::string topic(const PublisherFacts& publisher) const;
  std::string chain(const ChainFacts& chain) const;  // of no process when it spans several
  // A subject named by the spec alone, of no process.
  static std::string callback_named(const std::string& logical_id);

 private:
  const Model& model_;
  bool has_several_ = false;  // processes
  bool has_several_hosts_ = false;
};

// Callbacks by host, pid, process and id: creation order within a process.
std::vector<CallbackIndex> callbacks_in_order(const Model& model);

}  // namespace cie::analysis
