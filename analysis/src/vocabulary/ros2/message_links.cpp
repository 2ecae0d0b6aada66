#include "message_links.hpp"

#include <algorithm>
#include <utility>

namespace cie::analysis::ros2 {
namespace {

constexpr std::size_t kMaxPublications = 1024;  // per topic, waiting to be taken

}  // namespace

std::shared_ptr<WrittenMessage> MessageLinks::add(const std::string& topic,
                                                  const WrittenMessage& publication) {
  auto& entry = topics_[topic];
  auto& publications = entry.publications;
  if (publications.size() >= kMaxPublications) {
    publications.pop_front();
    if (entry.settled > 0) --entry.settled;
  }
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

void MessageLinks::add_unannounced(std::int64_t source_timestamp) {
  if (unannounced_.size() >= kMaxPublications) unannounced_.pop_front();
  unannounced_.push_back(source_timestamp);
}

bool MessageLinks::is_unannounced(std::int64_t source_timestamp) const {
  return std::find(unannounced_.rbegin(), unannounced_.rend(), source_timestamp) !=
         unannounced_.rend();
}

MessageLinks::Origin MessageLinks::find(const std::string& topic, std::int64_t source_timestamp) {
  const auto found = topics_.find(topic);
  if (found == topics_.end()) {
    return {.gid = 0, .stamp = source_timestamp, .is_undecided = is_unannounced(source_timestamp)};
  }
  auto& entry = found->second;
  entry.settle();
  const auto& publications = entry.publications;
  const WrittenMessage* exact = nullptr;
  WrittenMessage* within = nullptr;
  std::size_t candidates = 0;
  for (auto i = publications.size(); i-- > 0;) {
    if (i < entry.settled && publications[i].none_after < source_timestamp) break;
    auto& publication = *publications[i].message;
    if (publication.is_exact) {
      if (publication.stamp != source_timestamp) continue;
      if (exact != nullptr) return {.gid = 0, .stamp = source_timestamp, .is_undecided = true};
      exact = &publication;
      continue;
    }
    if (source_timestamp < publication.from - kOffsetError) continue;
    if (source_timestamp > publication.until) continue;
    if (publication.taken_as.value_or(source_timestamp) != source_timestamp) continue;
    within = &publication;
    ++candidates;
  }
  if (exact != nullptr) return {.gid = exact->gid, .stamp = exact->name.value_or(exact->stamp)};
  if (candidates == 1) {
    within->taken_as = source_timestamp;
    entry.note_fit();
    return {.gid = within->gid, .stamp = within->stamp};
  }
  const bool is_undecided =
      candidates > 1 || is_unannounced(source_timestamp) || entry.has_come_apart(source_timestamp);
  if (is_undecided) return {.gid = 0, .stamp = source_timestamp, .is_undecided = true};
  // What the only publisher wrote that is known is remembered from some time on; else another one
  // wrote it.
  const bool may_be_unknown = has_lost_ || source_timestamp < entry.known_from();
  return {.gid = may_be_unknown ? entry.sole_publisher : 0,
          .stamp = source_timestamp,
          .is_undecided = has_lost_ && entry.publishers > 1};
}

MessageLinks::Origin MessageLinks::find_entry(const std::string& topic,
                                              const WrittenMessage::Entry& entry) const {
  const auto found = topics_.find(topic);
  if (found == topics_.end()) return {};
  const auto& publications = found->second.publications;
  const auto each = std::find_if(publications.rbegin(), publications.rend(),
                                 [&entry](const auto& p) { return p.message->entry == entry; });
  if (each == publications.rend()) return {};
  return {.gid = each->message->gid, .stamp = each->message->stamp};
}

}  // namespace cie::analysis::ros2
