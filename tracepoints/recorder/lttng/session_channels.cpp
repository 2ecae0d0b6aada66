#include "lttng/session_channels.hpp"

#include <cie/tracepoints/recording_layout.hpp>

#include "base/text.hpp"
#include "lttng/lttng_calls.hpp"
#include "system/error.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <iterator>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <unistd.h>

namespace cie::record {
namespace {

// How often the consumer daemon looks for full sub-buffers. With a timer for that it is not woken
// by whoever fills one: a thread that emits an event makes no system call, real-time or not.
constexpr std::chrono::milliseconds kMostReadInterval{20};
constexpr std::uint64_t kMetadataSubbufs = 2;
constexpr std::uint64_t kLiveFileSize = 8UL << 20;
constexpr std::uint64_t kLiveFiles = 16;

// For triggers only: analyzers compare with deadlines themselves.
const std::string& trigger_event() {
  static const std::string name = "cie:deadline_miss";
  return name;
}

// Everything of the provider `ros2` that describes objects.
const std::vector<std::string>& ros2_state_events() {
  static const std::vector<std::string> patterns{"ros2:*_init", "ros2:*_added",
                                                 "ros2:rclcpp_callback_register",
                                                 "ros2:rclcpp_timer_link_node"};
  return patterns;
}

using Channel = std::unique_ptr<lttng_channel, Destroyer<lttng_channel, lttng_channel_destroy>>;
using Event = std::unique_ptr<lttng_event, Destroyer<lttng_event, lttng_event_destroy>>;

template <std::size_t Size>
void copy_name(char (&to)[Size], const std::string& from) {
  if (from.size() >= Size) {
    throw RecordError("the name " + in_quotes(from) + " is too long for LTTng");
  }
  std::memcpy(to, from.c_str(), from.size() + 1);
}

// By this machine's consumer daemon, as the recording goes on.
bool is_written_here(SessionKind kind) noexcept {
  return kind == SessionKind::whole || kind == SessionKind::divided;
}

void enable_channel(lttng_handle* session, SessionKind kind, const char* name,
                    std::uint64_t subbuf_size, std::uint64_t num_subbuf,
                    std::chrono::milliseconds flush_interval) {
  lttng_domain domain = user_space();
  const Channel channel(lttng_channel_create(&domain));
  if (!channel) {
    throw RecordError(std::string("cannot create the channel \"") + name + '"');
  }
  copy_name(channel->name, name);
  channel->attr.overwrite = kind == SessionKind::snapshots ? 1 : 0;
  channel->attr.subbuf_size = subbuf_size;
  channel->attr.num_subbuf = num_subbuf;
  const auto in_us = [](std::chrono::milliseconds time) {
    return static_cast<unsigned int>(std::chrono::microseconds(time).count());
  };
  const bool is_metadata = std::string_view(name) == "metadata";  // nobody's events
  if (kind == SessionKind::snapshots) {
    // It is read when it is saved, and by nobody before: no timer.
    channel->attr.output = LTTNG_EVENT_MMAP;
  } else if (!is_metadata) {
    channel->attr.read_timer_interval = in_us(std::min(flush_interval, kMostReadInterval));
  }
  if (kind == SessionKind::live) {
    channel->attr.tracefile_size = std::max(kLiveFileSize, subbuf_size);
    channel->attr.tracefile_count = kLiveFiles;
  }
  if (is_written_here(kind)) {  // what is sent is flushed by the session's timer
    channel->attr.switch_timer_interval = in_us(flush_interval);
  }
  check(lttng_enable_channel(session, channel.get()),
        std::string("enable the channel \"") + name + '"');
}

void add_contexts(lttng_handle* session, const char* channel, const std::vector<int>& types) {
  for (const int type : types) {
    lttng_event_context context{};
    context.ctx = static_cast<lttng_event_context_type>(type);
    check(lttng_add_context(session, &context, nullptr, channel),
          std::string("say in the channel \"") + channel + "\" who emits");
  }
}

void enable_events(lttng_handle* session, const char* channel, const std::string& pattern,
                   const std::vector<std::string>& exclusions) {
  const Event event(lttng_event_create());
  if (!event) {
    throw RecordError("cannot create a rule for the events " + in_quotes(pattern));
  }
  event->type = LTTNG_EVENT_TRACEPOINT;
  event->loglevel_type = LTTNG_EVENT_LOGLEVEL_ALL;
  event->loglevel = -1;
  copy_name(event->name, pattern);
  std::vector<char*> names;
  names.reserve(exclusions.size());
  for (const std::string& exclusion : exclusions) {
    names.push_back(const_cast<char*>(exclusion.c_str()));  // only read
  }
  check(lttng_enable_event_with_exclusions(session, event.get(), channel, nullptr,
                                           static_cast<int>(names.size()),
                                           names.empty() ? nullptr : names.data()),
        "enable the events " + in_quotes(pattern));
}

constexpr const char* kRos2Provider = "ros2:*";

std::vector<std::string> ros2_patterns(Ros2Events which) {
  switch (which) {
    case Ros2Events::applications:
      return {kRos2Provider, "ros2_caret:*", "agnocast:*"};
    case Ros2Events::profile:
      return {kRos2Provider};
    case Ros2Events::no:
      break;
  }
  return {};
}

void enable_own_events(lttng_handle* session, SessionKind kind, const Options& options) {
  enable_channel(session, kind, kStateChannel, kStateSubbufSize, kStateSubbufs,
                 options.flush_interval);
  enable_channel(session, kind, kEventChannel, options.subbuf_size, options.num_subbuf,
                 options.flush_interval);
  for (const char* channel : {kStateChannel, kEventChannel}) {
    add_contexts(session, channel, {LTTNG_EVENT_CONTEXT_VPID, LTTNG_EVENT_CONTEXT_VTID});
  }
  // In a snapshot only descriptions may push out descriptions, not the clock's ticking.
  std::vector<std::string> described(kStateEvents.begin(), kStateEvents.end());
  if (kind == SessionKind::snapshots) {
    std::erase(described, "cie:clock_sync");
  }
  for (const std::string& event : described) {
    enable_events(session, kStateChannel, event, {});
  }
  std::vector<std::string> excluded = std::move(described);
  excluded.push_back(trigger_event());
  for (const std::string& pattern : options.events) {
    const bool may_match_state = pattern.find('*') != std::string::npos;
    enable_events(session, kEventChannel, pattern,
                  may_match_state ? excluded : std::vector<std::string>{});
  }
}

void enable_ros2_events(lttng_handle* session, SessionKind kind, const Options& options) {
  enable_channel(session, kind, kRos2StateChannel, kStateSubbufSize, kStateSubbufs,
                 options.flush_interval);
  enable_channel(session, kind, kRos2EventChannel, options.subbuf_size, options.num_subbuf,
                 options.flush_interval);
  std::vector<int> who{LTTNG_EVENT_CONTEXT_VPID, LTTNG_EVENT_CONTEXT_VTID,
                       LTTNG_EVENT_CONTEXT_PROCNAME};
  // Containers give the same pids; processes of this project tell their namespace themselves.
  if (options.ros2 == Ros2Events::applications) who.push_back(LTTNG_EVENT_CONTEXT_PID_NS);
  for (const char* channel : {kRos2StateChannel, kRos2EventChannel}) {
    add_contexts(session, channel, who);
  }
  for (const std::string& pattern : ros2_state_events()) {
    enable_events(session, kRos2StateChannel, pattern, {});
  }
  for (const std::string& pattern : ros2_patterns(options.ros2)) {
    enable_events(session, kRos2EventChannel, pattern,
                  pattern == kRos2Provider ? ros2_state_events() : std::vector<std::string>{});
  }
}

}  // namespace

std::vector<std::string> event_patterns(const Options& options) {
  auto patterns = options.events;
  std::ranges::move(ros2_patterns(options.ros2), std::back_inserter(patterns));
  return patterns;
}

void enable_channels(lttng_handle* session, SessionKind kind, const Options& options) {
  // LTTng writes the metadata only when the session stops, unless its channel has a switch timer:
  // with one, what a killed consumer daemon leaves behind can be read.
  // A snapshot brings its metadata along, and what is sent has a timer of the session's.
  if (is_written_here(kind)) {
    // The smallest that LTTng has.
    enable_channel(session, kind, "metadata", static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE)),
                   kMetadataSubbufs, options.flush_interval);
  }
  enable_own_events(session, kind, options);
  if (options.ros2 != Ros2Events::no) {
    enable_ros2_events(session, kind, options);
  }
}

std::uint64_t buffer_bytes_per_cpu(const Options& options) {
  const std::uint64_t bytes =
      kStateSubbufSize * kStateSubbufs + options.subbuf_size * options.num_subbuf;
  return options.ros2 != Ros2Events::no ? 2 * bytes : bytes;
}

}  // namespace cie::record
