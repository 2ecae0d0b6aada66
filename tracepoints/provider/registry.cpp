#include "registry.hpp"

#include "base/clock.hpp"
#include "inherited.hpp"
#include "provider.h"
#include "ros2_profile.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <new>
#include <utility>

#include <pthread.h>

namespace cie::trace {

namespace detail {
std::atomic<std::uint32_t> first_own_callback{0};
std::atomic<std::uint32_t> first_own_publisher{0};
std::atomic<bool> are_threads_own{true};
}  // namespace detail

namespace {

constexpr std::chrono::seconds kPatienceAtExit{1};

std::string joined_labels(const std::set<ExecutorKind>& executors) {
  std::string labels;
  for (const ExecutorKind executor : executors)
    labels.append(labels.empty() ? "" : "+").append(label(executor));
  return labels;
}

}  // namespace

// The registry's lock. The thread meets the tracer before it takes the lock: a first event
// registers the thread under a lock of LTTng's that fork() holds while it waits for ours.
class Registry::Guard {
 public:
  explicit Guard(Registry& registry) : mutex_(registry.mutex_) {
    touch_current_thread();
    mutex_.lock();
  }
  ~Guard() { mutex_.unlock(); }
  Guard(const Guard&) = delete;
  Guard& operator=(const Guard&) = delete;

 private:
  PriorityMutex& mutex_;
};

bool Registry::Live::has_objects() const noexcept {
  return !nodes.empty() || !groups.empty() || !callbacks.empty() || !publishers.empty() ||
         !threads.empty();
}

Registry& Registry::instance() {
  static Registry* const registry = new Registry;  // outlives every static object
  return *registry;
}

Registry::Registry() : live_(std::make_unique<Live>()) {
  load_profile();
  pthread_atfork(&before_fork, &after_fork_in_parent, &after_fork_in_child);
  at_process_exit([]() noexcept { instance().finish_at_exit(); });
}

std::uint64_t Registry::begin_run(const Run& run, ExecutorKind executor,
                                  std::string_view spec_sha256) {
  const Guard guard(*this);
  Live& live = *live_;
  detail::are_threads_own.store(true, std::memory_order_relaxed);
  if (!live.is_running && !is_finished_) {
    live.facts = {.process = read_process_info(),
                  .executors = {executor},
                  .executor_labels = std::string(label(executor)),
                  .spec_sha256 = std::string(spec_sha256)};
    // Before run_begin: a session that starts meanwhile is then announced to, rather than missed.
    live.announcer = std::make_unique<Announcer>(
        Announcer::Actions{.announce = [this] { announce(); },
                           .sync_clocks = [this] { sync_clocks(); },
                           .forget_ros2_readers = [this] { forget_ros2_readers(); }});
    live.is_running = true;
    emit::run_begin(live.facts, RunMoment::start);
    emit_registered();
    tell_ros2_readers();
  } else if (live.is_running && live.facts.executors.insert(executor).second) {
    live.facts.executor_labels = joined_labels(live.facts.executors);
    emit_announcement();
  }
  live.runs.emplace(&run, 0);
  return generation_;
}

void Registry::end_run(const Run& run, std::uint64_t generation) {
  std::unique_ptr<Announcer> stopped;
  const Guard guard(*this);
  if (generation == generation_) {
    const auto ended = live_->runs.extract(&run);
    live_->totals.status = std::max(live_->totals.status, ended.mapped());
    stopped = end_if_empty();
  }
}

void Registry::set_status(const Run& run, std::uint64_t generation, std::int32_t status) noexcept {
  const Guard guard(*this);
  if (generation == generation_) live_->runs.find(&run)->second = status;
}

NodeId Registry::add_node(std::string_view name) {
  const Guard guard(*this);
  const NodeId node{next_node_++};
  const auto& added = live_->nodes.emplace(node, std::string(name)).first->second;
  if (live_->is_running) {
    emit::node_init(node, added.c_str());
    if (const Ros2Profile* profile = ros2_profile()) {
      profile->node_init(node, added.c_str());
    }
  }
  return node;
}

void Registry::remove_node(NodeId node) {
  std::unique_ptr<Announcer> stopped;
  const Guard guard(*this);
  if (live_->nodes.erase(node) != 0) {
    stopped = end_if_empty();
  }
}

GroupId Registry::add_group(NodeId node, GroupType type) {
  const Guard guard(*this);
  const GroupId group{next_group_++};
  live_->groups.emplace(group, GroupRecord{.node = node, .type = type});
  if (live_->is_running) {
    ++live_->totals.groups;
    emit::group_init(group, node, type);
  }
  return group;
}

void Registry::remove_group(GroupId group) {
  std::unique_ptr<Announcer> stopped;
  const Guard guard(*this);
  if (live_->groups.erase(group) != 0) {
    stopped = end_if_empty();
  }
}

std::shared_ptr<CallbackState> Registry::add_callback(CallbackInfo info) {
  const Guard guard(*this);
  const auto group = live_->groups.find(info.group);
  const bool may_overlap =
      group == live_->groups.end() || group->second.type != GroupType::mutually_exclusive;
  const CallbackId id{next_callback_++};
  auto callback = std::make_shared<CallbackState>(id, std::move(info), may_overlap);
  live_->callbacks.emplace(id, callback);
  if (live_->is_running) {
    ++live_->totals.callbacks;
    emit::callback_init(*callback);
    if (const Ros2Profile* profile = ros2_profile()) {
      profile->callback_init(*callback);
    }
  }
  return callback;
}

// In the profile `ros2` nothing is told: readers would take it for another callback.
void Registry::register_again(CallbackId callback) {
  const Guard guard(*this);
  const auto found = live_->callbacks.find(callback);
  if (live_->is_running && found != live_->callbacks.end()) emit::callback_init(*found->second);
}

void Registry::remove_callback(CallbackId callback) {
  std::unique_ptr<Announcer> stopped;
  const Guard guard(*this);
  const auto found = live_->callbacks.find(callback);
  if (found == live_->callbacks.end()) {
    return;
  }
  if (live_->is_running) {
    emit::callback_fini(*found->second);
  }
  live_->logical_ids.erase(found->second->info.logical_id);
  live_->callbacks.erase(found);
  stopped = end_if_empty();
}

std::shared_ptr<PublisherState> Registry::add_publisher(NodeId node, std::string_view topic,
                                                        std::uint64_t writer_gid,
                                                        std::uint32_t queue_depth) {
  const Guard guard(*this);
  const PublisherId id{next_publisher_++};
  auto publisher = std::make_shared<PublisherState>(id, node, topic, writer_gid, queue_depth);
  live_->publishers.emplace(id, publisher);
  if (live_->is_running) {
    ++live_->totals.publishers;
    emit::publisher_init(*publisher);
    if (const Ros2Profile* profile = ros2_profile()) {
      profile->publisher_init(*publisher);
    }
  }
  return publisher;
}

void Registry::remove_publisher(PublisherId publisher) {
  std::unique_ptr<Announcer> stopped;
  const Guard guard(*this);
  const auto found = live_->publishers.find(publisher);
  if (found == live_->publishers.end()) {
    return;
  }
  if (live_->is_running) {
    emit::publisher_fini(*found->second);
  }
  live_->publishers.erase(found);
  stopped = end_if_empty();
}

std::shared_ptr<ThreadState> Registry::add_thread(ThreadState thread) {
  auto added = std::make_shared<ThreadState>(std::move(thread));
  const Guard guard(*this);
  // A spin within a callback: told as another thread, beside that of the callback.
  const bool is_nested = std::ranges::any_of(
      live_->threads, [&added](const auto& other) { return other->tid == added->tid; });
  if (is_nested) added->start_ns = now_ns(CLOCK_MONOTONIC);
  live_->threads.push_back(added);
  if (live_->is_running) {
    ++live_->totals.threads;
    emit::thread_init(*added);
  }
  return added;
}

void Registry::remove_thread(const ThreadState* thread) {
  std::unique_ptr<Announcer> stopped;
  const Guard guard(*this);
  const auto found = std::ranges::find(live_->threads, thread, &std::shared_ptr<ThreadState>::get);
  if (found == live_->threads.end()) {
    return;
  }
  if (live_->is_running) {
    emit::thread_fini(**found);
  }
  live_->threads.erase(found);
  stopped = end_if_empty();
}

void Registry::record_sched(ThreadState& thread, SchedMoment moment, std::int32_t error,
                            const SchedReadBack& parameters) {
  SchedRecord record{.moment = moment, .error = error, .parameters = parameters};
  const Guard guard(*this);
  record.n = thread.read_backs++;
  record.change = thread.change;
  if (live_->is_running) {
    emit::thread_sched(thread, record);
  } else {
    thread.unsent.push_back(std::move(record));
  }
}

void Registry::begin_change(ThreadState& thread) {
  const Guard guard(*this);
  ++thread.change;
}

void Registry::set_spec(std::uint64_t generation, std::string_view spec_sha256) {
  const Guard guard(*this);
  if (generation != generation_ || !live_->is_running) {
    return;
  }
  live_->facts.spec_sha256 = spec_sha256;
  emit_announcement();
}

std::string Registry::unique_logical_id(std::string_view base) {
  const Guard guard(*this);
  std::string id(base);
  for (std::uint32_t number = 2; !live_->logical_ids.insert(id).second; ++number)
    id = std::string(base) + '#' + std::to_string(number);
  return id;
}

void Registry::announce() {
  const Guard guard(*this);
  if (!live_->is_running) {
    return;
  }
  emit_announcement();
  tell_ros2_readers();
  for (const auto& thread : live_->threads) {
    if (auto parameters = read_back(*thread)) {  // else it ended unannounced: nothing to say
      emit::thread_sched(*thread, {.moment = SchedMoment::audit,
                                   .n = thread->read_backs++,
                                   .error = 0,
                                   .change = thread->change,
                                   .parameters = std::move(*parameters)});
    }
  }
  emit::clock_sync();
}

void Registry::sync_clocks() {
  const Guard guard(*this);
  if (live_->is_running) {
    emit::clock_sync();
  }
}

// Of each callback, readers take the next `callback_init` after `run_begin` for a repetition, and a
// later one for a new registration: so the two belong together.
void Registry::emit_announcement() const {
  emit::run_begin(live_->facts, RunMoment::announce);
  emit_everything();
}

// At run_begin: everything registered before it counts and is emitted now, with what was read back.
void Registry::emit_registered() {
  Live& live = *live_;
  live.totals.groups += static_cast<std::uint32_t>(live.groups.size());
  live.totals.callbacks += static_cast<std::uint32_t>(live.callbacks.size());
  live.totals.publishers += static_cast<std::uint32_t>(live.publishers.size());
  live.totals.threads += static_cast<std::uint32_t>(live.threads.size());
  emit_everything();
  for (const auto& thread : live.threads) {
    for (const SchedRecord& record : thread->unsent) {
      emit::thread_sched(*thread, record);
    }
    thread->unsent.clear();
  }
}

void Registry::emit_everything() const {
  for (const auto& [id, name] : live_->nodes) {
    emit::node_init(id, name.c_str());
  }
  for (const auto& [id, group] : live_->groups) {
    emit::group_init(id, group.node, group.type);
  }
  for (const auto& [id, callback] : live_->callbacks) {
    emit::callback_init(*callback);
    // No other event tells who attached of those before.
    const auto lost = callback->lost.load(std::memory_order_acquire);
    if (lost != 0) emit::sample_lost(id, 0, lost);
  }
  for (const auto& [id, publisher] : live_->publishers) {
    emit::publisher_init(*publisher);
  }
  for (const auto& thread : live_->threads) {
    emit::thread_init(*thread);
  }
}

// Unless they were told already, or there are none.
void Registry::tell_ros2_readers() {
  Live& live = *live_;
  const Ros2Profile* const profile = ros2_profile();
  if (profile == nullptr || live.is_told_to_ros2_readers || !profile->is_enabled()) {
    return;
  }
  live.is_told_to_ros2_readers = true;
  profile->run_begin();
  for (const auto& [id, name] : live.nodes) {
    profile->node_init(id, name.c_str());
  }
  for (const auto& [id, callback] : live.callbacks) {
    profile->callback_init(*callback);
  }
  for (const auto& [id, publisher] : live.publishers) {
    profile->publisher_init(*publisher);
  }
}

void Registry::forget_ros2_readers() {
  const Guard guard(*this);
  live_->is_told_to_ros2_readers = false;
}

// The announcer is handed out because its thread may be waiting for the lock: the caller destroys
// it after the lock is released.
std::unique_ptr<Announcer> Registry::end_if_empty() {
  Live& live = *live_;
  if (!live.is_running || !live.runs.empty() || live.has_objects()) {
    return nullptr;
  }
  live.is_running = false;
  emit::clock_sync();
  emit::run_end(live.totals);
  return std::move(live.announcer);
}

void Registry::finish_at_exit() noexcept {
  touch_current_thread();
  if (!mutex_.try_lock_for(kPatienceAtExit)) {
    return;  // exit() was called with the lock held, from a signal handler: no run_end, no deadlock
  }
  Live& live = *live_;
  is_finished_ = true;
  std::unique_ptr<Announcer> announcer = std::move(live.announcer);
  if (live.is_running) {
    live.is_running = false;
    for (const auto& [id, callback] : live.callbacks) {
      emit::callback_fini(*callback);
    }
    for (const auto& [id, publisher] : live.publishers) {
      emit::publisher_fini(*publisher);
    }
    for (const auto& thread : live.threads) {
      emit::thread_fini(*thread);
    }
    for (const auto& [run, status] : live.runs) {
      live.totals.status = std::max(live.totals.status, status);
    }
    emit::clock_sync();
    emit::run_end(live.totals);
  }
  mutex_.unlock();
}

void Registry::before_fork() { instance().mutex_.lock(); }

void Registry::after_fork_in_parent() { instance().mutex_.unlock(); }

// The child has none of the parent's threads and runs none of its callbacks. What it inherited is
// forgotten, not destroyed: the announcer's thread does not exist here, and the inherited lock has
// an owner that does not either.
void Registry::after_fork_in_child() {
  Registry& registry = instance();
  new (&registry.mutex_) PriorityMutex;
  static_cast<void>(registry.live_.release());
  registry.live_ = std::make_unique<Live>();
  ++registry.generation_;
  detail::first_own_callback.store(registry.next_callback_, std::memory_order_relaxed);
  detail::first_own_publisher.store(registry.next_publisher_, std::memory_order_relaxed);
  detail::are_threads_own.store(false, std::memory_order_relaxed);
}

}  // namespace cie::trace
