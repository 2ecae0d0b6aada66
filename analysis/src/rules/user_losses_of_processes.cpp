#include "user_losses_of_processes.hpp"

#include "judgement.hpp"
#include "kernel_holes.hpp"
#include "model/loss_gaps.hpp"
#include "model/recorded_parts.hpp"

#include <algorithm>
#include <array>

namespace cie::analysis {

Evidence evidence_of_recorder(const Model& model, const Reason& reason) {
  if (reason.cause == GapCause::loss) return evidence_of(model.losses[reason.about]);
  if (reason.cause == GapCause::window) return evidence_of(model.losses_before[reason.about]);
  return evidence(
      "stream_begin", moment(reason.at),
      note("stream-begins-late", {{"stream", NamedFile{model.streams[reason.about].path}}}));
}

std::optional<Evidence> UserLossesOfProcesses::between(ProcessIndex process, Timestamp begin,
                                                       Timestamp end, EventKinds kinds) const {
  const auto* gap = user_gap(model_, model_.processes[at(process)].host, begin, end, kinds);
  return gap != nullptr ? std::optional(evidence_of_recorder(model_, gap->reason)) : std::nullopt;
}

std::optional<Evidence> UserLossesOfProcesses::since(ProcessIndex process, Timestamp time,
                                                     EventKinds kinds) const {
  return between(process, time, kLatest, kinds);
}

std::optional<Evidence> UserLossesOfProcesses::unseen_process(HostIndex host, Timestamp begin,
                                                              Timestamp end) const {
  const auto hidden = [&](EventKind kind) {
    return Hidden{.kinds = kind, .scope = {.host = host}, .window = {.from = begin, .to = end}};
  };
  const std::array process{hidden(EventKind::process_begin), hidden(EventKind::registration),
                           hidden(EventKind::announcement), hidden(EventKind::run_start)};
  const auto* gap = model_.gaps.gap(process);
  const auto& recordings = model_.recordings;
  const bool is_named = !recordings.empty() && std::ranges::all_of(recordings, names_all_processes);
  if (gap == nullptr || is_named) return std::nullopt;
  auto doubt = evidence_of_recorder(model_, gap->reason);
  doubt.note = note("process-perhaps-lost", {{"loss", std::move(doubt.note)}});
  return doubt;
}

}  // namespace cie::analysis
