#include "user_losses_of_processes.hpp"

#include "kernel_holes.hpp"
#include "model/recorded_parts.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>

namespace cie::analysis {
namespace {

// run_begin, callback_init, thread_init, callback_start.
constexpr std::uint64_t kLeastOfProcess = 4;

// Of events that LTTng discarded, and as many for each packet: nothing tells how many it had.
std::uint64_t most_events(const Loss& loss) {
  if (loss.kind == LossKind::discarded_packets) return kLeastOfProcess;
  return loss.kind == LossKind::discarded_events ? loss.count.value_or(kLeastOfProcess) : 0;
}

}  // namespace

UserLossesOfProcesses::UserLossesOfProcesses(const Model& model) : model_(model), losses_(model) {}

std::optional<Evidence> UserLossesOfProcesses::between(ProcessIndex process, Timestamp begin,
                                                       Timestamp end) const {
  const auto* loss = losses_.between(model_.processes[at(process)].host, begin, end);
  return loss != nullptr ? std::optional(evidence_of(*loss)) : std::nullopt;
}

std::optional<Evidence> UserLossesOfProcesses::since(ProcessIndex process, Timestamp time) const {
  return between(process, time, Timestamp{std::numeric_limits<std::int64_t>::max()});
}

std::optional<Evidence> UserLossesOfProcesses::unseen_process(HostIndex host, Timestamp begin,
                                                              Timestamp end) const {
  if (losses_.between(host, begin, end) == nullptr) return std::nullopt;
  const auto& recordings = model_.recordings;
  if (!recordings.empty() && std::ranges::all_of(recordings, names_all_processes))
    return std::nullopt;
  const Loss* first = nullptr;
  std::uint64_t events = 0;
  for (const auto& loss : model_.losses) {
    const bool is_there = loss.host == host && loss.domain == Domain::user && loss.is_evidence &&
                          loss.begin <= end && loss.end >= begin;
    if (!is_there || most_events(loss) == 0) continue;
    if (first == nullptr) first = &loss;
    events += most_events(loss);
  }
  if (events < kLeastOfProcess) return std::nullopt;
  auto doubt = evidence_of(*first);
  doubt.note += ": a whole process may be among them, and no manifest names all that ran";
  return doubt;
}

}  // namespace cie::analysis
