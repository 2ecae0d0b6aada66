#include "message_links.hpp"

#include <algorithm>
#include <utility>

namespace cie::analysis::ros2 {
namespace {

constexpr std::size_t kMaxPublications = 1024;  // per topic, waiting to be taken

}  // namespace

std::shared_ptr<WrittenMessage> MessageLinks::add(const std::string& topic,
                                                  const WrittenMessage& publication) {
  return topics_[topic].add(publication);
}

std::shared_ptr<WrittenMessage> MessageLinks::Topic::add(const WrittenMessage& publication) {
  if (publications.size() >= kMaxPublications) {
    forgotten_from = std::min(forgotten_from, known_from());
    publications.pop_front();
    if (settled > 0) --settled;
  }
  if (publication.entry) entry_writers.emplace(publication.entry->host, publication.pid);
  publications.push_back({.message = std::make_shared<WrittenMessage>(publication)});
  return publications.back().message;
}

void MessageLinks::Topic::settle() {
  for (; settled < publications.size(); ++settled) {
    auto& next = publications[settled];
    const auto latest = next.message->is_exact ? next.message->stamp : next.message->until;
    if (latest == std::numeric_limits<std::int64_t>::max()) return;
    next.none_after =
        settled == 0 ? latest : std::max(latest, publications[settled - 1].none_after);
  }
}

std::int64_t MessageLinks::Topic::known_from() const {
  if (publications.empty()) return std::numeric_limits<std::int64_t>::max();
  const auto& first = *publications.front().message;
  return first.is_exact ? first.stamp : first.from - kOffsetError;
}

bool MessageLinks::Topic::has_come_apart(std::int64_t source_timestamp) {
  constexpr std::size_t kEnough = 3;
  if (std::exchange(last_misfit, source_timestamp) != source_timestamp) ++misfits;
  if (!has_fitted || misfits < kEnough) return false;
  std::size_t of_none = 0;
  for (auto i = publications.rbegin(); i != publications.rend() && of_none < kEnough; ++i) {
    const auto& publication = *i->message;
    if (publication.is_exact || publication.until == WrittenMessage::kInProcess) continue;
    if (publication.taken_as) return false;
    ++of_none;
  }
  return of_none == kEnough;
}

void MessageLinks::add_publisher(const std::string& topic, std::uint64_t gid) {
  auto& entry = topics_[topic];
  ++entry.publishers;
  entry.sole_publisher = entry.publishers == 1 ? gid : 0;
}

void MessageLinks::move_teller(Topic& topic, std::optional<std::uint32_t> former,
                               std::uint32_t channel) {
  ++topic.told_in[channel];
  if (!former) return;
  if (const auto left = topic.told_in.find(*former); --left->second == 0) topic.told_in.erase(left);
}

bool MessageLinks::is_told_no_more(const Topic& topic, std::int64_t source_timestamp) const {
  if (ended_.empty()) return false;
  return std::ranges::any_of(topic.told_in, [&](const auto& told_in) {
    const auto end = ended_.find(told_in.first);
    return end != ended_.end() && end->second <= source_timestamp;
  });
}

MessageLinks::Fitting MessageLinks::Topic::fitting(std::int64_t source_timestamp) {
  settle();
  Fitting fitting;
  for (auto i = publications.size(); i-- > 0;) {
    if (i < settled && publications[i].none_after < source_timestamp) break;
    auto& publication = *publications[i].message;
    if (publication.is_exact) {
      if (publication.stamp != source_timestamp) continue;
      fitting.exact = &publication;
      ++fitting.exact_count;
      continue;
    }
    if (source_timestamp < publication.from - kOffsetError) continue;
    if (source_timestamp > publication.until) continue;
    if (publication.taken_as.value_or(source_timestamp) != source_timestamp) continue;
    fitting.within = &publication;
    ++fitting.within_count;
  }
  return fitting;
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
    return {.gid = fitting.exact->gid, .stamp = fitting.exact->name.value_or(fitting.exact->stamp)};
  }
  if (fitting.within_count > 1 || may_be_unannounced(source_timestamp)) return undecided;
  if (fitting.within_count == 1) {
    // Of a call that goes on nothing but the take says when the message was written at the latest.
    const bool is_stamped_ahead = source_timestamp > take.at;
    if (may_follow || is_stamped_ahead || fitting.within->is_doubtful) return undecided;
    fitting.within->taken_as = source_timestamp;
    entry.note_fit();
    // Nor is it a proof where somebody else writes, too, at whatever time.
    if (entry.has_unseen_writer) return undecided;
    return {.gid = fitting.within->gid, .stamp = fitting.within->stamp};
  }
  if (may_follow) {
    // The only publisher's, whose publication by that name will follow if it tells timestamps.
    const bool is_named = entry.sole_publisher != 0 && entry.tells_timestamps();
    return is_named ? Origin{.gid = entry.sole_publisher, .stamp = source_timestamp} : undecided;
  }
  if (entry.has_come_apart(source_timestamp)) return undecided;
  // What the only publisher wrote that is known is remembered from some time on; else another one
  // wrote it.
  const bool may_be_lost = has_lost_ || is_told_no_more(entry, source_timestamp);
  const bool may_be_unknown = may_be_lost || source_timestamp < entry.known_from();
  const bool may_be_forgotten = may_be_unknown && source_timestamp >= entry.forgotten_from;
  const bool is_first =
      !may_be_unknown && !entry.tells_timestamps() && !std::exchange(entry.has_unseen_writer, true);
  return {.gid = may_be_unknown ? entry.sole_publisher : 0,
          .stamp = source_timestamp,
          .is_undecided = (may_be_lost || may_be_forgotten) && entry.publishers > 1,
          .shows_unseen_writer = is_first};
}

MessageLinks::Origin MessageLinks::find_entry(const std::string& topic,
                                              const WrittenMessage::Entry& entry) const {
  const auto found = topics_.find(topic);
  if (found == topics_.end()) return {};
  const auto& publications = found->second.publications;
  const auto is_it = [&entry](const Written& p) { return p.message->entry == entry; };
  const auto each = std::find_if(publications.rbegin(), publications.rend(), is_it);
  if (each == publications.rend()) return {.is_undecided = found->second.has_forgotten()};
  const auto& latest = *each->message;
  const auto is_anothers = [&](const Written& p) {
    return is_it(p) && p.message->pid != latest.pid;
  };
  if (found->second.entry_writers.size() > 1 && std::any_of(each, publications.rend(), is_anothers))
    return {.is_undecided = true};
  return {.gid = latest.gid, .stamp = latest.stamp};
}

}  // namespace cie::analysis::ros2
