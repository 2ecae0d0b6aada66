#include <cie/analysis/report_rows.hpp>

#include "simulator/comparison.hpp"

#include <algorithm>
#include <cmath>

namespace cie::sim {

void Comparison::compare_summary(const std::string& what, const Rare<Summary>& said,
                                 Numbers meant) {
  equal(what + " is measured", said.has_value(), !meant.empty());
  if (!said || meant.empty()) return;
  std::ranges::sort(meant);
  Ns sum = 0;
  for (const auto value : meant)
    sum += value;
  equal(what + " count", said->count, meant.size());
  equal(what + " min", said->min, meant.front());
  equal(what + " max", said->max, meant.back());
  equal(what + " sum", said->sum, sum);
  equal(what + " mean",
        std::abs(said->mean * static_cast<double>(meant.size()) - static_cast<double>(sum)) <=
            1e-6 * std::abs(double(sum)),
        true);
  const auto quantile = [&](const char* name, Ns value, std::size_t per_mille) {
    const auto rank = (meant.size() * per_mille + 999) / 1000;  // nearest rank
    const auto exact = meant[rank - 1];
    if (std::abs(value - exact) * 128 <= std::abs(exact)) return;
    equal(what + ' ' + name, value, exact);
  };
  quantile("p50", said->p50, 500);
  quantile("p90", said->p90, 900);
  quantile("p99", said->p99, 990);
  quantile("p99.9", said->p99_9, 999);
}

void Comparison::compare_callback(std::size_t index) {
  const auto& callback = system_.callbacks[index];
  const auto& meant = figures_[index];
  const auto pid = truth_.pids[static_cast<std::size_t>(callback.process)];
  const analysis::ReportRows rows(observed_.result.report);
  const auto& all = observed_.result.report.callbacks;
  const auto found = std::ranges::find_if(all, [&](const auto& c) {
    return c.logical_id == callback.id && rows.process_of(c).pid == pid;
  });
  if (found == all.end()) {
    found_.push_back(callback.id + " is not in the report");
    return;
  }
  const auto& said = *found;
  const auto name = callback.id + ' ';
  equal(name + "instances", said.instances, meant.complete);
  equal(name + "open", said.incomplete, meant.open);
  equal(name + "cut", said.cut, meant.cut);
  const bool is_timer = callback.kind == CallbackKind::timer;
  equal(name + "has missed releases", said.missed_releases.has_value(), is_timer);
  compare_queue(index, said.longest_queue);
  equal(name + "has exceptions", said.exceptions.has_value(), true);
  equal(name + "exceptions", said.exceptions.value_or(0), 0U);
  if (is_timer && is_whole()) equal(name + "missed", *said.missed_releases, meant.missed);
  std::map<std::int64_t, std::uint64_t> by_thread;
  for (const auto& thread : said.threads) {
    if (thread.instances != 0) by_thread[thread.tid] = thread.instances;
  }
  if (by_thread != meant.by_thread) found_.push_back(name + "ran on other threads");
  compare_summary(name + "duration", said.duration, meant.duration);
  compare_summary(name + "response time", said.response_time, meant.response);
  compare_summary(name + "start latency", said.start_latency, meant.latency);
  compare_summary(name + "inter-arrival", said.inter_arrival, meant.arrival);
  compare_summary(name + "execution", said.execution_time, meant.execution);
  compare_summary(name + "preempted", said.preempted, meant.preempted);
  compare_summary(name + "blocked", said.blocked, meant.blocked);
  compare_summary(name + "wake delay", said.wake_delay, meant.delay);
  if (!is_whole()) return;
  compare_summary(name + "lower bound", said.response_time_lower, meant.lower);
  compare_summary(name + "upper bound", said.response_time_upper, meant.upper);
  compare_summary(name + "wake-up latency", said.wakeup_latency, meant.wakeup);
  std::optional<ReleaseSource> source;
  for (const auto& [one, count] : meant.sources)
    source = source ? ReleaseSource::mixed : one;
  equal(name + "release source", said.release_source ? label(*said.release_source) : "none",
        source ? label(*source) : "none");
  std::map<std::int64_t, Ns> instead;
  for (const auto& preemptor : said.preempted_by)
    instead[preemptor.tid] = preemptor.time.ns;
  equal(name + "preempted by", text(instead), text(meant.instead));
}

void Comparison::compare_queue(std::size_t index, const std::optional<std::uint64_t>& said) {
  if (!is_whole()) return;
  const auto& callback = system_.callbacks[index];
  const bool is_told =
      callback.kind == CallbackKind::subscription &&
      std::ranges::any_of(truth_.arrivals, [](const auto& of) { return !of.empty(); });
  equal(callback.id + " has a queue", said.has_value(), is_told);
  if (!said) return;
  // A start in the nanosecond of an arrival may stand before or after it in the recording.
  std::uint64_t least = 0;
  std::uint64_t most = 0;
  for (const auto& arrival : truth_.arrivals[index]) {
    const auto starts = static_cast<std::uint64_t>(
        std::ranges::count_if(truth_.instances, [&](const InstanceTruth& instance) {
          return instance.callback == static_cast<int>(index) && instance.start == arrival.time;
        }));
    least = std::max(least, arrival.waiting - std::min(arrival.waiting, starts));
    most = std::max(most, arrival.waiting + starts);
  }
  equal(callback.id + " longest queue", std::clamp(*said, least, most), *said);
}

void Comparison::compare_threads() {
  const analysis::ReportRows rows(observed_.result.report);
  for (const auto& meant : truth_.threads) {
    const auto& all = observed_.result.report.threads;
    const auto said = std::ranges::find_if(all, [&](const auto& t) {
      return t.tid == meant.tid && rows.process_of(t).pid == meant.pid;
    });
    const auto name = "thread " + std::to_string(meant.tid) + ' ';
    equal(name + "is in the report", said != all.end(), true);
    if (said == all.end()) continue;
    equal(name + "name", said->name, meant.name);
    equal(name + "busy", said->busy_ns,
          recording_.has_kernel ? std::optional(meant.busy) : std::nullopt);
  }
}

void Comparison::compare_chains() {
  const auto meant = chains_of(system_, truth_);
  equal("chains", observed_.result.report.chains.size(), meant.size());
  for (const auto& chain : meant)
    compare_chain(chain);
}

void Comparison::compare_chain(const ChainTruth& chain) {
  std::vector<std::string> ids;
  for (const auto hop : chain.hops)
    ids.push_back(system_.callbacks[static_cast<std::size_t>(hop)].id);
  const auto name = "chain to " + ids.back() + ' ';
  const auto& all = observed_.result.report.chains;
  const auto said = std::ranges::find(all, ids, &analysis::ChainReport::hops);
  equal(name + "is in the report", said != all.end(), true);
  if (said == all.end()) return;
  equal(name + "instances", said->instances, chain.runs.size());
  Numbers latency;
  Numbers undivided;
  std::vector<Numbers> processing(ids.size());
  std::vector<Numbers> communication(ids.size() - 1);
  for (const auto& run : chain.runs) {
    if (!run.tells_release.front()) continue;
    Ns total = 0;
    Ns rest = 0;
    bool is_divided = true;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      const auto between = i == 0 ? 0 : run.communication[i - 1];
      total += between + run.processing[i];
      if (!run.tells_release[i]) {
        rest += between + run.processing[i];
        is_divided = false;
        continue;
      }
      processing[i].push_back(run.processing[i]);
      if (i > 0) communication[i - 1].push_back(between);
    }
    latency.push_back(total);
    if (!is_divided) undivided.push_back(rest);
  }
  compare_summary(name + "path latency", said->path_latency, latency);
  compare_summary(name + "undivided", said->undivided, undivided);
  equal(name + "hops", said->hop_table.size(), ids.size());
  for (std::size_t i = 0; i < said->hop_table.size(); ++i) {
    const auto& hop = said->hop_table[i];
    compare_summary(name + "processing", hop.processing, processing[i]);
    if (i + 1 < ids.size())
      compare_summary(name + "communication", hop.communication, communication[i]);
  }
  if (chain.is_overtaken) return;  // see README: then the definitions leave open which run is next
  compare_summary(name + "reaction time", said->reaction_time, chain.reaction_times());
  compare_summary(name + "data age", said->data_age, chain.data_ages());
}

}  // namespace cie::sim
