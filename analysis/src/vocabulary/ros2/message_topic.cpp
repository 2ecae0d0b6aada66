#include "message_topic.hpp"

#include <algorithm>

namespace cie::analysis::ros2 {

WrittenRef MessageTopic::add(const WrittenMessage& publication,
                             const std::optional<AgnocastMessage>& agnocast) {
  if (publications_.size() == kMost) {
    forgotten_from_ = std::min(forgotten_from_, known_from());
    if (settled_ > 0) --settled_;
  }
  if (agnocast) {
    entry_writers_.emplace(agnocast->entry.host, agnocast->pid);
    entries_.push(Entry{.agnocast = *agnocast, .number = told_});
  }
  publications_.push(Written{.message = publication});
  publications_.prefetch_oldest([](const Written& oldest) { return &oldest; });
  return {*this, told_++};
}

void MessageTopic::settle() {
  for (; settled_ < publications_.size(); ++settled_) {
    auto& next = written(settled_);
    const auto latest = next.message.is_exact ? next.message.stamp : next.message.until;
    if (latest == std::numeric_limits<std::int64_t>::max()) return;
    next.none_after = settled_ == 0 ? latest : std::max(latest, written(settled_ - 1).none_after);
  }
}

bool MessageTopic::tells_timestamps() const {
  if (publications_.size() == 0) return true;
  const auto& latest = publications_.newest(0).message;
  return latest.is_exact || latest.is_doubtful;
}

std::int64_t MessageTopic::known_from() const {
  if (publications_.size() == 0) return std::numeric_limits<std::int64_t>::max();
  const auto& first = publications_.newest(publications_.size() - 1).message;
  return first.is_exact ? first.stamp : first.from - kOffsetError;
}

bool MessageTopic::has_come_apart(std::int64_t source_timestamp) {
  constexpr std::size_t kEnough = 3;
  if (std::exchange(last_misfit_, source_timestamp) != source_timestamp) ++misfits_;
  if (!has_fitted_ || misfits_ < kEnough) return false;
  std::size_t of_none = 0;
  for (std::size_t age = 0; age < publications_.size() && of_none < kEnough; ++age) {
    const auto& publication = publications_.newest(age).message;
    if (publication.is_exact || publication.until == WrittenMessage::kInProcess) continue;
    if (publication.taken_as != WrittenMessage::kNone) return false;
    ++of_none;
  }
  return of_none == kEnough;
}

void MessageTopic::move_channel(std::optional<std::uint32_t> former, std::uint32_t channel) {
  ++told_in_[channel];
  if (!former) return;
  if (const auto left = told_in_.find(*former); --left->second == 0) told_in_.erase(left);
}

MessageTopic::Fitting MessageTopic::fitting(std::int64_t source_timestamp) {
  settle();
  Fitting fitting;
  for (auto place = publications_.size(); place-- > 0;) {
    auto& [publication, none_after] = written(place);
    if (place < settled_ && none_after < source_timestamp) break;
    if (publication.is_exact) {
      if (publication.stamp != source_timestamp) continue;
      fitting.exact = &publication;
      ++fitting.exact_count;
      continue;
    }
    if (source_timestamp < publication.from - kOffsetError) continue;
    if (source_timestamp > publication.until) continue;
    const bool is_of_other =
        publication.taken_as != WrittenMessage::kNone && publication.taken_as != source_timestamp;
    if (is_of_other) continue;
    fitting.within = &publication;
    ++fitting.within_count;
  }
  return fitting;
}

MessageTopic::Entered MessageTopic::find_entry(const AgnocastEntry& entry) const {
  const auto is_it = [&](const Entry& each) {
    return each.agnocast.entry == entry && is_remembered(each.number);
  };
  const auto* latest = entries_.find_newest(is_it);
  if (latest == nullptr) return {};
  const auto is_anothers = [&](const Entry& each) {
    return is_it(each) && each.agnocast.pid != latest->agnocast.pid;
  };
  return {
      .message = &publications_.newest(told_ - 1 - latest->number).message,
      .is_ambiguous = entry_writers_.size() > 1 && entries_.find_newest(is_anothers) != nullptr};
}

}  // namespace cie::analysis::ros2
