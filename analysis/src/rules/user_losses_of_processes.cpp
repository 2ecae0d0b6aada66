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
// thread_init, callback_start, callback_end.
constexpr std::uint64_t kLeastOfThread = 3;

// Of events that LTTng discarded; no less than `enough` for each packet, as nothing tells how many it had.
std::uint64_t most_events(const Loss& loss, std::uint64_t enough) {
  if (loss.kind == LossKind::discarded_packets) return enough;
  return loss.kind == LossKind::discarded_events ? loss.count.value_or(enough) : 0;
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

const Loss* UserLossesOfProcesses::first_of(std::uint64_t events, HostIndex host, Timestamp begin,
                                            Timestamp end) const {
  if (losses_.between(host, begin, end) == nullptr) return nullptr;
  const Loss* first = nullptr;
  std::uint64_t lost = 0;
  for (const auto& loss : model_.losses) {
    const bool is_there = loss.host == host && loss.domain == Domain::user && loss.is_evidence &&
                          loss.begin <= end && loss.end >= begin;
    const auto most = is_there ? most_events(loss, events) : 0;
    if (first == nullptr && most > 0) first = &loss;
    lost += most;
  }
  return lost < events ? nullptr : first;
}

std::optional<Evidence> UserLossesOfProcesses::unseen_process(HostIndex host, Timestamp begin,
                                                              Timestamp end) const {
  const auto* first = first_of(kLeastOfProcess, host, begin, end);
  const auto& recordings = model_.recordings;
  const bool is_named = !recordings.empty() && std::ranges::all_of(recordings, names_all_processes);
  if (first == nullptr || is_named) return std::nullopt;
  auto doubt = evidence_of(*first);
  doubt.note += ": a whole process may be among them, and no manifest names all that ran";
  return doubt;
}

std::optional<Evidence> UserLossesOfProcesses::unseen_thread(ProcessIndex process, Timestamp begin,
                                                             Timestamp end) const {
  const auto* first = first_of(kLeastOfThread, model_.processes[at(process)].host, begin, end);
  if (first == nullptr) return std::nullopt;
  auto doubt = evidence_of(*first);
  doubt.note += ": a thread that ran its instances before may be among them";
  return doubt;
}

}  // namespace cie::analysis
