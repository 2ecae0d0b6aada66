#include <algorithm>
#include <atomic>
#include <thread>
#include <utility>

#include <rmw_double/bus.hpp>
#include <time.h>

namespace rmw_double {
namespace {

std::atomic<bool> loans{false};

std::int64_t realtime_now() {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

bool go_together(const rmw_qos_profile_t& writer, const rmw_qos_profile_t& reader) {
  return writer.reliability == rmw_qos_reliability_policy_t::Reliable ||
         reader.reliability == rmw_qos_reliability_policy_t::BestEffort;
}

}  // namespace

void set_loans(bool are_loaned) { loans.store(are_loaned); }
bool are_loaned() { return loans.load(); }

void Notice::set(Told told, std::optional<std::size_t> bound) {
  const std::lock_guard lock{mutex_};
  told_.swap(told);
  const std::size_t missed = std::exchange(missed_, 0);
  if (missed > 0) told_(std::min(missed, bound.value_or(missed)));
}

void Notice::clear() {
  Told told;
  const std::lock_guard lock{mutex_};
  told_.swap(told);
}

void Notice::end() {
  Told told;
  const std::lock_guard lock{mutex_};
  told_.swap(told);
  has_ended_ = true;
}

bool Notice::is_set() {
  const std::lock_guard lock{mutex_};
  return told_ != nullptr;
}

void Notice::raise() {
  const std::lock_guard lock{mutex_};
  if (has_ended_) return;
  if (told_) {
    told_(1);
  } else {
    ++missed_;
  }
}

void Reader::set_on_new(void (*callback)(const void*, std::size_t), const void* user_data) {
  if (callback == nullptr) {
    notice.clear();
    return;
  }
  const auto told = [callback, user_data](std::size_t count) { callback(user_data, count); };
  notice.set(told, bounds_missed_ ? std::optional{bound()} : std::nullopt);
}

void Reader::store(Sample sample) {
  {
    const std::lock_guard lock{mutex_};
    if (bound() > 0 && samples_.size() == bound()) samples_.pop_front();
    sample.info.received_timestamp = realtime_now();
    samples_.push_back(std::move(sample));
  }
  notice.raise();
}

std::optional<Sample> Reader::take() {
  const std::lock_guard lock{mutex_};
  if (samples_.empty()) return std::nullopt;
  auto sample = std::move(samples_.front());
  samples_.pop_front();
  return sample;
}

void Event::raise(int count) {
  {
    const std::lock_guard lock{mutex_};
    count_.total += count;
    count_.change += count;
  }
  notice.raise();
}

std::optional<Event::Count> Event::take() {
  const std::lock_guard lock{mutex_};
  if (count_.change == 0) return std::nullopt;
  const Count taken = count_;
  count_.change = 0;
  return taken;
}

// Never destroyed: its thread runs until the process ends, as it may while others still send.
Bus& Bus::get() {
  static Bus& bus = *[] {
    auto* const made = new Bus;
    std::thread{[made] { made->run(); }}.detach();
    return made;
  }();
  return bus;
}

void Bus::run() {
  while (true) {
    std::function<void()> job;
    {
      std::unique_lock lock{mutex_};
      changed_.wait(lock, [this] { return !jobs_.empty(); });
      job = std::move(jobs_.front());
      jobs_.pop_front();
    }
    job();
  }
}

void Bus::deliver(std::function<void()> job) {
  {
    const std::lock_guard lock{mutex_};
    jobs_.push_back(std::move(job));
  }
  changed_.notify_one();
}

std::uint64_t Bus::new_gid() {
  const std::lock_guard lock{mutex_};
  return next_gid_++;
}

std::vector<End> Bus::other_ends(const std::string& topic, bool readers) {
  const std::lock_guard lock{mutex_};
  auto& all = ends_[topic];
  std::erase_if(all, [](const End& end) { return end.owner.expired(); });
  std::vector<End> found;
  std::ranges::copy_if(all, std::back_inserter(found),
                       [&](const End& end) { return (end.reader.lock() != nullptr) == readers; });
  return found;
}

void Bus::join(const std::string& topic, End end) {
  const bool writes = end.reader.expired();
  for (const End& other : other_ends(topic, writes)) {
    if (go_together(writes ? end.qos : other.qos, writes ? other.qos : end.qos)) continue;
    for (const auto& event : {end.incompatible, other.incompatible}) {
      deliver([event] {
        if (const auto alive = event.lock()) alive->raise();
      });
    }
  }
  const std::lock_guard lock{mutex_};
  ends_[topic].push_back(std::move(end));
}

void Bus::leave(const std::string& topic, const std::shared_ptr<void>& owner) {
  rmw_qos_profile_t qos{};
  {
    const std::lock_guard lock{mutex_};
    auto& all = ends_[topic];
    const auto left =
        std::ranges::find_if(all, [&](const End& end) { return end.owner.lock() == owner; });
    qos = left->qos;
    all.erase(left);
  }
  const auto writers = other_ends(topic, false);
  for (const End& reader : other_ends(topic, true)) {
    const auto is_heard = [&reader](const End& writer) {
      return go_together(writer.qos, reader.qos);
    };
    if (!go_together(qos, reader.qos) || std::ranges::any_of(writers, is_heard)) continue;
    deliver([to = reader.reader] {
      if (const auto alive = to.lock()) alive->notice.raise();
    });
  }
}

std::size_t Bus::readers(const std::string& topic, const rmw_qos_profile_t& writer) {
  const auto all = other_ends(topic, true);
  return static_cast<std::size_t>(std::ranges::count_if(
      all, [&writer](const End& reader) { return go_together(writer, reader.qos); }));
}

void Bus::write(const std::string& topic, const rmw_qos_profile_t& writer, Sample sample) {
  sample.info.source_timestamp = realtime_now();
  for (const End& reader : other_ends(topic, true)) {
    if (!go_together(writer, reader.qos)) continue;
    deliver([to = reader.reader, sample] {
      if (const auto alive = to.lock()) alive->store(sample);
    });
  }
}

void Bus::add_process_publisher(std::uint64_t gid) {
  const std::lock_guard lock{mutex_};
  process_publishers_.insert(gid);
}
void Bus::remove_process_publisher(std::uint64_t gid) {
  const std::lock_guard lock{mutex_};
  process_publishers_.erase(gid);
}
bool Bus::is_process_publisher(std::uint64_t gid) {
  const std::lock_guard lock{mutex_};
  return process_publishers_.contains(gid);
}

void Bus::join_process(const std::string& topic, std::weak_ptr<void> subscription) {
  const std::lock_guard lock{mutex_};
  in_process_[topic].push_back(std::move(subscription));
}

std::vector<std::shared_ptr<void>> Bus::process_subscriptions(const std::string& topic) {
  const std::lock_guard lock{mutex_};
  std::vector<std::shared_ptr<void>> found;
  for (const auto& each : in_process_[topic]) {
    if (auto alive = each.lock()) found.push_back(std::move(alive));
  }
  return found;
}

}  // namespace rmw_double
