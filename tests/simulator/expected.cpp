#include "simulator/expected.hpp"

#include "simulator/application.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <sstream>
#include <tuple>

namespace cie::sim {
namespace {

using analysis::InstanceState;
using analysis::ReleaseSource;
using analysis::Summary;
using Numbers = std::vector<Ns>;

template <typename Value>
std::string text(const std::optional<Value>& value) {
  return value ? std::to_string(*value) : "none";
}
std::string text(const std::map<std::int64_t, Ns>& by_tid) {
  std::string all;
  for (const auto& [tid, time] : by_tid)
    all += std::to_string(tid) + ": " + std::to_string(time) + ' ';
  return all;
}
std::optional<Ns> number(const std::optional<analysis::Timestamp>& time) {
  return time ? std::optional(time->ns) : std::nullopt;
}
std::optional<Ns> number(const std::optional<analysis::Duration>& time) {
  return time ? std::optional(time->ns) : std::nullopt;
}

class Comparison {
 public:
  Comparison(const System& system, const Simulation& simulation, const Recording& recording,
             const Observed& observed)
      : system_(system),
        truth_(simulation.truth),
        recording_(recording),
        observed_(observed),
        last_(simulation.tape.end() + 1) {}

  std::vector<std::string> run() {
    for (std::size_t i = 0; i < observed_.rows.size(); ++i) {
      const auto& row = observed_.rows[i];
      rows_[{row.instance.pid, row.logical_id, row.instance.seq}] = i;
    }
    figures_.resize(system_.callbacks.size());
    std::size_t seen = 0;
    for (const auto& instance : truth_.instances) {
      if (compare_instance(instance)) ++seen;
    }
    equal("rows of instances", observed_.rows.size(), seen);
    for (std::size_t i = 0; i < figures_.size(); ++i)
      compare_callback(i);
    if (is_whole()) {
      compare_threads();
      compare_chains();
    }
    return std::move(found_);
  }

 private:
  // What the report must say of a callback.
  struct Figures {
    std::uint64_t complete = 0;
    std::uint64_t open = 0;
    std::uint64_t missed = 0;
    std::map<std::int64_t, std::uint64_t> by_thread;
    std::map<ReleaseSource, std::uint64_t> sources;
    Numbers response, lower, upper, latency, duration, arrival;
    Numbers execution, preempted, blocked, delay, wakeup;
    std::map<std::int64_t, Ns> instead;
    std::optional<std::pair<std::uint64_t, Ns>> last;  // seq and release
  };
  // An instance as the recording shows it.
  struct Shown {
    InstanceState state = InstanceState::complete;
    bool has_parts = false;
    ReleaseSource source = ReleaseSource::exact;
    Ns release = 0;
    std::optional<Ns> waking;
    std::optional<Ns> first_in;
    std::optional<Ns> upper;  // bound of the response time
  };

  template <typename A, typename B>
  void equal(const std::string& what, const A& said, const B& meant) {
    if (said == meant) return;
    std::ostringstream out;
    out << what << ": said " << said << ", is " << meant;
    found_.push_back(out.str());
  }
  void equal(const std::string& what, const std::optional<Ns>& said,
             const std::optional<Ns>& meant) {
    if (said != meant) found_.push_back(what + ": said " + text(said) + ", is " + text(meant));
  }

  bool is_whole() const { return recording_.user_begin.empty() && recording_.user_end.empty(); }
  Ns begin_of(std::int32_t cpu) const {
    return recording_.user_begin.empty() ? 0 : recording_.user_begin[static_cast<std::size_t>(cpu)];
  }
  Ns end_of(std::int32_t cpu) const {
    return recording_.user_end.empty() ? last_ : recording_.user_end[static_cast<std::size_t>(cpu)];
  }
  Ns window_begin() const {
    return recording_.user_begin.empty() ? 0 : std::ranges::max(recording_.user_begin);
  }
  Ns window_end() const {
    return recording_.user_end.empty() ? last_ : std::ranges::min(recording_.user_end);
  }
  Ns kernel_end() const { return recording_.kernel_end != 0 ? recording_.kernel_end : last_; }
  bool is_recorded(Ns time, std::int32_t cpu) const {
    return time >= begin_of(cpu) && time <= end_of(cpu);
  }
  bool is_end_recorded(const InstanceTruth& instance) const {
    return instance.end && is_recorded(*instance.end, instance.cpu_end);
  }

  std::optional<Shown> shown(const InstanceTruth& instance) const;
  bool compare_instance(const InstanceTruth& instance);
  void compare_row(const InstanceTruth& instance, const Shown& shown, const Observed::Row& row);
  void add(const InstanceTruth& instance, const Shown& shown);
  void compare_callback(std::size_t index);
  void compare_summary(const std::string& what, const std::optional<Summary>& said, Numbers meant);
  void compare_threads();
  void compare_chains();
  void compare_chain(const ChainTruth& chain);

  const System& system_;
  const Truth& truth_;
  const Recording& recording_;
  const Observed& observed_;
  Ns last_;
  std::map<std::tuple<std::int64_t, std::string, std::uint64_t>, std::size_t> rows_;
  std::vector<Figures> figures_;
  std::set<std::size_t> unended_;  // threads with an instance whose end was not recorded
  std::vector<std::string> found_;
};

std::optional<Comparison::Shown> Comparison::shown(const InstanceTruth& instance) const {
  if (!is_recorded(instance.start, instance.cpu_start)) return std::nullopt;
  Shown shown;
  if (!is_end_recorded(instance)) {
    if (instance.start > window_end()) return std::nullopt;
    shown.state = InstanceState::open;
  } else if (*instance.end < window_begin() || instance.start > window_end()) {
    return std::nullopt;
  } else if (instance.start < window_begin() || *instance.end > window_end()) {
    shown.state = InstanceState::cut_by_window;
  }
  shown.has_parts = recording_.has_kernel && shown.state != InstanceState::open &&
                    instance.start >= recording_.kernel_begin && *instance.end <= kernel_end();
  const auto& wake = instance.kernel_wakeup;
  if (recording_.has_kernel) {
    shown.waking = recording_.has_wakings ? wake.waking : wake.wakeup;
    shown.first_in = recording_.has_wakings ? wake.first_in : wake.first_in_runnable;
    if (shown.waking && *shown.waking < recording_.kernel_begin) shown.waking.reset();
  }
  const auto& callback = system_.callbacks[static_cast<std::size_t>(instance.callback)];
  const auto& thread = truth_.threads[instance.thread];
  const bool is_isolated = thread.name.starts_with("cb");
  const auto* message =
      instance.message && callback.tells_source ? &truth_.messages[*instance.message] : nullptr;
  shown.release = instance.release;
  if (!callback.tells_release) {
    const auto woken = shown.waking ? shown.waking : instance.wakeup;
    if (is_isolated && woken) {
      shown.source = ReleaseSource::wakeup;
      shown.release = *woken;
    } else if (message != nullptr) {
      shown.source = ReleaseSource::source_timestamp;
      shown.release = message->stamp - kRealtimeOffset;
    } else {
      shown.source = ReleaseSource::start;
      shown.release = instance.start;
    }
    if (message != nullptr && instance.end) {
      shown.upper = *instance.end - (message->stamp - kRealtimeOffset);
    }
  }
  return shown;
}

bool Comparison::compare_instance(const InstanceTruth& instance) {
  const auto shown = this->shown(instance);
  const auto& thread = truth_.threads[instance.thread];
  const auto& callback = system_.callbacks[static_cast<std::size_t>(instance.callback)];
  const auto row = rows_.find({thread.pid, callback.id, instance.seq});
  const auto name = callback.id + " seq " + std::to_string(instance.seq);
  equal(name + " is listed", row != rows_.end(), shown.has_value());
  if (!shown) return false;
  if (row != rows_.end()) compare_row(instance, *shown, observed_.rows[row->second]);
  add(instance, *shown);
  if (!is_end_recorded(instance)) unended_.insert(instance.thread);
  return true;
}

void Comparison::compare_row(const InstanceTruth& instance, const Shown& shown,
                             const Observed::Row& row) {
  const auto& said = row.instance;
  const auto name = row.logical_id + " seq " + std::to_string(said.seq) + ' ';
  equal(name + "state", static_cast<int>(said.state), static_cast<int>(shown.state));
  equal(name + "tid", said.tid, truth_.threads[instance.thread].tid);
  equal(name + "start", said.start.ns, instance.start);
  const bool has_end = shown.state != InstanceState::open;
  equal(name + "end", number(said.end), has_end ? instance.end : std::nullopt);
  equal(name + "missed", said.missed, instance.missed);
  equal(name + "cpu at start", said.cpu_start.value_or(-1), instance.cpu_start);
  if (has_end) equal(name + "cpu at end", said.cpu_end.value_or(-1), instance.cpu_end);
  // What woke a thread is known if the end of its instance before is.
  const bool is_wake_known =
      is_whole() || (instance.previous && is_end_recorded(truth_.instances[*instance.previous]) &&
                     *truth_.instances[*instance.previous].end >= recording_.kernel_begin &&
                     instance.start <= kernel_end());
  if (is_wake_known) {
    equal(name + "wakeup", number(said.wakeup), instance.wakeup);
    equal(name + "waking", number(said.waking), shown.waking);
    equal(name + "release source", label(said.release_source), label(shown.source));
    equal(name + "release", number(said.release), std::optional(shown.release));
  }
  std::optional<Ns> execution, preempted, blocked, delay;
  if (shown.has_parts) {
    const auto& parts = instance.parts;
    const auto unseen = recording_.has_wakings ? 0 : parts.waking;
    execution = parts.execution;
    preempted = parts.preempted;
    blocked = parts.blocked + unseen;
    delay = parts.wake_delay - unseen;
    std::map<std::int64_t, Ns> instead;
    for (const auto& preemptor : row.preempted_by)
      instead[preemptor.tid] += preemptor.time.ns;
    // After an instance whose end was not recorded, later ones of its thread may lie inside it.
    if (!unended_.contains(instance.thread)) {
      equal(name + "preempted by", text(instead), text(parts.instead));
    }
  }
  equal(name + "execution", number(said.execution), execution);
  equal(name + "preempted", number(said.preempted), preempted);
  equal(name + "blocked", number(said.blocked), blocked);
  equal(name + "wake delay", number(said.wake_delay), delay);
}

void Comparison::add(const InstanceTruth& instance, const Shown& shown) {
  auto& figures = figures_[static_cast<std::size_t>(instance.callback)];
  figures.missed += instance.missed;
  if (shown.state == InstanceState::open) ++figures.open;
  if (shown.state != InstanceState::complete) return;
  ++figures.complete;
  ++figures.by_thread[truth_.threads[instance.thread].tid];
  ++figures.sources[shown.source];
  const auto end = *instance.end;
  figures.duration.push_back(end - instance.start);
  if (shown.source == ReleaseSource::exact) {
    figures.response.push_back(end - instance.release);
    figures.latency.push_back(instance.start - instance.release);
    if (figures.last && figures.last->first + 1 == instance.seq) {
      figures.arrival.push_back(instance.release - figures.last->second);
    }
    figures.last = {instance.seq, instance.release};
  } else {
    figures.lower.push_back(
        end - (shown.source == ReleaseSource::wakeup ? shown.release : instance.start));
    if (shown.upper) figures.upper.push_back(*shown.upper);
  }
  if (shown.has_parts) {
    const auto unseen = recording_.has_wakings ? 0 : instance.parts.waking;
    figures.execution.push_back(instance.parts.execution);
    figures.preempted.push_back(instance.parts.preempted);
    figures.blocked.push_back(instance.parts.blocked + unseen);
    figures.delay.push_back(instance.parts.wake_delay - unseen);
    for (const auto& [tid, time] : instance.parts.instead)
      figures.instead[tid] += time;
  }
  if (shown.waking && shown.first_in) figures.wakeup.push_back(*shown.first_in - *shown.waking);
}

void Comparison::compare_summary(const std::string& what, const std::optional<Summary>& said,
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
  const auto& all = observed_.result.report.callbacks;
  const auto found = std::ranges::find_if(
      all, [&](const auto& c) { return c.logical_id == callback.id && c.pid == pid; });
  if (found == all.end()) {
    found_.push_back(callback.id + " is not in the report");
    return;
  }
  const auto& said = *found;
  const auto name = callback.id + ' ';
  equal(name + "instances", said.instances, meant.complete);
  equal(name + "open", said.incomplete, meant.open);
  const bool is_timer = callback.kind == CallbackKind::timer;
  equal(name + "has missed releases", said.missed_releases.has_value(), is_timer);
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

void Comparison::compare_threads() {
  for (const auto& meant : truth_.threads) {
    const auto& all = observed_.result.report.threads;
    const auto said = std::ranges::find_if(
        all, [&](const auto& t) { return t.tid == meant.tid && t.pid == meant.pid; });
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
  std::vector<Numbers> processing(ids.size());
  std::vector<Numbers> communication(ids.size() - 1);
  for (const auto& run : chain.runs) {
    if (!run.is_exact) continue;
    Ns total = 0;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      processing[i].push_back(run.processing[i]);
      total += run.processing[i];
      if (i + 1 == ids.size()) break;
      communication[i].push_back(run.communication[i]);
      total += run.communication[i];
    }
    latency.push_back(total);
  }
  compare_summary(name + "path latency", said->path_latency, latency);
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

}  // namespace

void Observed::on_instance(const analysis::Instance& instance) {
  rows.push_back({.instance = instance,
                  .logical_id = std::string(instance.logical_id),
                  .preempted_by = {instance.preempted_by.begin(), instance.preempted_by.end()}});
}

void analyze(const test::TextTrace& trace, const analysis::AnalysisOptions& options,
             Observed& observed) {
  observed.result = test::analyze(trace, options, &observed);
}

std::vector<std::string> differences(const System& system, const Simulation& simulation,
                                     const Recording& recording, const Observed& observed) {
  return Comparison(system, simulation, recording, observed).run();
}

}  // namespace cie::sim
