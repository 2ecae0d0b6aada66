// Totals that the executor leaves behind, against what was seen.
#include "judgement.hpp"
#include "kernel_holes.hpp"
#include "model/callback_questions.hpp"
#include "numbered_events.hpp"
#include "proof.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <tuple>
#include <utility>

namespace cie::analysis {

template <std::invocable Total>
void Proof::compare(ProcessIndex process, const Total& total, std::uint64_t expected,
                    std::uint64_t seen) {
  auto& proof = processes_[at(process)];
  ++proof.compared;
  if (expected == seen) return;
  proof.disagreements.push_back(total());
}

void Proof::compare_totals_of(CallbackIndex index) {
  const auto& facts = model_.callbacks[at(index)];
  auto& process = processes_[at(facts.process)];
  std::optional<Evidence> loss;
  // What ROS 2's events add to a process that counts its own.
  const bool is_added = !facts.is_accounted && !model_.processes[at(facts.process)].is_from_ros2;
  if (!is_added) ++process.callbacks_named;
  if (!is_added && facts.registered) ++process.callbacks_registered;

  loss = gap_of(facts.starts, "callback_start", "seq");
  if (!loss && !facts.registered) {
    loss = without_event(first_sign(model_, facts), note("registration-unseen"));
  }
  const auto first = first_number(facts.starts, facts.registered, facts.first_next_seq);
  if (facts.fini) {
    const auto total = [&](const char* what, std::uint64_t expected, std::uint64_t seen) {
      return evidence("callback_fini", facts.fini->at,
                      note("callback-total", {{"callback", NamedCallback{facts.logical_id}},
                                              {"total", what},
                                              {"counted", expected},
                                              {"seen", seen}}));
    };
    const auto started = first + facts.starts.count;
    const auto compare_total = [&](const char* what, std::uint64_t expected, std::uint64_t seen) {
      compare(
          facts.process, [&] { return total(what, expected, seen); }, expected, seen);
    };
    compare_total("started", facts.fini->started, started);
    if (!loss && facts.fini->started != started)
      loss = total("started", facts.fini->started, started);
    // Instances that never end are told by started - ended; more that are open lost their end.
    const auto open = open_instances(facts);
    const bool is_end_lost = tells_lost_end(facts, *facts.fini);
    const bool is_surplus = first == 0 && open < unended(*facts.fini);
    compare_total("ended", facts.fini->ended,
                  is_end_lost || is_surplus ? started - open : facts.fini->ended);
    if (!loss && is_end_lost) loss = total("ended", facts.fini->ended, started - open);
    // A recording may leave a class out, and that of another machine not.
    const auto host = model_.processes[at(facts.process)].host;
    const auto compare_running = [&](const char* what, const std::set<HostIndex>& recorded_on,
                                     std::uint64_t total_count, std::uint64_t seen) {
      if (!has_begun_in_trace(facts.process) || !recorded_on.contains(host)) return;
      compare_total(what, total_count, seen);
      if (!loss && total_count != seen) loss = total(what, total_count, seen);
    };
    compare_running("released", with_releases_, facts.fini->released, facts.releases);
    compare_running("lost", with_lost_samples_, facts.fini->lost, facts.lost);
  } else if (!is_added && !is_interrupted(facts.process)) {
    const auto missing =
        without_event(facts.starts.last_at,
                      note("no-callback-fini", {{"callback", NamedCallback{facts.logical_id}}}));
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
    if (!loss && is_added) loss = user_losses_.since(facts.process, last, kRunKinds);
    if (!loss) loss = untold_loss(facts.process, kRunKinds, last);
    if (!loss && facts.own) {
      loss = evidence("callback_start", facts.own->others_since,
                      note("instances-from-here", {{"what", perhaps_anothers_note()}}));
    }
  }
  if (!loss) {
    const auto left = std::ranges::find(facts.open, true, &OpenInstance::is_left);
    if (left != facts.open.end()) untold_ends_.emplace(index, untold_end(facts, *left));
    return;
  }
  is_anything_lost_ = true;
  callbacks_.emplace(index, std::move(loss));
}

void Proof::compare_totals_of(const PublisherFacts& publisher) {
  // What ROS 2's events add to a process that counts its own.
  const bool is_added =
      !publisher.is_accounted && !model_.processes[at(publisher.process)].is_from_ros2;
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

void Proof::compare_totals_of(ThreadIndex index) {
  const auto& facts = model_.threads[at(index)];
  auto& process = processes_[at(facts.process)];
  if (!facts.announced) {
    if (facts.read_backs.count != 0 || facts.fini) {
      ++process.threads_unannounced;
      auto unannounced = evidence(facts.fini ? "thread_fini" : "thread_sched",
                                  facts.fini ? *facts.fini : facts.read_backs.first_at,
                                  note("thread-never-announced", {{"tid", facts.tid}}));
      if (!process.first_unannounced) process.first_unannounced = unannounced;
      threads_.emplace(index, std::move(unannounced));
    } else if (!process.first_stray) {
      const auto ran = std::ranges::find_if(facts.ran, [this](const CallbackOnThread* pair) {
        return model_.callbacks[at(pair->callback)].is_accounted;
      });
      if (ran != facts.ran.end()) {
        process.first_stray = without_event(
            (*ran)->first_start, note("ran-on-unannounced-thread", {{"tid", facts.tid}}));
      }
    }
    return;
  }
  process.threads_announced += facts.spins;
  auto loss = gap(facts);
  if (facts.fini) {
    const auto seen = facts.read_backs.first.value_or(0) + facts.read_backs.count;
    const auto total = [&] {
      return evidence(
          "thread_fini", *facts.fini,
          note("thread-total",
               {{"tid", facts.tid}, {"counted", facts.fini_read_backs}, {"seen", seen}}));
    };
    compare(facts.process, total, facts.fini_read_backs, seen);
    if (!loss && facts.fini_read_backs != seen) loss = total();
  } else if (!is_interrupted(facts.process)) {
    const auto missing =
        evidence("thread_init", *facts.announced, note("no-thread-fini", {{"tid", facts.tid}}));
    process.disagreements.push_back(missing);
    if (!loss) loss = missing;
  } else if (!loss) {
    loss = untold_loss(
        facts.process, kStateKinds,
        facts.read_backs.count != 0 ? facts.read_backs.last_at.time : facts.announced->time);
  }
  if (!loss) return;
  is_anything_lost_ = true;
  threads_.emplace(index, std::move(loss));
}

void Proof::compare_totals_of(ProcessIndex index) {
  const auto& facts = model_.processes[at(index)];
  auto& process = processes_[at(index)];
  if (facts.run_end) {
    const auto& totals = *facts.run_end;
    const auto compare_total = [&](const char* what, std::uint64_t expected, std::uint64_t seen) {
      compare(
          index,
          [&] {
            return evidence(
                "run_end", totals.at,
                note("process-total", {{"total", what}, {"counted", expected}, {"seen", seen}}));
          },
          expected, seen);
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

const std::vector<Evidence>& Proof::disagreements(ProcessIndex process) const {
  return processes_[at(process)].disagreements;
}

std::uint64_t Proof::totals_compared(ProcessIndex process) const {
  return processes_[at(process)].compared;
}

bool Proof::counts_no_more(ProcessIndex process, std::uint32_t RunTotals::*total,
                           std::uint64_t seen) const {
  const auto& run_end = model_.processes[at(process)].run_end;
  return run_end && seen >= (*run_end).*total;
}

std::optional<Evidence> Proof::unseen(ProcessIndex process, std::uint32_t RunTotals::*total,
                                      std::uint64_t seen, const char* what) const {
  const auto& run_end = model_.processes[at(process)].run_end;
  if (!run_end || !has_begun_in_trace(process) || seen >= (*run_end).*total) return std::nullopt;
  return evidence("run_end", run_end->at,
                  note(what, {{"counted", (*run_end).*total}, {"seen", seen}}));
}

std::optional<Evidence> Proof::unseen_or_lost(ProcessIndex process, std::uint32_t RunTotals::*total,
                                              std::uint64_t seen, const char* what,
                                              const char* uncounted) const {
  const auto& facts = model_.processes[at(process)];
  if (counts_no_more(process, total, seen)) return std::nullopt;
  if (facts.run_end && has_begun_in_trace(process)) return unseen(process, total, seen, what);
  auto loss = user_losses_.since(process, facts.first_seen ? facts.first_seen->time : Timestamp{});
  if (loss) loss->note = note(uncounted, {{"loss", std::move(loss->note)}});
  return loss;
}

std::optional<Evidence> Proof::unseen_callbacks(ProcessIndex process) const {
  return unseen_or_lost(process, &RunTotals::callbacks, processes_[at(process)].callbacks_named,
                        "unseen-callbacks", "callback-perhaps-lost");
}

bool Proof::are_all_callbacks_seen(ProcessIndex process) const {
  return counts_no_more(process, &RunTotals::callbacks, processes_[at(process)].callbacks_named);
}

std::optional<Evidence> Proof::counted_callbacks_unseen(ProcessIndex process) const {
  return unseen(process, &RunTotals::callbacks, processes_[at(process)].callbacks_named,
                "unseen-callbacks");
}

std::optional<Evidence> Proof::unseen_threads(ProcessIndex process) const {
  if (is_ros2_only(model_.processes[at(process)])) return std::nullopt;
  return unseen_or_lost(process, &RunTotals::threads, threads_announced(process),
                        "unseen-announcements", "announcement-perhaps-lost");
}

std::optional<Evidence> Proof::unseen_announcement(ProcessIndex process) const {
  const auto& facts = model_.processes[at(process)];
  if (missing_user_part_) {
    return without_event(facts.first_seen.value_or(EventRef{}), free_text(*missing_user_part_));
  }
  if (auto unseen = processes_[at(process)].first_unannounced) {
    unseen->note = others_missing_too(std::move(unseen->note));
    return unseen;
  }
  return unseen(process, &RunTotals::threads, threads_announced(process), "unseen-announcements");
}

std::optional<Evidence> Proof::unaccounted_threads(ProcessIndex process) const {
  if (const auto& unseen = processes_[at(process)].first_unannounced) return unseen;
  const auto& facts = model_.processes[at(process)];
  if (facts.run_end && has_begun_in_trace(process)) {
    return unseen(process, &RunTotals::threads, threads_announced(process), "unseen-announcements");
  }
  return processes_[at(process)].first_stray;
}

bool Proof::are_all_announced(ProcessIndex process) const {
  return counts_no_more(process, &RunTotals::threads, threads_announced(process));
}

std::optional<std::uint64_t> Proof::threads_missing(ProcessIndex process) const {
  const auto& run_end = model_.processes[at(process)].run_end;
  const auto seen = threads_announced(process);
  if (!run_end || !has_begun_in_trace(process) || run_end->threads < seen) return std::nullopt;
  return run_end->threads - seen;
}

bool Proof::are_all_accounted(ProcessIndex process) const {
  const auto& seen = processes_[at(process)];
  return counts_no_more(process, &RunTotals::threads,
                        seen.threads_announced + seen.threads_unannounced);
}

void Proof::find_unseen_spin(ThreadIndex index) {
  const auto& thread = model_.threads[at(index)];
  if (!thread.announced || are_all_accounted(thread.process)) return;
  const auto begin = birth_of(thread).value_or(Timestamp{});
  auto spin = user_losses_.since(thread.process, begin, kStateKinds);
  if (!spin) return;
  spin->note = note("spin-perhaps-lost", {{"loss", std::move(spin->note)}, {"tid", thread.tid}});
  is_anything_lost_ = true;
  spins_.emplace(index, std::move(spin));
}

std::optional<Evidence> Proof::unseen_publishers(ProcessIndex process) const {
  return unseen(process, &RunTotals::publishers, processes_[at(process)].publishers_registered,
                "unseen-publishers");
}

}  // namespace cie::analysis
