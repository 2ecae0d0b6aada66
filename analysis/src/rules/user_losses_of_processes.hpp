// Where events of applications were lost, as evidence about a process: see model/user_losses.
#pragma once

#include <cie/analysis/identity.hpp>
#include <cie/analysis/time.hpp>
#include <cie/analysis/verdict.hpp>

#include "model/facts.hpp"
#include "model/user_losses.hpp"

#include <cstdint>
#include <optional>

namespace cie::analysis {

class UserLossesOfProcesses {
 public:
  // `model` is borrowed.
  explicit UserLossesOfProcesses(const Model& model);

  // Events of applications on its machine were lost between the two, edges included.
  std::optional<Evidence> between(ProcessIndex process, Timestamp begin, Timestamp end) const;
  // The same then or later.
  std::optional<Evidence> since(ProcessIndex process, Timestamp time) const;

  // Of a machine: so many events or packets were lost between the two that all of a process with a callback
  // may have been among them, and no manifest names every process.
  std::optional<Evidence> unseen_process(HostIndex host, Timestamp begin, Timestamp end) const;

  // Likewise all of a thread that ran a callback of the process.
  std::optional<Evidence> unseen_thread(ProcessIndex process, Timestamp begin, Timestamp end) const;

  const UserLosses& of_hosts() const noexcept { return losses_; }

 private:
  // The first of those that may have been so many events; null: they were fewer.
  const Loss* first_of(std::uint64_t events, HostIndex host, Timestamp begin, Timestamp end) const;

  const Model& model_;
  const UserLosses losses_;
};

}  // namespace cie::analysis
