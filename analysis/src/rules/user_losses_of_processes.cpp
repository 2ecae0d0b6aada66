#include "user_losses_of_processes.hpp"

#include "kernel_holes.hpp"

#include <cstdint>
#include <limits>

namespace cie::analysis {

UserLossesOfProcesses::UserLossesOfProcesses(const Model& model) : model_(model), losses_(model) {}

std::optional<Evidence> UserLossesOfProcesses::between(ProcessIndex process, Timestamp begin,
                                                       Timestamp end) const {
  const auto* loss = losses_.between(model_.processes[at(process)].host, begin, end);
  return loss != nullptr ? std::optional(evidence_of(*loss)) : std::nullopt;
}

std::optional<Evidence> UserLossesOfProcesses::since(ProcessIndex process, Timestamp time) const {
  return between(process, time, Timestamp{std::numeric_limits<std::int64_t>::max()});
}

}  // namespace cie::analysis
