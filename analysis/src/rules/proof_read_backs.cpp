// Where a read-back of a thread may be missing.
#include "kernel_holes.hpp"
#include "proof.hpp"

#include <cstdint>
#include <limits>
#include <string>
#include <utility>

namespace cie::analysis {
namespace {

constexpr Timestamp kEndOfTime{std::numeric_limits<std::int64_t>::max()};

Timestamp begin_of(const ThreadFacts& thread) { return birth_of(thread).value_or(Timestamp{}); }

}  // namespace

bool Proof::may_hide_read_back(ThreadIndex thread, const ReadBack* after,
                               const ReadBack* before) const {
  const auto& facts = model_.threads[at(thread)];
  const auto begin = after != nullptr ? after->at.time : begin_of(facts);
  if (unseen_spin(thread, begin, before != nullptr ? before->at.time : kEndOfTime)) return true;
  // Of several spins the numbers prove nothing but together.
  if (facts.spins > 1) return threads_.contains(thread);
  const auto& numbers = facts.read_backs;
  const auto first = numbers.first.value_or(0);
  if (before == nullptr) {
    const auto known = first + numbers.count + numbers.missing;
    if (facts.fini ? facts.fini_read_backs > known : threads_.contains(thread)) return true;
  }
  if (after == nullptr && has_begun_in_trace(facts.process) && first > 0) return true;
  if (!numbers.first_gap) return false;
  const std::uint64_t low = after != nullptr ? std::uint64_t{after->n} + 1 : 0;
  if (before != nullptr && before->n <= low) return false;
  const auto& gap = *numbers.first_gap;
  if (before != nullptr && gap.expected >= before->n) return false;
  const bool is_only_gap = numbers.missing == gap.seen - gap.expected;
  return !is_only_gap || gap.seen > low;
}

std::optional<Evidence> Proof::lost_first_read_back(ThreadIndex thread) const {
  const auto& numbers = model_.threads[at(thread)].read_backs;
  if (numbers.first.value_or(0) == 0) return std::nullopt;
  return lost_read_back_before(thread, numbers.first_at.time);
}

std::optional<Evidence> Proof::lost_read_back_before(ThreadIndex thread, Timestamp time) const {
  const auto& facts = model_.threads[at(thread)];
  const auto& process = model_.processes[at(facts.process)];
  const bool is_attached = process.first_moment == RunMoment::announce;
  if (!is_attached || !facts.announced) return std::nullopt;  // else loss() tells
  // An earlier announcement, of all that there is, may have been lost with its audits.
  const bool is_first_announcement = facts.announcements_at_init <= 1 && process.first_seen &&
                                     process.first_seen->time >= process.run_begin->time;
  const auto begin = is_first_announcement ? facts.announced->time
                                           : Timestamp{std::numeric_limits<std::int64_t>::min()};
  return user_losses_.between(facts.process, begin, time);
}

std::optional<Evidence> Proof::unseen_spin(ThreadIndex index, Timestamp begin,
                                           Timestamp end) const {
  const auto& thread = model_.threads[at(index)];
  const auto& process = model_.processes[at(thread.process)];
  const auto& seen = processes_[at(thread.process)];
  const auto known = seen.threads_announced + seen.threads_unannounced;
  if (process.run_end && process.run_end->threads <= known) return std::nullopt;
  auto why = user_losses_.between(thread.process, begin, end);
  if (!why) {
    const auto* loss = loss_before(model_, process.host, Domain::user, begin);
    if (loss == nullptr || loss->begin > end) return std::nullopt;
    why = evidence_of(*loss);
  }
  why->note += "; it may have taken the announcement of thread " + std::to_string(thread.tid) +
               " for another spin";
  return why;
}

void Proof::find_unseen_spin(ThreadIndex index) {
  const auto& thread = model_.threads[at(index)];
  if (!thread.announced) return;
  auto spin = unseen_spin(index, begin_of(thread), kEndOfTime);
  if (!spin) return;
  is_anything_lost_ = true;
  spins_.emplace(index, std::move(spin));
}

}  // namespace cie::analysis
