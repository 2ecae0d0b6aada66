#include "descriptions.hpp"

#include <cie/analysis/report.hpp>
#include <cie/tracepoints/ros2_profile.hpp>

#include <cstdint>
#include <optional>
#include <string>

namespace cie::analysis::ros2 {
namespace {

void enter_agnocast(Ros2Event event, const Telling& telling, const Payload& p, Process& process) {
  auto& directory = process.directory;
  const auto handle = p.number<Address>(0);
  const auto enter_callback = [&](CallbackKind kind) {
    directory.join_group(p.number<Address>(2), handle, telling);
    // The callback's own address is never spoken of again: those of its calls are.
    directory.stand_for(kind, handle, handle);
    directory.add_symbol(handle, p.text(3), telling);
  };
  switch (event) {
    case Ros2Event::agnocast_subscription:
      if (p.integer(6) == 0) break;  // a polling subscription, whose callback nobody calls
      directory.add_subscription({.handle = handle,
                                  .node = p.number<Address>(1),
                                  .topic = p.text(4),
                                  .queue_depth = p.number<std::uint32_t>(5)},
                                 telling);
      enter_callback(CallbackKind::subscription);
      process.agnocast_subscriptions[p.number<std::uint64_t>(6)] = handle;
      break;
    case Ros2Event::agnocast_timer:
      directory.add_timer(handle, p.number<std::uint64_t>(4), std::nullopt, telling);
      directory.link_timer(handle, p.number<Address>(1), telling);
      enter_callback(CallbackKind::timer);
      break;
    case Ros2Event::agnocast_callable: {
      const auto known = process.agnocast_subscriptions.find(p.number<std::uint64_t>(2));
      if (known == process.agnocast_subscriptions.end()) break;
      directory.stand_for(CallbackKind::subscription, handle, known->second);
      process.agnocast_entries[handle] = p.number<std::int64_t>(1);
      process.callables.insert(handle);
      break;
    }
    case Ros2Event::agnocast_timer_callable:
      directory.stand_for(CallbackKind::timer, handle, p.number<Address>(1));
      process.callables.insert(handle);
      break;
    default:
      break;
  }
}

// When the timer was made whose making a tracer tells now. rcl looks at the clock up to kTimerError
// before it tells, or, if the thread was preempted in between, at some time since its event before.
// Timers of this project's own executor begin to expire later.
std::optional<TimerMade> made_at(const Telling& telling, Address timer, Duration quiet) {
  if (telling.repeats || is_ros2_profile_handle(timer)) return std::nullopt;
  return TimerMade{
      .at = telling.told - kTimerError,
      .spread = std::clamp(quiet, kTimerError, kMostTimerError) - kTimerError,
  };
}

void enter_publisher(const Telling& telling, const Payload& p, Directory& directory,
                     MessageLinks& links) {
  const AnnouncedPublisher init{.handle = p.number<Address>(0),
                                .node = p.number<Address>(1),
                                .topic = p.text(2),
                                .rmw_handle = p.number<Address>(3)};
  const auto gid = links.new_gid();
  directory.add_publisher(init, gid, telling);
  if (directory.publisher(init.handle).gid == gid)
    links.topic(std::string(init.topic)).add_publisher(gid);
}

}  // namespace

void enter_begin(Address context, const Telling& telling, bool has_emitted, Process& process) {
  if (telling.repeats) {
    process.repeated_context = context;
  } else if (process.repeated_context != context) {
    process.has_begun_beside_own = process.has_own_events;
    if (has_emitted) process.directory.begin_again();
  }
}

void enter_description(Ros2Event event, const Telling& telling, const Payload& p, Process& process,
                       Duration quiet, MessageLinks& links) {
  auto& directory = process.directory;
  const auto first = p.number<Address>(0);
  const auto second = p.number<Address>(1);
  switch (event) {
    case Ros2Event::node_init:
      directory.add_node(first, p.text(1), p.text(2), telling);
      break;
    case Ros2Event::publisher_init:
      enter_publisher(telling, p, directory, links);
      break;
    case Ros2Event::subscription_init:
      directory.add_subscription({.handle = first,
                                  .node = second,
                                  .topic = p.text(2),
                                  .queue_depth = p.number<std::uint32_t>(3),
                                  .rmw_handle = p.number<Address>(4)},
                                 telling);
      break;
    case Ros2Event::subscription_object:
      directory.add_object(first, second, telling);
      break;
    case Ros2Event::subscription_callback:
      directory.add_object_callback(first, second, telling);
      break;
    case Ros2Event::service_init:
      directory.add_service(first, second, p.text(2), telling);
      break;
    case Ros2Event::service_callback:
      directory.add_handle_callback(CallbackKind::service, first, second, telling);
      break;
    case Ros2Event::client_init:
      directory.add_client(first, second, p.text(2), p.number<Address>(3), telling);
      break;
    case Ros2Event::timer_init:
      directory.add_timer(first, p.number<std::uint64_t>(1), made_at(telling, first, quiet),
                          telling);
      break;
    case Ros2Event::timer_callback:
      directory.add_handle_callback(CallbackKind::timer, first, second, telling);
      break;
    case Ros2Event::timer_node:
      directory.link_timer(first, second, telling);
      break;
    case Ros2Event::callback_symbol:
      directory.add_symbol(first, p.text(1), telling);
      break;
    case Ros2Event::executor:
      directory.add_executor(first, p.text(1));
      break;
    case Ros2Event::group:
      directory.add_group(first, p.text(1), telling);
      directory.serve_group(first, p.number<Address>(2));
      break;
    case Ros2Event::group_member:
      directory.join_group(first, second, telling);
      break;
    case Ros2Event::buffer_of_object:
      directory.link_buffer(first, second, telling);
      break;
    case Ros2Event::object_of_subscription:
      directory.link_object(first, second, telling);
      break;
    default:
      enter_agnocast(event, telling, p, process);
      break;
  }
}

}  // namespace cie::analysis::ros2
