#include "host_gaps.hpp"

#include <cie/tracepoints/schema.hpp>

#include "base/text.hpp"
#include "clock_differences.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <string>

namespace cie::analysis {
namespace {

// Where something is traced there are packets of every period, and they may be under way as long.
constexpr Duration kSilence{3 * kClockSyncPeriod.count()};

// What sessions cover, by machine: the first begin, the begin of what follows the last gap, and the
// end of all.
struct Last {
  Timestamp first;
  Timestamp begin;
  Timestamp end;
};
using LastOfHosts = std::map<HostIndex, Last>;

LastOfHosts last_covered(const Model& model) {
  LastOfHosts all;
  for (const auto& stream : model.streams) {
    if (stream.domain != Domain::user || !stream.begin) continue;
    const Last last{
        .first = *stream.begin, .begin = *stream.begin, .end = stream.end.value_or(*stream.begin)};
    const auto [known, is_new] = all.try_emplace(stream.host, last);
    if (is_new) continue;
    known->second.first = std::min(known->second.first, last.first);
    known->second.begin = std::min(known->second.begin, last.begin);
    known->second.end = std::max(known->second.end, last.end);
  }
  for (const auto& gap : model.session_gaps) {
    const auto known = all.find(gap.host);
    if (known != all.end()) known->second.begin = std::max(known->second.begin, gap.to);
  }
  return all;
}

bool is_any_process(const Model& model, HostIndex host, auto matches) {
  return std::ranges::any_of(model.processes, [&](const ProcessFacts& process) {
    return process.host == host && process.has_cie_events && process.first_seen &&
           process.last_seen && matches(process);
  });
}

// The end of what other machines recorded that were recorded at the same time, on this one's clock. A
// recording that began later, as of the machine's next boot, tells nothing of how long this one lasted.
std::optional<Timestamp> end_of_others(const Model& model, const LastOfHosts& all, HostIndex host) {
  std::optional<Timestamp> end;
  for (const auto& [other, last] : all) {
    if (other == host) continue;
    const auto shift = clock_shift(model.hosts[at(other)], model.hosts[at(host)]);
    if (last.first + shift > all.at(host).end) continue;
    const auto here = last.end + shift;
    end = end ? std::max(*end, here) : here;
  }
  return end;
}

std::string in_seconds(Duration duration) {
  const auto ms = duration.ns / 1'000'000;
  const auto rest = std::to_string(1000 + ms % 1000).substr(1);
  return std::to_string(ms / 1000) + '.' + rest + " s";
}

// Of a machine's clock, since the recording's begin, or `first` where that has none.
class SinceBegin {
 public:
  SinceBegin(const Model& model, HostIndex host, Timestamp first)
      : shift_(clock_shift(model.hosts[at(host)], *reference_host(model))),
        begin_(model.begin.value_or(first + shift_)) {}
  std::string operator()(Timestamp time) const {
    return in_seconds(std::max(time + shift_ - begin_, Duration{}));
  }

 private:
  Duration shift_;
  Timestamp begin_;
};

}  // namespace

std::vector<HostGap> gaps_within_lives(const Model& model) {
  std::vector<HostGap> gaps;
  for (const auto& gap : model.session_gaps) {
    if (is_any_process(model, gap.host, [&](const ProcessFacts& process) {
          return process.first_seen->time <= gap.from && process.last_seen->time >= gap.to;
        })) {
      gaps.push_back(gap);
    }
  }
  return gaps;
}

std::vector<HostGap> host_gaps(const Model& model) {
  const auto all = last_covered(model);
  auto gaps = gaps_within_lives(model);
  for (const auto& [host, last] : all) {
    const auto end = end_of_others(model, all, host);
    if (!end || *end - last.end < kSilence) continue;
    if (is_any_process(model, host, [begin = last.begin](const ProcessFacts& process) {
          return !process.run_end && process.last_seen->time >= begin;
        })) {
      gaps.push_back({.host = host, .from = last.end, .to = *end});
    }
  }
  if (model.recording_begin) {  // a window was asked for
    std::erase_if(gaps, [&model](const HostGap& gap) {
      const auto shift = clock_shift(model.hosts[at(gap.host)], *reference_host(model));
      return (model.begin && gap.to + shift <= *model.begin) ||
             (model.end && gap.from + shift >= *model.end);
    });
  }
  std::ranges::stable_sort(gaps, {}, &HostGap::host);
  return gaps;
}

std::string in_words(const HostGap& gap, const Model& model) {
  const auto& host = model.hosts[at(gap.host)];
  const SinceBegin since_begin(model, gap.host, gap.from);
  if (gap.is_before_runs) {
    return "runs on " + host.name + " were recorded from " + since_begin(gap.to) +
           " after the recording's begin on; before, until " + since_begin(gap.from) +
           ", what its applications made, and nothing in between";
  }
  return "nothing is known of " + host.name + " from " + since_begin(gap.from) + " to " +
         since_begin(gap.to) +
         " after the recording's begin, though its processes had not ended: it was cut off or "
         "switched off, or the recorder began anew";
}

std::string in_words(const RunsBetweenSessions& runs, const Model& model) {
  const SinceBegin since_begin(model, runs.host, runs.begin);
  return counted(runs.count, "instance") + " on " + model.hosts[at(runs.host)].name + ", from " +
         since_begin(runs.begin) + " to " + since_begin(runs.end) +
         " after the recording's begin: in the window of neither of two sessions, and without "
         "numbers that would prove that no other is missing; not counted";
}

}  // namespace cie::analysis
