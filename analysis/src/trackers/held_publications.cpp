#include "held_publications.hpp"

#include "registry.hpp"

#include <cstddef>

namespace cie::analysis {
namespace {

constexpr std::size_t kMaxHeld = 100'000;

}  // namespace

void HeldPublications::add(std::uint32_t publisher, const Publication& publication) {
  held_.push_back({.publisher = publisher, .publication = publication});
  if (held_.size() > kMaxHeld) tell_first();
  tell_announced();
}

void HeldPublications::tell_announced() {
  while (!held_.empty() && !may_be_announced(held_.front().publisher))
    tell_first();
}

void HeldPublications::tell_all() {
  while (!held_.empty())
    tell_first();
}

// By its own times: clocks of hosts differ.
bool HeldPublications::may_be_announced(std::uint32_t publisher) const {
  const auto& facts = model_.publishers[publisher];
  return facts.awaited_since &&
         facts.published.last_at.time - *facts.awaited_since <= Registry::kAnnouncedWithin;
}

void HeldPublications::tell_first() {
  auto& [publisher, publication] = held_.front();
  const auto& facts = model_.publishers[publisher];
  publication.topic = facts.topic;
  publication.writer_gid = facts.writer_gid;
  observer_->on_publication(publication);
  held_.pop_front();
}

}  // namespace cie::analysis
