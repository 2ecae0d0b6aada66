// Where events of applications were lost, as evidence about a process.
#pragma once

#include <cie/analysis/identity.hpp>
#include <cie/analysis/time.hpp>
#include <cie/analysis/verdict.hpp>

#include "model/facts.hpp"

#include <optional>

namespace cie::analysis {

// Of a gap that a loss made, or the edge of a stream.
Evidence evidence_of_recorder(const Model& model, const Reason& reason);

class UserLossesOfProcesses {
 public:
  // `model` is borrowed.
  explicit UserLossesOfProcesses(const Model& model) : model_(model) {}

  // Such events of applications on its machine were lost between the two, edges included.
  std::optional<Evidence> between(ProcessIndex process, Timestamp begin, Timestamp end,
                                  EventKinds kinds = kUserKinds) const;
  // The same then or later.
  std::optional<Evidence> since(ProcessIndex process, Timestamp time,
                                EventKinds kinds = kUserKinds) const;

  // Of a machine: all of a process with a callback may have been lost between the two, and no manifest names
  // every process.
  std::optional<Evidence> unseen_process(HostIndex host, Timestamp begin, Timestamp end) const;

 private:
  const Model& model_;
};

}  // namespace cie::analysis
