#include "kernel_holes.hpp"

#include "judgement.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

namespace cie::analysis {
namespace {

std::string_view name_of(LossKind kind) {
  switch (kind) {
    case LossKind::discarded_events:
      return "discarded_events";
    case LossKind::discarded_packets:
      return "discarded_packets";
    case LossKind::damaged_packet:
      return "damaged_packet";
    case LossKind::foreign_metadata:
      return "foreign_metadata";
    case LossKind::switch_mismatch:
      return "switch_mismatch";
    case LossKind::host_gap:
      return "host_gap";
  }
  return "";
}

std::string describe_loss(const Loss& loss) {
  std::string text = loss.count ? std::to_string(*loss.count) + " lost" : "an unknown number lost";
  constexpr auto kUnknown = std::numeric_limits<std::int64_t>::max();
  text += loss.end.ns == kUnknown ? ", until when is not known"
                                  : " until " + std::to_string(loss.end.ns);
  text += loss.domain == Domain::kernel ? ", kernel" : ", user space";
  return loss.note.empty() ? text : text + ", " + loss.note;
}

}  // namespace

Evidence evidence_of(const Loss& loss) {
  return Evidence{.event = std::string(name_of(loss.kind)),
                  .time = loss.begin,
                  .cpu = loss.cpu,
                  .pid = std::nullopt,
                  .tid = std::nullopt,
                  .note = describe_loss(loss)};
}

Evidence evidence_of_missing_cpus(std::uint32_t cpus, Timestamp time) {
  return evidence("cpus_not_recorded", moment(time),
                  analysis::counted(cpus, "CPU") + " without a kernel stream");
}

const Loss* loss_before(const Model& model, HostIndex host, Domain domain, Timestamp time) {
  const auto found = std::ranges::find_if(model.losses_before, [&](const Loss& loss) {
    return loss.host == host && loss.domain == domain && loss.is_evidence && loss.end >= time;
  });
  return found != model.losses_before.end() ? &*found : nullptr;
}

KernelHoles::KernelHoles(const Model& model) : model_(model) {
  Holes all;
  find_edges(all);
  for (const auto& loss : model.losses) {
    if (!loss.is_evidence || loss.domain != Domain::kernel) continue;
    all[loss.host].push_back({loss.begin, std::max(loss.begin, loss.end), &loss, nullptr});
  }
  merge(all);
}

void KernelHoles::merge(Holes& holes) {
  for (auto& [host, losses] : holes) {
    static const Loss edge{};
    std::ranges::stable_sort(losses, {}, [](const Interval& interval) {
      const auto& loss = interval.loss != nullptr ? *interval.loss : edge;
      return std::tie(interval.begin, interval.end, loss.kind, loss.cpu, loss.note);
    });
    auto& merged = holes_[host];
    for (const auto& interval : losses) {
      if (!merged.empty() && interval.begin <= merged.back().end) {
        merged.back().end = std::max(merged.back().end, interval.end);
      } else {
        merged.push_back(interval);
      }
    }
  }
}

void KernelHoles::find_edges(Holes& holes) {
  struct Edges {
    const StreamFacts* first_begin = nullptr;
    const StreamFacts* last_begin = nullptr;
    const StreamFacts* first_end = nullptr;
    const StreamFacts* last_end = nullptr;
    bool are_ends_known = true;
  };
  std::map<HostIndex, Edges> hosts;
  for (const auto& stream : model_.streams) {
    const bool is_record = stream.domain == Domain::kernel && stream.is_evidence && stream.begin &&
                           stream.events > 0 && !stream.is_left_out;
    if (!is_record) continue;
    if (stream.has_inheritance == false) without_inheritance_.emplace(stream.host, &stream);
    auto& edges = hosts[stream.host];
    const auto keep = [&stream](const StreamFacts*& kept, bool is_beyond) {
      if (kept == nullptr || is_beyond) kept = &stream;
    };
    keep(edges.first_begin, edges.first_begin && *stream.begin < *edges.first_begin->begin);
    keep(edges.last_begin, edges.last_begin && *stream.begin > *edges.last_begin->begin);
    edges.are_ends_known = edges.are_ends_known && stream.has_ended && stream.end;
    if (!edges.are_ends_known) continue;
    keep(edges.first_end, edges.first_end && *stream.end < *edges.first_end->end);
    keep(edges.last_end, edges.last_end && *stream.end > *edges.last_end->end);
  }
  const Duration one{1};
  for (const auto& [host, edges] : hosts) {
    begins_[host] = *edges.last_begin->begin;
    if (edges.are_ends_known) ends_[host] = *edges.last_end->end;
    if (*edges.first_begin->begin < *edges.last_begin->begin) {
      holes[host].push_back(
          {*edges.first_begin->begin, *edges.last_begin->begin - one, nullptr, edges.last_begin});
    }
    if (edges.are_ends_known && *edges.first_end->end < *edges.last_end->end) {
      holes[host].push_back(
          {*edges.first_end->end + one, *edges.last_end->end, nullptr, edges.first_end});
    }
  }
}

std::optional<Evidence> KernelHoles::between(HostIndex host, Timestamp begin, Timestamp end) const {
  if (model_.losses_dropped != 0) {
    return Evidence{.event = "discarded_events",
                    .time = begin,
                    .cpu = std::nullopt,
                    .pid = std::nullopt,
                    .tid = std::nullopt,
                    .note = "more losses than could be kept"};
  }
  if (const auto cpus = model_.hosts[at(host)].cpus_not_recorded; cpus != 0) {
    return evidence_of_missing_cpus(cpus, begin);
  }
  const auto found = holes_.find(host);
  if (found == holes_.end()) return std::nullopt;
  const auto& losses = found->second;
  const auto candidate = std::ranges::lower_bound(losses, begin, {}, &Interval::end);
  if (candidate == losses.end() || candidate->begin > end) return std::nullopt;
  return evidence_of_hole(*candidate);
}

Evidence KernelHoles::evidence_of_hole(const Interval& hole) {
  if (hole.loss != nullptr) return analysis::evidence_of(*hole.loss);
  const bool is_begin = hole.stream->begin > hole.begin;
  return evidence(is_begin ? "stream_begin" : "stream_end",
                  moment(is_begin ? *hole.stream->begin : *hole.stream->end),
                  (is_begin ? "the kernel's record of one CPU begins here, after that of others: "
                            : "the kernel's record of one CPU ends here, before that of others: ") +
                      hole.stream->path);
}

std::optional<Evidence> KernelHoles::begun_later(HostIndex host, Timestamp begin) const {
  const auto record = begins_.find(host);
  if (record == begins_.end() || record->second <= begin) return std::nullopt;
  const auto at = record->second;
  return evidence("sched_switch", moment(at),
                  "the kernel's record begins here; --window " + std::to_string(at.ns) +
                      ".. judges the time after it");
}

std::optional<Evidence> KernelHoles::since(HostIndex host, Timestamp begin, Timestamp end) const {
  if (auto later = begun_later(host, begin)) return later;
  if (const auto* before = loss_before(model_, host, Domain::kernel, begin))
    return evidence_of(*before);
  return between(host, begin, end);
}

std::optional<Evidence> KernelHoles::outside(HostIndex host, Timestamp begin, Timestamp end) const {
  if (auto later = begun_later(host, begin)) return later;
  const auto record = ends_.find(host);
  if (record == ends_.end() || record->second >= end) return std::nullopt;
  const auto at = record->second;
  return evidence("stream_end", moment(at),
                  "the kernel's record ends here; --window .." + std::to_string(at.ns) +
                      " judges the time before it");
}

std::optional<Evidence> KernelHoles::untold_inheritance(HostIndex host) const {
  const auto found = without_inheritance_.find(host);
  if (found == without_inheritance_.end()) return std::nullopt;
  return without_event(moment(*found->second->begin),
                       "sched_pi_setprio was not recorded: a raised priority may be inherited");
}

}  // namespace cie::analysis
