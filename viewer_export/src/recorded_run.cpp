#include "recorded_run.hpp"

#include <algorithm>

namespace cie::viewer_export {
namespace {

using analysis::Instance;
using analysis::Publication;

constexpr std::size_t kMostReceivers = 4096;  // of one publication
constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

}  // namespace

bool RecordedRun::ByStart::operator()(const RecordedInstance& a, const RecordedInstance& b) const {
  const auto key = [](const RecordedInstance& r) {
    const auto& i = r.instance;
    // The index last: what is equal until there keeps the order in which it came.
    return std::tuple(i.start, -(i.end ? i.end->ns : kNever), i.host, i.pid, i.tid, r.name, i.seq,
                      r.index);
  };
  return key(a) < key(b);
}

bool RecordedRun::ByMessage::operator()(const Message& a, const Message& b) const {
  const auto key = [](const Message& m) {
    return std::tuple(m.writer_gid, m.source_timestamp, m.is_take, m.time, m.instance,
                      m.publication.host, m.publication.pid, m.publication.tid, m.publication.seq);
  };
  return key(a) < key(b);
}

bool RecordedRun::ByTime::operator()(const Delivery& a, const Delivery& b) const {
  const auto key = [](const Delivery& d) {
    const auto& p = d.publication;
    return std::tuple(p.time, p.host, p.pid, p.tid, p.publisher_id, p.seq, p.writer_gid,
                      p.source_timestamp_realtime_ns, d.is_delivered, d.receiver);
  };
  return key(a) < key(b);
}

bool RecordedRun::is_same_message(const Message& a, const Message& b) {
  return a.writer_gid == b.writer_gid && a.source_timestamp == b.source_timestamp &&
         a.writer_gid != 0;
}

std::optional<std::int64_t> RecordedRun::first_time() const noexcept {
  return first_time_ == kNever ? std::nullopt : std::optional(first_time_);
}

bool RecordedRun::add(const Instance& instance) {
  if (instance.start.ns < 0 || (instance.end && *instance.end < instance.start)) {
    ++skipped_;
    return false;
  }
  const auto earliest =
      instance.release ? std::min(*instance.release, instance.start) : instance.start;
  first_time_ = std::min(first_time_, std::max<std::int64_t>(earliest.ns, 0));
  RecordedInstance record{.instance = instance,
                          .name = callbacks_.number(instance.logical_id, instance.callback),
                          .index = next_index_++};
  record.instance.logical_id = {};
  record.instance.preempted_by = {};
  instances_.add(record);
  if (instance.writer_gid != 0) {
    messages_.add({.writer_gid = instance.writer_gid,
                   .source_timestamp = instance.source_timestamp_realtime_ns,
                   .is_take = true,
                   .time = instance.start.ns,
                   .instance = record.index});
  }
  return true;
}

bool RecordedRun::add(const Publication& publication) {
  if (publication.time.ns < 0) {
    ++skipped_;
    return false;
  }
  first_time_ = std::min(first_time_, publication.time.ns);
  Message record{.writer_gid = publication.writer_gid,
                 .source_timestamp = publication.source_timestamp_realtime_ns,
                 .time = publication.time.ns,
                 .publication = publication,
                 .topic = topics_.number(publication.topic)};
  record.publication.topic = {};
  messages_.add(record);
  return true;
}

void RecordedRun::join_messages() {
  takes_seen_message_.resize(next_index_);
  Message publication;
  bool has_publication = false;
  std::size_t receivers = 0;
  messages_.drain([&](const Message& record) {
    if (!record.is_take) {
      publications_.add({.publication = record.publication, .topic = record.topic});
      // A second publication of the same message (a damaged trace) has no receivers of its own.
      if (has_publication && is_same_message(publication, record)) return;
      publication = record;
      has_publication = true;
      receivers = 0;
    } else if (has_publication && is_same_message(publication, record)) {
      if (record.time < publication.time) {
        ++backward_deliveries_;
      } else if (receivers++ < kMostReceivers) {
        publications_.add({.publication = publication.publication,
                           .topic = publication.topic,
                           .is_delivered = true,
                           .receiver = record.instance});
        takes_seen_message_[record.instance] = true;
        ++deliveries_;
      }
    }
  });
}

bool RecordedRun::take_publication(RecordedPublication& publication) {
  const auto* next = publications_.front();
  if (next == nullptr) return false;
  publication = {.publication = next->publication, .topic = next->topic, .receivers = {}};
  receivers_.clear();
  publications_.pop();
  for (next = publications_.front(); next != nullptr && next->is_delivered;
       next = publications_.front()) {
    receivers_.push_back(next->receiver);
    publications_.pop();
  }
  publication.receivers = receivers_;
  return true;
}

}  // namespace cie::viewer_export
