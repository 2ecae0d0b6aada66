#include "loss_log.hpp"

#include "model/host_gaps.hpp"
#include "model/loss_gaps.hpp"

#include <algorithm>
#include <string>
#include <utility>

namespace cie::analysis {
namespace {
constexpr std::size_t kMaxLosses = 100'000;
// Of a live system every loss is looked at again and again.
constexpr std::size_t kMaxLiveLosses = 1'000;
}  // namespace

void LossLog::add(Loss loss) {
  const bool is_damage =
      loss.kind == LossKind::damaged_packet || loss.kind == LossKind::foreign_metadata;
  if (asked_ && !is_damage && loss.begin > asked_->to) return;
  if (asked_ && !is_damage && loss.end < asked_->from) {
    note_before(std::move(loss));
    return;
  }
  const auto place = list(loss);
  if (loss.is_evidence) model_.gaps.add(gap_of(loss, place));
}

std::size_t LossLog::list(const Loss& loss) {
  auto& losses = model_.losses;
  const bool is_kernel = loss.domain == Domain::kernel;
  const auto limit = is_live_ ? kMaxLiveLosses : kMaxLosses;
  // The kernel's leave room for those in user space.
  const bool is_full = is_kernel ? kernel_losses_ >= limit / 2 : losses.size() >= limit;
  if (is_full) {
    const auto [rest, is_first] = rest_.try_emplace(
        {loss.kind, loss.domain, loss.host, loss.cpu, loss.count.has_value()}, losses.size());
    if (!is_first) {
      auto& all = losses[rest->second];
      all.begin = std::min(all.begin, loss.begin);
      all.end = std::max(all.end, loss.end);
      if (loss.count) *all.count += *loss.count;
      ++all.times;
      return rest->second;
    }
  }
  kernel_losses_ += is_kernel ? 1 : 0;
  losses.push_back(loss);
  return losses.size() - 1;
}

void LossLog::note_before(Loss loss) {
  auto& before = model_.losses_before;
  const auto same = std::ranges::find_if(before, [&loss](const Loss& other) {
    return other.host == loss.host && other.domain == loss.domain;
  });
  if (loss.is_evidence)
    model_.gaps.add(gap_before(loss, static_cast<std::size_t>(same - before.begin())));
  if (same == before.end()) {
    before.push_back(std::move(loss));
  } else if (same->end < loss.end) {
    *same = std::move(loss);
  }
}

void LossLog::note_user_loss(const EventHead& head, Timestamp begin, Timestamp end) {
  const auto* facts = find_stream(model_, head.stream);
  const bool is_kernel = facts != nullptr && facts->domain == Domain::kernel;
  if (is_kernel || !coverage_.is_evidence(head.stream)) return;
  times_.add(registry_.host_of(head), begin, end);
}

void LossLog::apply(const EventHead& head, const Discarded& event) {
  note_user_loss(head, event.begin, event.end);
  const auto* facts = find_stream(model_, head.stream);
  add(Loss{.kind = event.packets ? LossKind::discarded_packets : LossKind::discarded_events,
           .domain = facts != nullptr ? facts->domain : Domain::user,
           .host = registry_.host_of(head),
           .begin = event.begin,
           .end = event.end,
           .count = event.count,
           .cpu = head.cpu,
           .note = facts != nullptr ? facts->path : std::string{},
           .is_evidence = coverage_.costs(head, event.end)});
}

void LossLog::apply(const EventHead& head, const DamagedPacket& event) {
  const auto begin = event.begin.value_or(head.time);
  const auto end = event.end.value_or(head.time);
  if (!event.has_foreign_metadata) note_user_loss(head, begin, end);
  const auto* facts = find_stream(model_, head.stream);
  add(Loss{
      .kind = event.has_foreign_metadata ? LossKind::foreign_metadata : LossKind::damaged_packet,
      .domain = facts != nullptr ? facts->domain : Domain::user,
      .host = registry_.host_of(head),
      .begin = begin,
      .end = end,
      .count = std::nullopt,
      .cpu = head.cpu,
      .note = std::string(event.reason),
      .is_evidence = coverage_.costs(head, end)});
}

// Whether a process went on is known at the end alone. Who asks for losses between two events of one
// thread knows that it did.
void LossLog::apply(const EventHead& head, const SessionGap& event) {
  note_user_loss(head, event.begin, event.end);
  if (model_.session_gaps.size() >= kMaxLosses) return;
  model_.session_gaps.push_back({.host = registry_.host_of(head),
                                 .from = event.begin,
                                 .to = event.end,
                                 .is_before_runs = event.is_before_runs});
}

void LossLog::apply(const EventHead& head, const TimeRegression& event) {
  auto& facts = model_.time_regressions;
  ++facts.count;
  if (facts.first) return;
  facts.first = ref(head);
  facts.first_previous = event.previous;
}

void LossLog::add_host_gaps() {
  for (const auto& gap : gaps_within_lives(model_)) {
    add_host_gap(gap.host, gap.from,
                 gap.to - Duration{1},  // the next session's first event was recorded
                 "between two sessions");
  }
}

void LossLog::add_host_gap(HostIndex host, Timestamp begin, Timestamp end, std::string note) {
  const auto known = std::ranges::find_if(model_.losses, [&](const Loss& loss) {
    return loss.kind == LossKind::host_gap && loss.host == host && loss.begin == begin &&
           loss.note == note;
  });
  if (known != model_.losses.end() && known->end >= end) return;
  Loss gap{.kind = LossKind::host_gap,
           .host = host,
           .begin = begin,
           .end = end,
           .note = std::move(note)};
  if (known == model_.losses.end()) {
    add(std::move(gap));
    return;
  }
  known->end = end;
  model_.gaps.add(gap_of(gap, static_cast<std::size_t>(known - model_.losses.begin())));
}

}  // namespace cie::analysis
