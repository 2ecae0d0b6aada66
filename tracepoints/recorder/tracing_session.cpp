#include "tracing_session.hpp"

#include "error.hpp"
#include "manifest.hpp"
#include "processes.hpp"
#include "stream_check.hpp"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string_view>
#include <thread>

#include <lttng/lttng.h>

namespace cie::record {
namespace {

constexpr std::chrono::seconds kDrainPatience{60};
constexpr std::chrono::milliseconds kDrainPoll{10};
constexpr std::uint64_t kStateSubbufSize = 512UL * 1024;
constexpr std::uint64_t kStateSubbufs = 4;
// How often the consumer daemon looks for full sub-buffers. With a timer for that it is not woken
// by whoever fills one: a thread that emits an event makes no system call, real-time or not.
constexpr std::chrono::milliseconds kMostReadInterval{20};
constexpr std::uint64_t kMetadataSubbufSize = 4096;
constexpr std::uint64_t kMetadataSubbufs = 2;
constexpr std::uint64_t kLiveFileSize = 8UL << 20;
constexpr std::uint64_t kLiveFiles = 16;

const std::vector<std::string>& state_events() {
  static const std::vector<std::string> names{"cie:run_begin",
                                              "cie:run_end",
                                              "cie:node_init",
                                              "cie:group_init",
                                              "cie:callback_init",
                                              "cie:callback_fini",
                                              "cie:publisher_init",
                                              "cie:publisher_fini",
                                              "cie:thread_init",
                                              "cie:thread_fini",
                                              "cie:thread_sched",
                                              "cie:clock_sync",
                                              "lttng_ust_statedump:procname"};
  return names;
}

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

// LTTng's functions return a negative error code, or, the older ones, a positive LTTNG_OK.
void check(int result, const std::string& operation) {
  if (result < 0) {
    throw RecordError("cannot " + operation + ": " + lttng_strerror(result));
  }
}

template <typename T, void (*Destroy)(T*)>
struct Destroyer {
  void operator()(T* object) const noexcept { Destroy(object); }
};
using Channel = std::unique_ptr<lttng_channel, Destroyer<lttng_channel, lttng_channel_destroy>>;
using Event = std::unique_ptr<lttng_event, Destroyer<lttng_event, lttng_event_destroy>>;
using Descriptor =
    std::unique_ptr<lttng_session_descriptor,
                    Destroyer<lttng_session_descriptor, lttng_session_descriptor_destroy>>;
using Destruction =
    std::unique_ptr<lttng_destruction_handle,
                    Destroyer<lttng_destruction_handle, lttng_destruction_handle_destroy>>;

struct Free {
  void operator()(void* memory) const noexcept { std::free(memory); }
};

lttng_domain user_space() {
  lttng_domain domain{};
  domain.type = LTTNG_DOMAIN_UST;
  domain.buf_type = LTTNG_BUFFER_PER_UID;
  return domain;
}

template <std::size_t Size>
void copy_name(char (&to)[Size], const std::string& from) {
  if (from.size() >= Size) {
    throw RecordError("the name " + in_quotes(from) + " is too long for LTTng");
  }
  std::memcpy(to, from.c_str(), from.size() + 1);
}

}  // namespace

void TracingSession::HandleDeleter::operator()(lttng_handle* handle) const noexcept {
  lttng_destroy_handle(handle);
}

TracingSession::TracingSession(const std::string& name, const Options& options)
    : name_(name),
      directory_(options.directory),
      is_snapshot_(options.snapshot.has_value()),
      is_divided_(options.rotate.has_value()) {
  const Descriptor descriptor(is_snapshot_ ? lttng_session_descriptor_snapshot_create(name.c_str())
                                           : lttng_session_descriptor_local_create(
                                                 name.c_str(), options.directory.c_str()));
  const auto operation = "cannot create a session in " + in_quotes(options.directory);
  if (!descriptor) throw RecordError(operation + ": LTTng does not accept the path");
  create(descriptor.get(), operation, options);
}

TracingSession::TracingSession(const std::string& name, const Options& options,
                               const RelayDestination& destination)
    : name_(name), is_live_(true), keeps_all_(destination.keeps_all) {
  const auto interval = std::chrono::microseconds(destination.interval).count();
  const Descriptor descriptor(lttng_session_descriptor_live_network_create(
      name.c_str(), destination.control_url.c_str(), destination.data_url.c_str(),
      static_cast<unsigned long long>(interval)));
  const auto operation = "cannot create a session that sends to " + destination.control_url;
  if (!descriptor) throw RecordError(operation);
  create(descriptor.get(), operation, options);
}

void TracingSession::create(lttng_session_descriptor* descriptor, const std::string& operation,
                            const Options& options) {
  const lttng_error_code created = lttng_create_session_ext(descriptor);
  if (created != LTTNG_OK) throw RecordError(operation + ": " + lttng_strerror(-created));
  exists_ = true;
  try {
    set_up(options);
  } catch (...) {
    lttng_destroy_session_no_wait(name_.c_str());
    throw;
  }
}

void TracingSession::set_up(const Options& options) {
  lttng_domain domain = user_space();
  handle_.reset(lttng_create_handle(name_.c_str(), &domain));
  if (!handle_) {
    throw RecordError("cannot create a handle of the session " + in_quotes(name_));
  }

  // LTTng writes the metadata only when the session stops, unless its channel has a switch timer:
  // with one, what a killed consumer daemon leaves behind can be read.
  // A snapshot brings its metadata along, a live session sends it by itself.
  if (!is_snapshot_ && !is_live_) {
    enable_channel("metadata", kMetadataSubbufSize, kMetadataSubbufs, options.flush_interval);
  }
  enable_own_events(options);
  if (options.has_ros2_profile) {
    enable_ros2_events(options);
  }
}

void TracingSession::enable_own_events(const Options& options) {
  enable_channel(kStateChannel, kStateSubbufSize, kStateSubbufs, options.flush_interval);
  enable_channel(kEventChannel, options.subbuf_size, options.num_subbuf, options.flush_interval);
  for (const char* channel : {kStateChannel, kEventChannel}) {
    add_contexts(channel, {LTTNG_EVENT_CONTEXT_VPID, LTTNG_EVENT_CONTEXT_VTID});
  }
  // In a snapshot only descriptions may push out descriptions, not the clock's ticking.
  std::vector<std::string> described = state_events();
  if (is_snapshot_) {
    std::erase(described, "cie:clock_sync");
  }
  for (const std::string& event : described) {
    enable_events(kStateChannel, event, {});
  }
  std::vector<std::string> excluded = std::move(described);
  excluded.push_back(trigger_event());
  for (const std::string& pattern : options.events) {
    const bool may_match_state = pattern.find('*') != std::string::npos;
    enable_events(kEventChannel, pattern, may_match_state ? excluded : std::vector<std::string>{});
  }
}

void TracingSession::enable_ros2_events(const Options& options) {
  enable_channel(kRos2StateChannel, kStateSubbufSize, kStateSubbufs, options.flush_interval);
  enable_channel(kRos2EventChannel, options.subbuf_size, options.num_subbuf,
                 options.flush_interval);
  for (const char* channel : {kRos2StateChannel, kRos2EventChannel}) {
    add_contexts(channel, {LTTNG_EVENT_CONTEXT_VPID, LTTNG_EVENT_CONTEXT_VTID,
                           LTTNG_EVENT_CONTEXT_PROCNAME});
  }
  for (const std::string& pattern : ros2_state_events()) {
    enable_events(kRos2StateChannel, pattern, {});
  }
  enable_events(kRos2EventChannel, "ros2:*", ros2_state_events());
}

TracingSession::~TracingSession() {
  if (exists_) {
    lttng_destroy_session_no_wait(name_.c_str());
  }
}

void TracingSession::enable_channel(const char* name, std::uint64_t subbuf_size,
                                    std::uint64_t num_subbuf,
                                    std::chrono::milliseconds flush_interval) {
  lttng_domain domain = user_space();
  const Channel channel(lttng_channel_create(&domain));
  if (!channel) {
    throw RecordError(std::string("cannot create the channel \"") + name + '"');
  }
  copy_name(channel->name, name);
  channel->attr.overwrite = is_snapshot_ ? 1 : 0;
  channel->attr.subbuf_size = subbuf_size;
  channel->attr.num_subbuf = num_subbuf;
  const auto in_us = [](std::chrono::milliseconds time) {
    return static_cast<unsigned int>(std::chrono::microseconds(time).count());
  };
  const bool is_metadata = std::string_view(name) == "metadata";  // nobody's events
  if (is_snapshot_) {
    // It is read when it is saved, and by nobody before: no timer.
    channel->attr.output = LTTNG_EVENT_MMAP;
  } else if (!is_metadata) {
    channel->attr.read_timer_interval = in_us(std::min(flush_interval, kMostReadInterval));
  }
  if (!keeps_all_) {
    channel->attr.tracefile_size = std::max(kLiveFileSize, subbuf_size);
    channel->attr.tracefile_count = kLiveFiles;
  }
  if (!is_snapshot_ && !is_live_) {  // a live session's own timer flushes
    channel->attr.switch_timer_interval = in_us(flush_interval);
  }
  check(lttng_enable_channel(handle_.get(), channel.get()),
        std::string("enable the channel \"") + name + '"');
}

void TracingSession::add_contexts(const char* channel, const std::vector<int>& types) {
  for (const int type : types) {
    lttng_event_context context{};
    context.ctx = static_cast<lttng_event_context_type>(type);
    check(lttng_add_context(handle_.get(), &context, nullptr, channel),
          std::string("say in the channel \"") + channel + "\" who emits");
  }
}

void TracingSession::enable_events(const char* channel, const std::string& pattern,
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
  check(lttng_enable_event_with_exclusions(handle_.get(), event.get(), channel, nullptr,
                                           static_cast<int>(names.size()),
                                           names.empty() ? nullptr : names.data()),
        "enable the events " + in_quotes(pattern));
}

std::uint64_t TracingSession::buffer_bytes_per_cpu(const Options& options) {
  const std::uint64_t bytes =
      kStateSubbufSize * kStateSubbufs + options.subbuf_size * options.num_subbuf;
  return options.has_ros2_profile ? 2 * bytes : bytes;
}

void TracingSession::describe_again() {
  check(lttng_regenerate_statedump(name_.c_str()), "have the processes describe themselves");
}

void TracingSession::save_snapshot(const std::filesystem::path& directory) {
  const std::unique_ptr<lttng_snapshot_output,
                        Destroyer<lttng_snapshot_output, lttng_snapshot_output_destroy>>
      output(lttng_snapshot_output_create());
  const bool is_set = output &&
                      lttng_snapshot_output_set_local_path(directory.c_str(), output.get()) == 0 &&
                      lttng_snapshot_output_set_name("snapshot", output.get()) == 0;
  if (!is_set) {
    throw RecordError("cannot save a snapshot in " + in_quotes(directory) +
                      ": LTTng does not accept the path");
  }
  check(lttng_snapshot_record(name_.c_str(), output.get(), 1), "save a snapshot");
}

PendingChunk TracingSession::begin_chunk() {
  lttng_rotation_handle* handle = nullptr;
  check(lttng_rotate_session(name_.c_str(), nullptr, &handle), "begin a chunk");
  return PendingChunk(handle);
}

void TracingSession::start() { check(lttng_start_tracing(name_.c_str()), "start recording"); }

bool TracingSession::stop() {
  const auto begin = static_cast<std::uint64_t>(now().monotonic_ns);
  check(lttng_stop_tracing_no_wait(name_.c_str()), "stop recording");
  if (!drain()) {
    return false;
  }
  // Where the streams are not simply below the directory, whether one needs it is not known.
  const bool is_needed = is_live_ || is_divided_ || has_stream_that_ends_before(begin);
  if (is_snapshot_ || !is_needed) {
    return true;
  }
  close_packets_again();
  return drain();
}

bool TracingSession::drain() {
  const auto deadline = std::chrono::steady_clock::now() + kDrainPatience;
  while (true) {
    const int pending = lttng_data_pending(name_.c_str());
    check(pending, "write the last buffers");
    if (pending == 0) {
      return true;
    }
    if (std::chrono::steady_clock::now() > deadline) {
      return false;
    }
    std::this_thread::sleep_for(kDrainPoll);
  }
}

// LTTng counts what a buffer discarded in the packet that is closed next. A stop closes one in
// every buffer but those that are full, because the consumer daemon is late: what these discarded
// at last would be counted nowhere.
bool TracingSession::has_stream_that_ends_before(std::uint64_t time) const {
  const std::filesystem::path traces = directory_ / "ust";
  if (!std::filesystem::exists(traces)) {
    return false;
  }
  const std::vector<StreamSummary> streams = check_streams(traces);
  return std::ranges::any_of(streams,
                             [time](const StreamSummary& stream) { return stream.end < time; });
}

// Now that all buffers are empty. Without channels nobody is recorded meanwhile.
void TracingSession::close_packets_again() {
  for (const ChannelLoss& channel : losses()) {
    check(lttng_disable_channel(handle_.get(), channel.name.c_str()),
          "disable the channel " + in_quotes(channel.name));
  }
  start();
  check(lttng_stop_tracing_no_wait(name_.c_str()), "stop recording");
}

namespace {

// LTTng's consumer takes a packet whose count of discarded events is below the one before for a
// counter that wrapped at 2^63, and adds that (lttng-tools 2.13, consumer_stream sync of discarded
// events). Packets of a buffer that overflows are sometimes seen in that order. The sum is right
// without its highest bit.
std::uint64_t without_false_wraps(std::uint64_t count) noexcept {
  return count & ~(std::uint64_t{1} << 63U);
}

}  // namespace

std::vector<ChannelLoss> TracingSession::losses() const {
  lttng_channel* list = nullptr;
  const int count = lttng_list_channels(handle_.get(), &list);
  check(count, "ask how many events were discarded");
  const std::unique_ptr<lttng_channel, Free> owner(list);
  std::vector<ChannelLoss> losses;
  for (int i = 0; i < count; ++i) {
    ChannelLoss loss{.name = list[i].name};
    check(lttng_channel_get_discarded_event_count(&list[i], &loss.discarded_events),
          "ask how many events were discarded");
    loss.discarded_events = without_false_wraps(loss.discarded_events);
    check(lttng_channel_get_lost_packet_count(&list[i], &loss.lost_packets),
          "ask how many packets were lost");
    losses.push_back(std::move(loss));
  }
  return losses;
}

void TracingSession::destroy() {
  lttng_destruction_handle* raw = nullptr;
  const lttng_error_code begun = lttng_destroy_session_ext(name_.c_str(), &raw);
  const Destruction destruction(raw);
  exists_ = false;
  if (begun != LTTNG_OK) {
    throw RecordError(std::string("cannot end the session: ") + lttng_strerror(-begun));
  }
  const auto patience = std::chrono::milliseconds(kDrainPatience).count();
  const auto completed =
      lttng_destruction_handle_wait_for_completion(destruction.get(), static_cast<int>(patience));
  if (completed != LTTNG_DESTRUCTION_HANDLE_STATUS_COMPLETED) {
    throw RecordError("the session daemon did not finish the session within a minute");
  }
  lttng_error_code result = LTTNG_OK;
  if (lttng_destruction_handle_get_result(destruction.get(), &result) !=
      LTTNG_DESTRUCTION_HANDLE_STATUS_OK) {
    throw RecordError("the session daemon gave no verdict on the session");
  }
  if (result != LTTNG_OK) {
    throw RecordError(std::string("the recording is not complete: ") + lttng_strerror(-result));
  }
}

std::vector<TracedProcess> TracingSession::traced_processes() const {
  lttng_event* list = nullptr;
  const int count = lttng_list_tracepoints(handle_.get(), &list);
  check(count, "list the registered applications");
  const std::unique_ptr<lttng_event, Free> owner(list);
  std::map<pid_t, std::string> processes;
  for (int i = 0; i < count; ++i) {
    if (std::string_view(list[i].name).starts_with("cie:") && list[i].pid > 0) {
      processes.try_emplace(list[i].pid);
    }
  }
  std::vector<TracedProcess> result;
  result.reserve(processes.size());
  for (const auto& [pid, unused] : processes) {
    result.push_back({.pid = pid, .name = process_name(pid)});
  }
  return result;
}

}  // namespace cie::record
