// Where a read-back of a thread may be missing.
#include "proof.hpp"

#include <limits>

namespace cie::analysis {

bool Proof::may_hide_read_back(ThreadIndex thread, std::optional<std::uint32_t> after,
                               std::optional<std::uint32_t> before) const {
  const auto& facts = model_.threads[at(thread)];
  const auto& numbers = facts.read_backs;
  const auto first = numbers.first.value_or(0);
  if (!before) {
    const auto known = first + numbers.count + numbers.missing;
    if (facts.fini ? facts.fini_read_backs > known : loss(thread).has_value()) return true;
  }
  if (!after && has_begun_in_trace(facts.process) && first > 0) return true;
  if (!numbers.first_gap) return false;
  const std::uint64_t low = after ? std::uint64_t{*after} + 1 : 0;
  if (before && *before <= low) return false;
  const auto& gap = *numbers.first_gap;
  if (before && gap.expected >= *before) return false;
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
  return user_loss(facts.process, begin, time);
}

}  // namespace cie::analysis
