#include "proof.hpp"

#include "judgement.hpp"
#include "kernel_holes.hpp"
#include "numbered_events.hpp"

#include <algorithm>

namespace cie::analysis {
namespace {

template <typename Index>
const std::optional<Evidence>& found_loss(const std::map<Index, std::optional<Evidence>>& losses,
                                          Index index) {
  static const std::optional<Evidence> nothing;
  const auto found = losses.find(index);
  return found == losses.end() ? nothing : found->second;
}

}  // namespace

Proof::Proof(const Model& model, const ThreadLives& lives, const UserLossesOfProcesses& user_losses)
    : model_(model),
      lives_(lives),
      user_losses_(user_losses),
      missing_user_part_(analysis::missing_user_part(model)),
      processes_(model.processes.size()) {
  for (const auto& callback : model.callbacks) {
    const auto host = model.processes[at(callback.process)].host;
    if (callback.first_release) with_releases_.insert(host);
    if (callback.lost_at) with_lost_samples_.insert(host);
  }
  for (std::size_t i = 0; i < model.callbacks.size(); ++i) {
    compare_totals_of(CallbackIndex{static_cast<std::uint32_t>(i)});
  }
  for (const auto& publisher : model.publishers)
    compare_totals_of(publisher);
  for (std::size_t i = 0; i < model.threads.size(); ++i) {
    compare_totals_of(ThreadIndex{static_cast<std::uint32_t>(i)});
  }
  for (std::size_t i = 0; i < model.threads.size(); ++i) {
    find_unseen_spin(ThreadIndex{static_cast<std::uint32_t>(i)});
  }
  for (const auto& group : model.groups) {
    if (group.type && group.is_accounted) ++processes_[at(group.process)].groups_known;
  }
  for (std::size_t i = 0; i < model.processes.size(); ++i) {
    compare_totals_of(ProcessIndex{static_cast<std::uint32_t>(i)});
  }
  find_recorder_losses();
}

void Proof::find_recorder_losses() {
  for (auto& failure : recorder_failures(model_)) {
    if (!is_proven_whole(*failure.recording)) recorder_losses_.push_back(std::move(failure));
  }
  if (missing_user_part_ || recorder_losses_.empty()) return;
  const auto& first = recorder_losses_.front();
  missing_user_part_ = in_words(first, first.problems.front());
}

bool Proof::is_proven_whole(const Recording& recording) const {
  if (!names_all_processes(recording)) return false;
  for (std::size_t i = 0; i < model_.processes.size(); ++i) {
    const auto& process = model_.processes[i];
    if (!process.has_cie_events || !may_be_of(model_, recording, process)) continue;
    if (!is_complete(ProcessIndex{static_cast<std::uint32_t>(i)})) return false;
  }
  return true;
}

const RecorderFailure* Proof::lost_end(ProcessIndex process) const {
  const auto& facts = model_.processes[at(process)];
  const auto found = std::ranges::find_if(recorder_losses_, [&](const RecorderFailure& failure) {
    const auto& manifest = failure.recording->manifest;
    const bool was_killed = manifest && manifest->exit && manifest->exit->signal;
    return !was_killed && may_be_of(model_, *failure.recording, facts);
  });
  return found == recorder_losses_.end() ? nullptr : &*found;
}

bool Proof::is_interrupted(ProcessIndex process) const {
  return !model_.processes[at(process)].run_end;
}

bool Proof::has_begun_in_trace(ProcessIndex process) const {
  return model_.processes[at(process)].first_moment == RunMoment::start;
}

bool Proof::is_complete(ProcessIndex process) const {
  const auto& facts = model_.processes[at(process)];
  return facts.run_begin && facts.run_end && processes_[at(process)].disagreements.empty();
}

std::optional<Evidence> Proof::incompleteness(ProcessIndex process) const {
  const auto& facts = model_.processes[at(process)];
  if (!has_begun_here(facts)) {
    return without_event(
        facts.first_seen.value_or(EventRef{}),
        note("no-begin", {{"event", facts.is_from_ros2 ? "rcl_init" : "run_begin"}}));
  }
  if (!facts.run_end) {
    return without_event(facts.last_seen.value_or(EventRef{}),
                         note(facts.is_from_ros2 ? "ros2-has-no-totals" : "nothing-behind-last"));
  }
  const auto& problems = processes_[at(process)].disagreements;
  return problems.empty() ? std::nullopt : std::optional(problems.front());
}

const std::optional<Evidence>& Proof::loss(CallbackIndex callback) const {
  const auto& lost = lost_runs(callback);
  return lost ? lost : unseen_end(callback);
}

const std::optional<Evidence>& Proof::unseen_end(CallbackIndex callback) const {
  return found_loss(untold_ends_, callback);
}

const std::optional<Evidence>& Proof::lost_runs(CallbackIndex callback) const {
  return found_loss(callbacks_, callback);
}

const std::optional<Evidence>& Proof::loss(ThreadIndex thread) const {
  const auto& loss = lost_read_backs(thread);
  return loss ? loss : found_loss(spins_, thread);
}

const std::optional<Evidence>& Proof::lost_read_backs(ThreadIndex thread) const {
  return found_loss(threads_, thread);
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
                    note("numbers-begin-late", {{"field", "n"}, {"first", *numbers.first}}));
  }
  return std::nullopt;
}

std::optional<Evidence> Proof::untold_loss(ProcessIndex process, EventKinds kinds,
                                           Timestamp last) const {
  return is_interrupted(process) ? user_losses_.since(process, last, kinds) : std::nullopt;
}

// Without totals, a start or end that stands alone tells that its partner was lost, unless the
// record's end cut it.
std::optional<Evidence> Proof::lost_partner(const CallbackFacts& facts) const {
  if (auto lost = lost_start(facts)) return lost;
  const auto open = std::ranges::find_if(facts.open, [this](const OpenInstance& instance) {
    return !instance.is_left && !lives_.is_cut_by_end(instance);
  });
  if (open == facts.open.end()) return std::nullopt;
  return evidence("callback_start", open->start, note("start-without-end", {{"seq", open->seq}}));
}

std::optional<Evidence> Proof::loss(const PublisherFacts& publisher) const {
  if (auto hole = gap(publisher)) return hole;
  if (!publisher.registered) {
    return without_event(publisher.published.first_at, note("unregistered-publisher"));
  }
  const auto first =
      first_number(publisher.published, publisher.registered, publisher.first_next_seq);
  const auto seen = first + publisher.published.count;
  if (publisher.fini && publisher.fini->second != seen) {
    return evidence(
        "publisher_fini", publisher.fini->first,
        note("publisher-total",
             {{"topic", publisher.topic}, {"counted", publisher.fini->second}, {"seen", seen}}));
  }
  if (!publisher.fini && publisher.is_accounted && !is_interrupted(publisher.process)) {
    return evidence("publisher_init", *publisher.registered,
                    note("no-publisher-fini", {{"topic", publisher.topic}}));
  }
  return std::nullopt;
}

}  // namespace cie::analysis
