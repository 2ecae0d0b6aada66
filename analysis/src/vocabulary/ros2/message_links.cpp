#include "message_links.hpp"

#include <algorithm>

namespace cie::analysis::ros2 {

bool MessageLinks::may_write_unrecorded(const MessageTopic& topic,
                                        std::int64_t source_timestamp) const {
  if (ended_.empty()) return false;
  return std::ranges::any_of(topic.told_in(), [&](const auto& told_in) {
    const auto end = ended_.find(told_in.first);
    return end != ended_.end() && end->second <= source_timestamp;
  });
}

bool MessageLinks::may_be_unannounced(std::int64_t source_timestamp) {
  const auto fitting = unannounced_.fitting(source_timestamp);
  return fitting.exact_count > 0 || fitting.within_count > 0;
}

MessageLinks::Origin MessageLinks::find(const std::string& topic, std::int64_t source_timestamp,
                                        const Take& take) {
  const Origin undecided{.gid = 0, .stamp = source_timestamp, .is_undecided = true};
  const bool may_follow = source_timestamp > take.told_until;
  const auto found = topics_.find(topic);
  if (found == topics_.end()) {
    const bool may_be_told = may_follow || may_be_unannounced(source_timestamp);
    return may_be_told ? undecided : Origin{.gid = 0, .stamp = source_timestamp};
  }
  auto& entry = found->second;
  const auto fitting = entry.fitting(source_timestamp);
  if (fitting.exact_count > 1) return undecided;
  if (fitting.exact != nullptr) {
    return {.gid = fitting.exact->gid, .stamp = fitting.exact->known_as()};
  }
  if (fitting.within_count > 1 || may_be_unannounced(source_timestamp)) return undecided;
  if (fitting.within_count == 1) {
    // Of a call that goes on nothing but the take says when the message was written at the latest.
    const bool is_stamped_ahead = source_timestamp > take.at;
    if (may_follow || is_stamped_ahead || fitting.within->is_doubtful) return undecided;
    fitting.within->taken_as = source_timestamp;
    entry.note_fit();
    // Nor is it a proof where somebody else writes, too, at whatever time.
    if (entry.has_unseen_writer()) return undecided;
    return {.gid = fitting.within->gid, .stamp = fitting.within->stamp};
  }
  if (may_follow) {
    // The only publisher's, whose publication by that name will follow if it tells timestamps.
    const bool is_named = entry.sole_publisher() != 0 && entry.tells_timestamps();
    return is_named ? Origin{.gid = entry.sole_publisher(), .stamp = source_timestamp} : undecided;
  }
  if (entry.may_be_written_now(source_timestamp)) {
    return {.gid = entry.sole_publisher(),
            .stamp = source_timestamp,
            .is_undecided = entry.sole_publisher() == 0};
  }
  if (entry.has_come_apart(source_timestamp)) return undecided;
  // What the only publisher wrote that is known is remembered from some time on; else another one
  // wrote it.
  const bool may_be_lost = has_lost_ || may_write_unrecorded(entry, source_timestamp);
  const bool may_be_unknown = may_be_lost || source_timestamp < entry.known_from();
  const bool may_be_forgotten = may_be_unknown && source_timestamp >= entry.forgotten_from();
  const bool is_first = !may_be_unknown && !entry.tells_timestamps() && entry.note_unseen_writer();
  return {.gid = may_be_unknown ? entry.sole_publisher() : 0,
          .stamp = source_timestamp,
          .is_undecided = (may_be_lost || may_be_forgotten) && entry.publishers() > 1,
          .shows_unseen_writer = is_first};
}

MessageLinks::Origin MessageLinks::find_entry(const std::string& topic,
                                              const AgnocastEntry& entry) const {
  const auto found = topics_.find(topic);
  if (found == topics_.end()) return {};
  const auto& messages = found->second;
  const auto [latest, is_ambiguous] = messages.find_entry(entry);
  if (latest == nullptr) return {.is_undecided = messages.has_forgotten()};
  if (is_ambiguous) return {.is_undecided = true};
  return {.gid = latest->gid, .stamp = latest->stamp};
}

}  // namespace cie::analysis::ros2
