#include "proof.hpp"

#include "judgement.hpp"
#include "model/callback_questions.hpp"
#include "model/recorded_parts.hpp"

#include <algorithm>
#include <limits>
#include <string>
#include <tuple>
#include <utility>

namespace cie::analysis {
namespace {

std::string counted_and_seen(std::uint64_t expected, std::uint64_t seen) {
  return std::to_string(expected) + " counted, " + std::to_string(seen) + " seen";
}

std::optional<Evidence> gap_of(const SequenceFacts& numbers, const char* event,
                               const char* number) {
  if (numbers.first_gap) {
    const auto& gap = *numbers.first_gap;
    return evidence(event, gap.after,
                    std::string(number) + " jumps: " + std::to_string(gap.expected) +
                        " was next and " + std::to_string(gap.seen) + " came; " +
                        std::to_string(numbers.missing) + " missing in all");
  }
  if (numbers.missing != 0) {
    return evidence(event, numbers.last_at,
                    counted(numbers.missing, "number") + " of " + number +
                        (numbers.missing == 1 ? " is" : " are") + " missing");
  }
  if (numbers.repeated != 0) {
    return evidence(event, numbers.last_at,
                    std::string(number) + " does not rise: " + counted(numbers.repeated, "number") +
                        " came twice");
  }
  return std::nullopt;
}

// What a subject's totals count from: the number its first registration promised, or the first one
// seen where the registration is an announcement that came later.
std::uint64_t first_number(const SequenceFacts& numbers, const std::optional<EventRef>& registered,
                           std::uint64_t promised) {
  if (!registered) return numbers.first.value_or(promised);
  return std::min(numbers.first.value_or(promised), promised);
}

// Instances that were seen to start and not to end.
std::uint64_t open_instances(const CallbackFacts& facts) {
  const auto unpaired = facts.ends_before_first + facts.second_ends + facts.ends_without_start;
  const auto paired = facts.ended.count - std::min(facts.ended.count, unpaired);
  return facts.starts.count - std::min(facts.starts.count, paired);
}

// Instances that never end are told by started - ended.
std::uint64_t unended(const CallbackTotals& totals) {
  return totals.started - std::min(totals.started, totals.ended);
}

// More instances are open than never ended. Of one that ended twice the first end may be the lost
// one; it counts.
bool tells_lost_end(const CallbackFacts& facts, const CallbackTotals& totals) {
  const auto first = first_number(facts.starts, facts.registered, facts.first_next_seq);
  return open_instances(facts) > unended(totals) ||
         (first == 0 && facts.ended.count < totals.ended);
}

// An end whose start was not seen, although it would be in the record.
std::optional<Evidence> lost_start(const CallbackFacts& facts) {
  if (facts.first_end_without_start) {
    const auto& [seq, where] = *facts.first_end_without_start;
    return evidence("callback_end", where,
                    "seq " + std::to_string(seq) + " ends, whose start was not seen");
  }
  // A number promised to the next start cannot end before that start.
  if (facts.registered && !facts.starts.first && facts.ended.last &&
      *facts.ended.last >= facts.first_next_seq) {
    return evidence("callback_end", facts.ended.last_at,
                    "seq " + std::to_string(*facts.ended.last) + " ends, whose start was not seen");
  }
  return std::nullopt;
}

template <typename Index>
const std::optional<Evidence>& found_loss(const std::map<Index, std::optional<Evidence>>& losses,
                                          Index index) {
  static const std::optional<Evidence> nothing;
  const auto found = losses.find(index);
  return found == losses.end() ? nothing : found->second;
}

}  // namespace

Proof::Proof(const Model& model, const ThreadLives& lives, const KernelHoles& holes,
             const TimeWindow& judged)
    : model_(model),
      lives_(lives),
      judged_(judged),
      holes_(holes),
      user_losses_(model),
      missing_user_part_(analysis::missing_user_part(model)),
      processes_(model.processes.size()) {
  for (const auto& callback : model.callbacks) {
    const auto host = model.processes[at(callback.process)].host;
    if (callback.first_release) with_releases_.insert(host);
    if (callback.lost_at) with_lost_samples_.insert(host);
  }
  for (std::size_t i = 0; i < model.callbacks.size(); ++i) {
    prove(CallbackIndex{static_cast<std::uint32_t>(i)});
  }
  for (const auto& publisher : model.publishers)
    prove(publisher);
  for (std::size_t i = 0; i < model.threads.size(); ++i) {
    prove(ThreadIndex{static_cast<std::uint32_t>(i)});
  }
  for (std::size_t i = 0; i < model.threads.size(); ++i) {
    prove_spins(ThreadIndex{static_cast<std::uint32_t>(i)});
  }
  for (const auto& group : model.groups) {
    if (group.type) ++processes_[at(group.process)].groups_known;
  }
  for (std::size_t i = 0; i < model.processes.size(); ++i) {
    prove(ProcessIndex{static_cast<std::uint32_t>(i)});
  }
}

bool Proof::is_interrupted(ProcessIndex process) const {
  return !model_.processes[at(process)].run_end;
}

bool Proof::has_begun_in_trace(ProcessIndex process) const {
  return model_.processes[at(process)].first_moment == RunMoment::start;
}

const std::vector<Evidence>& Proof::disagreements(ProcessIndex process) const {
  return processes_[at(process)].disagreements;
}

std::uint64_t Proof::totals_compared(ProcessIndex process) const {
  return processes_[at(process)].compared;
}

bool Proof::is_complete(ProcessIndex process) const {
  const auto& facts = model_.processes[at(process)];
  return facts.run_begin && facts.run_end && processes_[at(process)].disagreements.empty();
}

std::optional<Evidence> Proof::incompleteness(ProcessIndex process) const {
  const auto& facts = model_.processes[at(process)];
  if (!has_begun_here(facts)) {
    const std::string begin = facts.is_told_by_ros2 ? "rcl_init" : "run_begin";
    return without_event(facts.first_seen.value_or(EventRef{}),
                         "no " + begin + ": what came before is unknown");
  }
  if (!facts.run_end) {
    return without_event(facts.last_seen.value_or(EventRef{}),
                         facts.is_told_by_ros2
                             ? "ROS 2's events count nothing: what is missing is unknown"
                             : "no run_end: what came after the last event is unknown");
  }
  const auto& problems = processes_[at(process)].disagreements;
  return problems.empty() ? std::nullopt : std::optional(problems.front());
}

const std::optional<Evidence>& Proof::loss(CallbackIndex callback) const {
  const auto& lost = lost_runs(callback);
  return lost ? lost : found_loss(untold_ends_, callback);
}

const std::optional<Evidence>& Proof::lost_runs(CallbackIndex callback) const {
  return found_loss(callbacks_, callback);
}

const std::optional<Evidence>& Proof::loss(ThreadIndex thread) const {
  const auto& loss = found_loss(threads_, thread);
  return loss ? loss : found_loss(spins_, thread);
}

std::optional<Evidence> Proof::gap(const CallbackFacts& callback) const {
  if (auto gap = gap_of(callback.starts, "callback_start", "seq")) return gap;
  const auto first = first_number(callback.starts, callback.registered, callback.first_next_seq);
  const bool is_every_start_seen =
      callback.fini && callback.fini->started == first + callback.starts.count;
  if (!is_every_start_seen) {
    if (auto lost = lost_start(callback)) return lost;
  }
  return is_any_end_lost(callback) ? gap_of(callback.ended, "callback_end", "seq") : std::nullopt;
}

bool Proof::is_any_end_lost(const CallbackFacts& callback) const {
  if (callback.ended.missing == 0) return false;
  if (callback.fini) return tells_lost_end(callback, *callback.fini);
  return std::ranges::any_of(
      callback.open, [&](const OpenInstance& open) { return lives_.is_end_lost(callback, open); });
}

std::optional<Evidence> Proof::gap(const PublisherFacts& publisher) const {
  return gap_of(publisher.published, "publish", "seq");
}

std::optional<Evidence> Proof::gap(const ThreadFacts& thread) const {
  const auto& numbers = thread.read_backs;
  if (auto gap = gap_of(numbers, "thread_sched", "n")) return gap;
  if (thread.announced && has_begun_in_trace(thread.process) && numbers.first.value_or(0) > 0) {
    return evidence("thread_sched", numbers.first_at,
                    "n begins at " + std::to_string(*numbers.first) + ", not at 0");
  }
  return std::nullopt;
}

std::optional<Evidence> Proof::kernel_loss(ThreadIndex thread) const {
  const auto& life = lives_.of(thread);
  return holes_.between(host_of(thread), std::max(life.begin, judged_.from),
                        std::min(life.end, judged_.to));
}

std::optional<Evidence> Proof::kernel_outside(ThreadIndex thread, Timestamp begin) const {
  return holes_.outside(host_of(thread), std::max(begin, judged_.from),
                        std::min(lives_.of(thread).end, judged_.to));
}

std::optional<Evidence> Proof::untold_inheritance(ThreadIndex thread, Timestamp begin,
                                                  Timestamp end) const {
  return holes_.untold_inheritance(host_of(thread), begin, end);
}

HostIndex Proof::host_of(ThreadIndex thread) const {
  return model_.processes[at(model_.threads[at(thread)].process)].host;
}

std::optional<Evidence> Proof::unseen(ProcessIndex process, std::uint32_t RunTotals::*total,
                                      std::uint64_t seen, const char* what) const {
  const auto& run_end = model_.processes[at(process)].run_end;
  if (!run_end || !has_begun_in_trace(process) || seen >= (*run_end).*total) return std::nullopt;
  return evidence("run_end", run_end->at,
                  std::string(what) + counted_and_seen((*run_end).*total, seen));
}

std::optional<Evidence> Proof::unseen_or_lost(ProcessIndex process, std::uint32_t RunTotals::*total,
                                              std::uint64_t seen, const char* what,
                                              const char* uncounted) const {
  const auto& facts = model_.processes[at(process)];
  if (facts.run_end && has_begun_in_trace(process)) return unseen(process, total, seen, what);
  auto loss = user_loss_since(process, facts.first_seen ? facts.first_seen->time : Timestamp{});
  if (loss) loss->note += uncounted;
  return loss;
}

std::optional<Evidence> Proof::unseen_callbacks(ProcessIndex process) const {
  return unseen_or_lost(process, &RunTotals::callbacks, processes_[at(process)].callbacks_named,
                        "callbacks that ran somewhere unseen: ",
                        "; nothing counts the callbacks: one may have been lost whole");
}

std::optional<Evidence> Proof::unseen_threads(ProcessIndex process) const {
  if (is_told_by_ros2_alone(model_.processes[at(process)])) return std::nullopt;
  return unseen_or_lost(process, &RunTotals::threads, threads_announced(process),
                        "threads whose announcement was not seen: ",
                        "; nothing counts the threads: the announcement of one may be lost");
}

std::optional<Evidence> Proof::unseen_announcement(ProcessIndex process) const {
  const auto& facts = model_.processes[at(process)];
  if (missing_user_part_) {
    return without_event(facts.first_seen.value_or(EventRef{}), *missing_user_part_);
  }
  if (auto unseen = processes_[at(process)].first_unannounced) {
    unseen->note += ": other announcements may be missing, too";
    return unseen;
  }
  return unseen(process, &RunTotals::threads, threads_announced(process),
                "threads whose announcement was not seen: ");
}

std::optional<Evidence> Proof::unseen_publishers(ProcessIndex process) const {
  return unseen(process, &RunTotals::publishers, processes_[at(process)].publishers_registered,
                "publishers whose messages were not seen: ");
}

template <std::invocable Total>
void Proof::compare(ProcessIndex process, const Total& total, std::uint64_t expected,
                    std::uint64_t seen) {
  auto& proof = processes_[at(process)];
  ++proof.compared;
  if (expected == seen) return;
  proof.disagreements.push_back(total());
  proof.disagreements.back().note += ": " + counted_and_seen(expected, seen);
}

std::optional<Evidence> Proof::user_loss_since(ProcessIndex process, Timestamp time) const {
  return user_loss(process, time, Timestamp{std::numeric_limits<std::int64_t>::max()});
}

std::optional<Evidence> Proof::user_loss(ProcessIndex process, Timestamp begin,
                                         Timestamp end) const {
  const auto* loss = user_losses_.between(model_.processes[at(process)].host, begin, end);
  return loss != nullptr ? std::optional(evidence_of(*loss)) : std::nullopt;
}

std::optional<Evidence> Proof::untold_loss(ProcessIndex process, Timestamp last) const {
  return is_interrupted(process) ? user_loss_since(process, last) : std::nullopt;
}

std::optional<Evidence> Proof::untold_loss_of_state(ProcessIndex process, Timestamp last) const {
  if (auto loss = untold_loss(process, last)) return loss;
  if (!is_interrupted(process)) return std::nullopt;
  const auto* before = loss_before(model_, model_.processes[at(process)].host, Domain::user, last);
  return before != nullptr ? std::optional(evidence_of(*before)) : std::nullopt;
}

// Without totals, a start or end that stands alone tells that its partner was lost, unless the
// record's end cut it.
std::optional<Evidence> Proof::lost_partner(const CallbackFacts& facts) const {
  if (auto lost = lost_start(facts)) return lost;
  const auto open = std::ranges::find_if(facts.open, [this](const OpenInstance& instance) {
    return !instance.is_left && !lives_.is_cut_by_end(instance);
  });
  if (open == facts.open.end()) return std::nullopt;
  return evidence("callback_start", open->start,
                  "seq " + std::to_string(open->seq) + " starts, whose end was not seen");
}

void Proof::prove(CallbackIndex index) {
  const auto& facts = model_.callbacks[at(index)];
  auto& process = processes_[at(facts.process)];
  std::optional<Evidence> loss;
  ++process.callbacks_named;
  if (facts.registered) ++process.callbacks_registered;

  loss = gap_of(facts.starts, "callback_start", "seq");
  if (!loss && !facts.registered) {
    loss = without_event(first_sign(model_, facts), "the callback's registration was not seen");
  }
  const auto first = first_number(facts.starts, facts.registered, facts.first_next_seq);
  const auto& name = facts.logical_id;
  if (facts.fini) {
    const auto total = [&](const char* what) {
      return evidence("callback_fini", facts.fini->at, name + " " + what);
    };
    const auto started = first + facts.starts.count;
    const auto compare_total = [&](const char* what, std::uint64_t expected, std::uint64_t seen) {
      compare(
          facts.process, [&] { return total(what); }, expected, seen);
    };
    compare_total("started", facts.fini->started, started);
    if (!loss && facts.fini->started != started) {
      loss = total("started: ");
      loss->note += counted_and_seen(facts.fini->started, started);
    }
    // Instances that never end are told by started - ended; more that are open lost their end.
    const auto open = open_instances(facts);
    const bool is_end_lost = tells_lost_end(facts, *facts.fini);
    const bool is_surplus = first == 0 && open < unended(*facts.fini);
    compare_total("ended", facts.fini->ended,
                  is_end_lost || is_surplus ? started - open : facts.fini->ended);
    if (!loss && is_end_lost) {
      loss = total("ended: ");
      loss->note += counted_and_seen(facts.fini->ended, started - open);
    }
    // A recording may leave a class out, and that of another machine not.
    const auto host = model_.processes[at(facts.process)].host;
    const auto compare_running = [&](const char* what, const std::set<HostIndex>& recorded_on,
                                     std::uint64_t total_count, std::uint64_t seen) {
      if (!has_begun_in_trace(facts.process) || !recorded_on.contains(host)) return;
      compare_total(what, total_count, seen);
      if (loss || total_count == seen) return;
      loss = total(what);
      loss->note += ": " + counted_and_seen(total_count, seen);
    };
    compare_running("released", with_releases_, facts.fini->released, facts.releases);
    compare_running("lost", with_lost_samples_, facts.fini->lost, facts.lost);
  } else if (!is_interrupted(facts.process)) {
    const auto missing = without_event(
        facts.starts.last_at, name + " has no callback_fini: its last instances are unknown");
    if (facts.registered) {
      process.disagreements.push_back(missing);
      process.disagreements.back().time = model_.processes[at(facts.process)].run_end->at.time;
    }
    if (!loss) loss = missing;
  } else if (!loss) {
    loss = lost_partner(facts);
    auto last = facts.registered ? facts.registered->time : Timestamp{};
    if (facts.starts.last) last = std::max(last, facts.starts.last_at.time);
    if (facts.ended.last) last = std::max(last, facts.ended.last_at.time);
    // Without numbers any loss, whenever it was, may have been one of its events.
    if (!facts.is_accounted) last = Timestamp{std::numeric_limits<std::int64_t>::min()};
    if (!loss) loss = untold_loss(facts.process, last);
    if (!loss && facts.own) {
      loss = evidence("callback_start", facts.own->others_since,
                      "from here on an instance " + std::string(kPerhapsAnothers));
    }
  }
  if (!loss) {
    const auto left = std::ranges::find(facts.open, true, &OpenInstance::is_left);
    if (left != facts.open.end()) untold_ends_.emplace(index, exception_in(*left));
    return;
  }
  is_anything_lost_ = true;
  callbacks_.emplace(index, std::move(loss));
}

std::optional<Evidence> Proof::loss(const PublisherFacts& publisher) const {
  if (auto hole = gap(publisher)) return hole;
  if (!publisher.registered) {
    return without_event(publisher.published.first_at,
                         "a publisher whose registration was not seen: its topic is unknown");
  }
  const auto first =
      first_number(publisher.published, publisher.registered, publisher.first_next_seq);
  const auto seen = first + publisher.published.count;
  if (publisher.fini && publisher.fini->second != seen) {
    return evidence(
        "publisher_fini", publisher.fini->first,
        publisher.topic + " published: " + counted_and_seen(publisher.fini->second, seen));
  }
  if (!publisher.fini && publisher.is_accounted && !is_interrupted(publisher.process)) {
    return evidence("publisher_init", *publisher.registered,
                    publisher.topic + " has no publisher_fini");
  }
  return std::nullopt;
}

void Proof::prove(const PublisherFacts& publisher) {
  // What ROS 2's events add to a process that counts its own.
  const bool is_added =
      !publisher.is_accounted && !model_.processes[at(publisher.process)].is_told_by_ros2;
  if (is_added) return;
  auto& process = processes_[at(publisher.process)];
  if (publisher.registered) ++process.publishers_registered;
  if (publisher.fini) ++process.compared;
  const auto lost = loss(publisher);
  if (!lost) return;
  is_anything_lost_ = true;
  // A hole shows in the totals too, where there are any.
  const bool has_totals = publisher.fini || !is_interrupted(publisher.process);
  if (has_totals || !publisher.registered) process.disagreements.push_back(*lost);
}

void Proof::prove(ThreadIndex index) {
  const auto& facts = model_.threads[at(index)];
  auto& process = processes_[at(facts.process)];
  const auto name = "thread " + std::to_string(facts.tid);
  if (!facts.announced) {
    if (facts.read_backs.count != 0 || facts.fini) {
      ++process.threads_unannounced;
      auto unannounced = evidence(facts.fini ? "thread_fini" : "thread_sched",
                                  facts.fini ? *facts.fini : facts.read_backs.first_at,
                                  name + " was never seen to be announced");
      if (!process.first_unannounced) process.first_unannounced = unannounced;
      threads_.emplace(index, std::move(unannounced));
    }
    return;
  }
  process.threads_announced += facts.spins;
  auto loss = gap(facts);
  if (facts.fini) {
    const auto seen = facts.read_backs.first.value_or(0) + facts.read_backs.count;
    const auto total = [&] { return evidence("thread_fini", *facts.fini, name + " read back"); };
    compare(facts.process, total, facts.fini_read_backs, seen);
    if (!loss && facts.fini_read_backs != seen) {
      loss = total();
      loss->note += ": " + counted_and_seen(facts.fini_read_backs, seen);
    }
  } else if (!is_interrupted(facts.process)) {
    const auto missing = evidence("thread_init", *facts.announced, name + " has no thread_fini");
    process.disagreements.push_back(missing);
    if (!loss) loss = missing;
  } else if (!loss) {
    loss = untold_loss_of_state(facts.process, facts.read_backs.count != 0
                                                   ? facts.read_backs.last_at.time
                                                   : facts.announced->time);
  }
  if (!loss) return;
  is_anything_lost_ = true;
  threads_.emplace(index, std::move(loss));
}

void Proof::prove(ProcessIndex index) {
  const auto& facts = model_.processes[at(index)];
  auto& process = processes_[at(index)];
  if (facts.run_end) {
    const auto& totals = *facts.run_end;
    const auto compare_total = [&](const char* what, std::uint64_t expected, std::uint64_t seen) {
      compare(
          index, [&] { return evidence("run_end", totals.at, what); }, expected, seen);
    };
    compare_total("callbacks", totals.callbacks, process.callbacks_registered);
    compare_total("threads", totals.threads, process.threads_announced);
    compare_total("groups", totals.groups, process.groups_known);
    compare_total("publishers", totals.publishers, process.publishers_registered);
    if (!process.disagreements.empty()) is_anything_lost_ = true;
  }
  std::ranges::stable_sort(process.disagreements, {}, [](const Evidence& item) {
    return std::tie(item.time, item.event, item.note);
  });
}

}  // namespace cie::analysis
