// The objects of trace.hpp: each is a place in the registry.
#include <cie/tracepoints/trace.hpp>

#include "base/clock.hpp"
#include "registry.hpp"
#include "state.hpp"

#include <utility>

#include <sys/syscall.h>
#include <unistd.h>

namespace cie::trace {
namespace {

std::uint32_t current_tid() noexcept { return static_cast<std::uint32_t>(syscall(SYS_gettid)); }

// When the calling thread was announced first. The thread that a child of fork() begins with is
// another one than the parent's that it copies.
std::int64_t start_of_current_thread() noexcept {
  struct FirstAnnouncement {
    std::uint32_t tid = 0;
    std::int64_t time_ns = 0;
  };
  thread_local FirstAnnouncement first;
  const std::uint32_t tid = current_tid();
  if (first.tid != tid) first = {.tid = tid, .time_ns = now_ns(CLOCK_MONOTONIC)};
  return first.time_ns;
}

}  // namespace

Run::Run(ExecutorKind executor, std::string_view spec_sha256)
    : generation_(Registry::instance().begin_run(*this, executor, spec_sha256)) {}

Run::~Run() { Registry::instance().end_run(*this, generation_); }

void Run::set_status(std::int32_t status) noexcept {
  Registry::instance().set_status(*this, generation_, status);
}

void Run::set_spec(std::string_view spec_sha256) {
  Registry::instance().set_spec(generation_, spec_sha256);
}

Node::Node(std::string_view name) : id_(Registry::instance().add_node(name)) {}

Node::~Node() { Registry::instance().remove_node(id_); }

Group::Group(NodeId node, GroupType type) : id_(Registry::instance().add_group(node, type)) {}

Group::~Group() { Registry::instance().remove_group(id_); }

std::string unique_logical_id(std::string_view base) {
  return Registry::instance().unique_logical_id(base);
}

Callback::Callback(CallbackInfo info)
    : id_(), state_(Registry::instance().add_callback(std::move(info))) {
  id_ = state_->id;
}

Callback::~Callback() { Registry::instance().remove_callback(id_); }

void register_again(CallbackId callback) { Registry::instance().register_again(callback); }

Publisher::Publisher(NodeId node, std::string_view topic, std::uint64_t writer_gid,
                     std::uint32_t queue_depth)
    : id_(), state_(Registry::instance().add_publisher(node, topic, writer_gid, queue_depth)) {
  id_ = state_->id;
}

Publisher::~Publisher() { Registry::instance().remove_publisher(id_); }

Thread::Thread(ThreadRole role, CallbackId callback, GroupId group, std::string_view name,
               std::uint32_t tid)
    : tid_(tid != 0 ? tid : current_tid()),
      state_(Registry::instance().add_thread(
          {.role = role,
           .callback = callback,
           .group = group,
           .name = std::string(name),
           .tid = tid_,
           .start_ns = tid == 0 ? start_of_current_thread() : now_ns(CLOCK_MONOTONIC),
           .created_ticks = created_ticks(tid_),
           .read_backs = 0,
           .change = 0,
           .unsent = {}})) {}

Thread::~Thread() {
  emit_sched(SchedMoment::audit, 0);
  Registry::instance().remove_thread(state_.get());
}

std::optional<SchedReadBack> Thread::emit_sched(SchedMoment moment, std::int32_t error) {
  // Who reads itself back, as most do when they begin, is there.
  const bool is_own = tid_ == current_tid() && state_->start_ns == start_of_current_thread();
  std::optional<SchedReadBack> parameters = is_own ? read_back(tid_) : read_back(*state_);
  if (parameters) {
    Registry::instance().record_sched(*state_, moment, error, *parameters);
  }
  return parameters;
}

void Thread::begin_change() {
  Registry::instance().begin_change(*state_);
  emit_sched(SchedMoment::audit, 0);
}

}  // namespace cie::trace
