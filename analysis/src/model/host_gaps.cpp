#include "host_gaps.hpp"

#include "host_clocks.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <string>

namespace cie::analysis {
namespace {

// Packets come at least every second where something is traced, and may be under way as long.
constexpr Duration kSilence{3'000'000'000};

struct Span {
  Timestamp begin;
  Timestamp end;
};
using Spans = std::map<HostIndex, std::vector<Span>>;

// What the packets of user-space channels cover, by machine: disjoint, in order.
Spans covered(const Model& model) {
  std::map<std::pair<HostIndex, std::uint32_t>, Span> channels;
  for (const auto& stream : model.streams) {
    if (stream.domain != Domain::user || !stream.begin) continue;
    const Span span{*stream.begin, stream.end.value_or(*stream.begin)};
    const auto [known, is_new] = channels.try_emplace({stream.host, stream.channel}, span);
    if (is_new) continue;
    known->second.begin = std::min(known->second.begin, span.begin);
    known->second.end = std::max(known->second.end, span.end);
  }
  Spans all;
  for (const auto& [key, span] : channels)
    all[key.first].push_back(span);
  for (auto& [host, spans] : all) {
    std::ranges::sort(spans, {}, &Span::begin);
    std::vector<Span> disjoint;
    for (const auto& span : spans) {
      if (disjoint.empty() || span.begin > disjoint.back().end) {
        disjoint.push_back(span);
      } else {
        disjoint.back().end = std::max(disjoint.back().end, span.end);
      }
    }
    spans = std::move(disjoint);
  }
  return all;
}

bool is_any_process(const Model& model, HostIndex host, auto matches) {
  return std::ranges::any_of(model.processes, [&](const ProcessFacts& process) {
    return process.host == host && process.has_cie_events && process.first_seen &&
           process.last_seen && matches(process);
  });
}

// The end of what all other machines recorded, on this one's clock.
std::optional<Timestamp> end_of_others(const Model& model, const Spans& all, HostIndex host) {
  std::optional<Timestamp> end;
  for (const auto& [other, spans] : all) {
    if (other == host) continue;
    const auto shift = clock_shift(model.hosts[at(other)], model.hosts[at(host)]);
    const auto here = spans.back().end + shift;
    end = end ? std::max(*end, here) : here;
  }
  return end;
}

std::string in_seconds(Duration duration) {
  const auto ms = duration.ns / 1'000'000;
  const auto rest = std::to_string(1000 + ms % 1000).substr(1);
  return std::to_string(ms / 1000) + '.' + rest + " s";
}

}  // namespace

std::vector<HostGap> host_gaps(const Model& model) {
  const auto all = covered(model);
  std::vector<HostGap> gaps;
  for (const auto& [host, spans] : all) {
    for (std::size_t i = 0; i + 1 < spans.size(); ++i) {
      const auto from = spans[i].end;
      const auto to = spans[i + 1].begin;
      if (is_any_process(model, host, [&](const ProcessFacts& process) {
            return process.first_seen->time <= from && process.last_seen->time >= to;
          })) {
        gaps.push_back({.host = host, .from = from, .to = to});
      }
    }
    const auto began = spans.back().begin;
    const auto last = spans.back().end;
    const auto end = end_of_others(model, all, host);
    if (!end || *end - last < kSilence) continue;
    if (is_any_process(model, host, [&](const ProcessFacts& process) {
          return !process.run_end && process.last_seen->time >= began;
        })) {
      gaps.push_back({.host = host, .from = last, .to = *end});
    }
  }
  return gaps;
}

std::string in_words(const HostGap& gap, const Model& model) {
  const auto& host = model.hosts[at(gap.host)];
  const auto shift = clock_shift(host, *reference_host(model));
  const auto begin = model.begin.value_or(gap.from + shift);
  const auto since_begin = [&](Timestamp time) {
    return in_seconds(std::max(time + shift - begin, Duration{}));
  };
  return "nothing is known of " + host.name + " from " + since_begin(gap.from) + " to " +
         since_begin(gap.to) +
         " after the recording's begin, though its processes had not ended: it was cut off or "
         "switched off, or the recorder began anew";
}

}  // namespace cie::analysis
