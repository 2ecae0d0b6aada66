#include "kernel_holes.hpp"

#include <cie/analysis/note.hpp>

#include "judgement.hpp"

#include <algorithm>
#include <cstdint>
#include <set>
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

// Behind what is lost: for how long.
Note describe_span(const Loss& loss) {
  if (loss.begin == kBoot) {
    const bool is_end_known = loss.end > kBoot && loss.end != kLatest;
    return is_end_known ? note("lost-before", {{"end", loss.end}}) : note("lost-when-unknown");
  }
  if (loss.end == kLatest) return note("lost-until-unknown");
  if (loss.end <= loss.begin) return {};
  return note("lost-within", {{"span", loss.end - loss.begin}});
}

// What is lost, and for how long.
Note describe_missing(const Loss& loss) {
  auto span = describe_span(loss);
  if (loss.kind == LossKind::switch_mismatch)
    return note("switches-missing", {{"when", std::move(span)}});
  const bool is_kernel = loss.domain == Domain::kernel;
  if (!loss.count) {
    return note(is_kernel ? "kernel-events-lost-uncounted" : "user-events-lost-uncounted",
                {{"when", std::move(span)}});
  }
  if (loss.kind == LossKind::discarded_packets) {
    return note(is_kernel ? "kernel-packets-lost" : "user-packets-lost",
                {{"packets", *loss.count}, {"when", std::move(span)}});
  }
  return note(is_kernel ? "kernel-events-lost" : "user-events-lost",
              {{"events", *loss.count}, {"when", std::move(span)}});
}

// What cannot be read, and why, leads.
Note describe_loss(const Loss& loss) {
  if (loss.kind == LossKind::foreign_metadata) return free_text(loss.note);
  auto missing = describe_missing(loss);
  if (loss.note.empty()) return missing;
  if (loss.kind == LossKind::damaged_packet)
    return note("damage", {{"text", loss.note}, {"missing", std::move(missing)}});
  const bool is_of_stream =
      loss.kind == LossKind::discarded_events || loss.kind == LossKind::discarded_packets;
  return is_of_stream
             ? note("loss-of-stream",
                    {{"missing", std::move(missing)}, {"stream", NamedFile{loss.note}}})
             : note("loss-with-text", {{"missing", std::move(missing)}, {"text", loss.note}});
}

}  // namespace

Evidence evidence_of(const Loss& loss) {
  return Evidence{.event = std::string(name_of(loss.kind)),
                  .time = time_of_evidence(loss.begin),
                  .cpu = loss.cpu,
                  .pid = std::nullopt,
                  .tid = std::nullopt,
                  .note = describe_loss(loss),
                  .is_user_loss = loss.domain == Domain::user};
}

Evidence evidence_of_missing_cpus(std::uint32_t cpus, std::optional<Timestamp> time) {
  return evidence("cpus_not_recorded", moment(time),
                  note("cpus-without-kernel-stream", {{"cpus", cpus}}));
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
    all[loss.host].push_back({loss.begin, std::max(loss.begin, loss.end), &loss});
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

namespace {

bool is_record(const StreamFacts& stream) {
  return stream.domain == Domain::kernel && stream.is_evidence && stream.begin &&
         !stream.is_left_out;
}

// An idle CPU's packet has the begin of the last flush.
bool tells_begin(const StreamFacts& stream) { return stream.events > 0; }
// A flush alone may stand at the begin of a chunk (see ChannelWindows::narrows).
bool tells_end(const StreamFacts& stream) {
  return stream.events > 0 || stream.begin != stream.end;
}

// Which of its streams the time is the begin of, or the end. Null: of none.
const StreamFacts* stream_of(const Model& model, HostIndex host,
                             std::optional<Timestamp> StreamFacts::*edge, Timestamp time) {
  const bool is_begin = edge == &StreamFacts::begin;
  const auto found = std::ranges::find_if(model.streams, [&](const StreamFacts& stream) {
    return is_record(stream) && (is_begin ? tells_begin(stream) : tells_end(stream)) &&
           stream.host == host && stream.*edge == time;
  });
  return found != model.streams.end() ? &*found : nullptr;
}

// Of one trace.
struct Record {
  bool has_switches = false;
  bool has_inheritance = false;
  std::set<std::int32_t> cpus;
  std::optional<Timestamp> first_begin;
  Timestamp last_begin = kEarliest;
  Timestamp first_end = kLatest;
  Timestamp last_end = kEarliest;

  void add(const StreamFacts& stream) {
    if (stream.cpu) cpus.insert(*stream.cpu);
    const auto end = stream.has_ended ? stream.end.value_or(kLatest) : kLatest;
    if (tells_end(stream)) first_end = std::min(first_end, end);
    if (!tells_begin(stream)) return;
    has_switches = stream.has_inheritance.has_value();
    has_inheritance = stream.has_inheritance.value_or(false);
    last_begin = std::max(last_begin, *stream.begin);
    first_begin = std::min(first_begin.value_or(*stream.begin), *stream.begin);
    last_end = std::max(last_end, end);
  }
  KernelPart part() const {
    KernelPart part{.has_switches = has_switches, .cpus = cpus};
    const auto end = last_end == kLatest ? kLatest : first_end;
    if (last_begin <= end) part.covers = {.begin = last_begin, .end = end};
    return part;
  }
};

}  // namespace

void KernelHoles::find_edges(Holes& holes) {
  std::map<HostIndex, std::map<std::uint32_t, Record>> hosts;  // by trace
  for (const auto& stream : model_.streams) {
    if (!is_record(stream)) continue;
    if (stream.events > 0 && stream.has_inheritance == false)
      without_inheritance_[stream.host].push_back(&stream);
    hosts[stream.host][stream.trace].add(stream);
  }
  for (const auto& [host, records] : hosts) {
    std::vector<KernelPart> parts;
    std::vector<KernelPart> parts_with_inheritance;
    Stretch all{.begin = kLatest, .end = kEarliest};
    auto last_begin = kEarliest;
    for (const auto& [trace, record] : records) {
      if (!record.first_begin) continue;
      parts.push_back(record.part());
      if (record.has_switches) {
        auto& part = parts_with_inheritance.emplace_back(record.part());
        if (!record.has_inheritance) part.covers.reset();
      }
      all = {.begin = std::min(all.begin, *record.first_begin),
             .end = std::max(all.end, record.last_end)};
      last_begin = std::max(last_begin, record.last_begin);
    }
    if (parts.empty()) continue;
    const auto stretches = recorded(parts);
    if (without_inheritance_.contains(host))
      with_inheritance_[host] = recorded(parts_with_inheritance);
    begins_[host] = stretches.empty() ? last_begin : stretches.front().begin;
    if (all.end != kLatest) ends_[host] = all.end;
    add_holes(host, all, stretches, holes[host]);
  }
}

// What lies outside the stretches.
void KernelHoles::add_holes(HostIndex host, Stretch all, const std::vector<Stretch>& stretches,
                            std::vector<Interval>& holes) const {
  const Duration one{1};
  const auto add = [&](Timestamp begin, Timestamp end) {
    const auto next = end < all.end ? end + one : begins_.at(host);
    const bool is_first = begin == all.begin;
    const auto* ends = is_first ? nullptr : stream_of(model_, host, &StreamFacts::end, begin - one);
    const auto* begins =
        end < all.end || is_first ? stream_of(model_, host, &StreamFacts::begin, next) : nullptr;
    holes.push_back({.begin = begin, .end = end, .loss = nullptr, .ends = ends, .begins = begins});
  };
  auto begin = all.begin;
  for (const auto& stretch : stretches) {
    if (begin < stretch.begin) add(begin, stretch.begin - one);
    if (stretch.end == kLatest) return;
    begin = stretch.end + one;
  }
  if (begin <= all.end) add(begin, all.end);
}

std::optional<Evidence> KernelHoles::between(HostIndex host, Timestamp begin, Timestamp end) const {
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
  if (hole.ends == nullptr) {
    return evidence(
        "stream_begin", moment(*hole.begins->begin),
        note("kernel-record-of-cpu-begins-late", {{"stream", NamedFile{hole.begins->path}}}));
  }
  if (hole.begins == nullptr) {
    return evidence(
        "stream_end", moment(*hole.ends->end),
        note("kernel-record-of-cpu-ends-early", {{"stream", NamedFile{hole.ends->path}}}));
  }
  return evidence("stream_end", moment(*hole.ends->end),
                  note("kernel-record-interrupted", {{"begin", hole.begins->begin->ns},
                                                     {"stream", NamedFile{hole.ends->path}}}));
}

std::optional<Evidence> KernelHoles::begun_later(HostIndex host, Timestamp begin) const {
  const auto record = begins_.find(host);
  if (record == begins_.end() || record->second <= begin) return std::nullopt;
  const auto at = record->second;
  return evidence("sched_switch", moment(at), note("kernel-record-begins", {{"begin", at.ns}}));
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
  return evidence("stream_end", moment(at), note("kernel-record-ends", {{"end", at.ns}}));
}

std::optional<Evidence> KernelHoles::untold_inheritance(HostIndex host, Timestamp begin,
                                                        Timestamp end) const {
  const auto found = without_inheritance_.find(host);
  if (found == without_inheritance_.end()) return std::nullopt;
  const auto told = with_inheritance_.find(host);
  const bool is_told =
      told != with_inheritance_.end() && std::ranges::any_of(told->second, [&](const auto& by) {
        return by.begin <= begin && end <= by.end;
      });
  const auto stream = std::ranges::find_if(found->second, [&](const StreamFacts* without) {
    const bool is_over = without->has_ended && without->end && *without->end < begin;
    return *without->begin <= end && !is_over;
  });
  if (is_told || stream == found->second.end()) return std::nullopt;
  return without_event(moment(*(*stream)->begin), note("inheritance-not-recorded"));
}

}  // namespace cie::analysis
