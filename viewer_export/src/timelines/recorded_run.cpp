#include "recorded_run.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace cie::viewer_export {
namespace {

using analysis::Instance;
using analysis::Publication;

constexpr std::uint32_t kMostReceivers = 4096;  // of one publication
constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

}  // namespace

RecordedRun::RecordedRun(std::size_t records_in_memory,
                         const std::filesystem::path& spill_directory)
    : records_in_memory_(records_in_memory),
      spill_directory_(spill_directory),
      instances_(std::make_unique<Instances>(records_in_memory, spill_directory)),
      publications_(std::make_unique<Publications>(records_in_memory, spill_directory)),
      deliveries_of_(std::make_unique<Deliveries>(records_in_memory, spill_directory)),
      far_deliveries_(records_in_memory, spill_directory),
      lone_takes_(records_in_memory, spill_directory) {}

bool RecordedRun::ByStart::operator()(const KeptInstance& a, const KeptInstance& b) const {
  const auto a_start = shifted(shifts, a.thread, a.start);
  const auto b_start = shifted(shifts, b.thread, b.start);
  if (a_start != b_start) return a_start < b_start;
  const auto key = [](const KeptInstance& i) {
    const bool is_ended = i.numbers.is_known(KeptInstance::end);
    // The length, so that it holds of whatever clock. The index last: what is equal until there keeps the order in which it came.
    return std::tuple(is_ended ? i.start - i.numbers.value(KeptInstance::end) : -kNever, i.thread,
                      i.name, i.seq, i.index);
  };
  return key(a) < key(b);
}

bool RecordedRun::ByMessage::operator()(const Message& a, const Message& b) const {
  const auto key = [](const Message& m) {
    return std::tuple(m.key.writer_gid, m.key.source_timestamp, m.is_take, m.time, m.index);
  };
  return key(a) < key(b);
}

std::optional<std::int64_t> RecordedRun::first_time(const CommonClock& clock) const {
  std::optional<std::int64_t> first;
  for (std::uint32_t thread = 0; thread < first_times_.size(); ++thread) {
    const auto time = clock.of(threads_.thread(thread).host, first_times_[thread]);
    first = std::min(first.value_or(time), time);
  }
  return first;
}

void RecordedRun::note_time(std::uint32_t thread, std::int64_t time) {
  if (thread >= first_times_.size()) first_times_.resize(thread + 1, kNever);
  first_times_[thread] = std::min(first_times_[thread], time);
}

bool RecordedRun::add(const Instance& instance) {
  if (instance.start.ns < 0 || (instance.end && *instance.end < instance.start)) {
    ++skipped_;
    return false;
  }
  const auto earliest =
      instance.release ? std::min(*instance.release, instance.start) : instance.start;
  auto kept = KeptInstance::of(instance);
  kept.index = takes_seen_message_.size();
  kept.name = callbacks_.number(instance.logical_id, instance.callback);
  kept.thread = threads_.number(thread_of(instance));
  note_time(kept.thread, std::max<std::int64_t>(earliest.ns, 0));
  instances_->add(kept);
  takes_seen_message_.push_back(false);
  if (instance.writer_gid == 0) return true;  // it took no message
  const MessageKey message{instance.writer_gid, instance.source_timestamp_realtime_ns};
  if (auto* const publication = window_.find(message); publication != nullptr) {
    deliver(*publication, instance.start.ns, kept.index, kept.thread);
  } else {
    lone_takes_.add({.key = message,
                     .is_take = true,
                     .thread = kept.thread,
                     .time = instance.start.ns,
                     .index = kept.index});
  }
  return true;
}

bool RecordedRun::add(const Publication& publication) {
  if (publication.time.ns < 0) {
    ++skipped_;
    return false;
  }
  auto kept = KeptPublication::of(publication);
  kept.index = published_++;
  kept.topic = topics_.number(publication.topic, publication.publisher_id);
  kept.thread = threads_.number(thread_of(publication));
  note_time(kept.thread, kept.time);
  publications_->add(kept);
  if (publication.writer_gid != 0) {
    // A second publication of the same message (a damaged trace) has no receivers of its own.
    window_.add({publication.writer_gid, publication.source_timestamp_realtime_ns},
                {.time = kept.time, .index = kept.index, .thread = kept.thread});
  }
  return true;
}

void RecordedRun::deliver(Published& publication, std::int64_t time, std::uint64_t receiver,
                          std::uint32_t thread) {
  const Delivery delivery{.time = publication.time,
                          .publication = publication.index,
                          .receiver = receiver,
                          .thread = publication.thread};
  const bool is_far = publication.thread != thread &&
                      threads_.thread(publication.thread).host != threads_.thread(thread).host;
  if (!is_far && time < publication.time) {
    ++backward_deliveries_;
  } else if (publication.receivers++ >= kMostReceivers) {
    return;
  } else if (is_far) {
    far_deliveries_.add({.delivery = delivery, .taken = time, .thread = thread});
  } else {
    keep(delivery);
  }
}

void RecordedRun::keep(const Delivery& delivery) {
  deliveries_of_->add(delivery);
  takes_seen_message_[delivery.receiver] = true;
  ++deliveries_;
}

template <typename Sorter, typename Less>
void RecordedRun::sort_again(std::unique_ptr<Sorter>& sorter, Less less) {
  less.shifts = &shifts_;
  auto again = std::make_unique<Sorter>(records_in_memory_, spill_directory_, less);
  sorter->drain([&](const auto& record) { again->add(record); });
  sorter = std::move(again);
}

void RecordedRun::prepare(const CommonClock& clock) {
  if (clock.is_shifted()) {
    for (const auto& thread : threads_.all())
      shifts_.push_back(clock.shift_of(thread.host));
  }
  join_the_rest();
  far_deliveries_.drain([this](const FarDelivery& far) {
    const auto& delivery = far.delivery;
    if (shifted(far.thread, far.taken) < shifted(delivery.thread, delivery.time)) {
      ++backward_deliveries_;
    } else {
      keep(delivery);
    }
  });
  if (shifts_.empty()) return;
  sort_again(instances_, ByStart{});
  sort_again(publications_, ByTime{});
  sort_again(deliveries_of_, ByPublication{});
}

void RecordedRun::join_the_rest() {
  if (lone_takes_.size() == 0) return;
  // The publications are read for this, and kept again for replay().
  auto again = std::make_unique<Publications>(records_in_memory_, spill_directory_);
  auto& messages = lone_takes_;
  publications_->drain([&](const KeptPublication& p) {
    again->add(p);
    if (p.writer_gid != 0) {
      messages.add({.key = {p.writer_gid, p.source_timestamp},
                    .thread = p.thread,
                    .time = p.time,
                    .index = p.index});
    }
  });
  publications_ = std::move(again);
  MessageKey key;
  Published publication;
  messages.drain([&](const Message& record) {
    if (record.is_take) {
      if (record.key == key) deliver(publication, record.time, record.index, record.thread);
    } else if (record.key != key) {
      key = record.key;
      publication = {.time = record.time, .index = record.index, .thread = record.thread};
    }
  });
}

bool RecordedRun::take_publication(RecordedPublication& publication) {
  const auto* const next = publications_->front();
  if (next == nullptr) return false;
  publication = next->restored(threads_);
  receivers_.clear();
  for (const auto* delivery = deliveries_of_->front();
       delivery != nullptr && delivery->publication == next->index;
       delivery = deliveries_of_->front()) {
    receivers_.push_back(delivery->receiver);
    deliveries_of_->pop();
  }
  publications_->pop();
  publication.receivers = receivers_;
  return true;
}

}  // namespace cie::viewer_export
