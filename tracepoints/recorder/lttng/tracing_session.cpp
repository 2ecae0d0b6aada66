#include "lttng/tracing_session.hpp"

#include "base/text.hpp"
#include "ctf/stream_check.hpp"
#include "lttng/lttng_calls.hpp"
#include "system/error.hpp"
#include "system/instant.hpp"
#include "system/processes.hpp"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <map>
#include <string_view>
#include <thread>

#include <lttng/lttng.h>

namespace cie::record {
namespace {

constexpr std::chrono::seconds kDrainPatience{60};
constexpr std::chrono::milliseconds kDrainPoll{10};

struct Free {
  void operator()(void* memory) const noexcept { std::free(memory); }
};

using Descriptor =
    std::unique_ptr<lttng_session_descriptor,
                    Destroyer<lttng_session_descriptor, lttng_session_descriptor_destroy>>;
using Destruction =
    std::unique_ptr<lttng_destruction_handle,
                    Destroyer<lttng_destruction_handle, lttng_destruction_handle_destroy>>;

}  // namespace

void TracingSession::HandleDeleter::operator()(lttng_handle* handle) const noexcept {
  lttng_destroy_handle(handle);
}

TracingSession::TracingSession(const std::string& name, const Options& options)
    : kind_(options.snapshot ? SessionKind::snapshots
            : options.rotate ? SessionKind::divided
                             : SessionKind::whole),
      name_(name),
      directory_(options.directory) {
  const Descriptor descriptor(
      kind_ == SessionKind::snapshots
          ? lttng_session_descriptor_snapshot_create(name.c_str())
          : lttng_session_descriptor_local_create(name.c_str(), options.directory.c_str()));
  const auto operation = "cannot create a session in " + in_quotes(options.directory);
  if (!descriptor) throw RecordError(operation + ": LTTng does not accept the path");
  create(descriptor.get(), operation, options);
}

TracingSession::TracingSession(SessionKind kind, const std::string& name, const Options& options,
                               const RelayDestination& destination)
    : kind_(kind), name_(name) {
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
  has_ros2_ = options.ros2 == Ros2Events::applications;
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
  enable_channels(handle_.get(), kind_, options);
}

TracingSession::~TracingSession() {
  if (exists_) {
    lttng_destroy_session_no_wait(name_.c_str());
  }
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
  const bool is_needed = kind_ == SessionKind::whole ? has_stream_that_ends_before(begin)
                                                     : kind_ != SessionKind::snapshots;
  if (!is_needed) {
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
  for (const RecordedChannel& channel : losses()) {
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

std::vector<RecordedChannel> TracingSession::losses() const {
  lttng_channel* list = nullptr;
  const int count = lttng_list_channels(handle_.get(), &list);
  check(count, "ask how many events were discarded");
  const std::unique_ptr<lttng_channel, Free> owner(list);
  std::vector<RecordedChannel> losses;
  for (int i = 0; i < count; ++i) {
    RecordedChannel loss{.name = list[i].name};
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
  if (completed == LTTNG_DESTRUCTION_HANDLE_STATUS_TIMEOUT) {
    throw RecordError("the session daemon did not finish the session within a minute");
  }
  if (completed != LTTNG_DESTRUCTION_HANDLE_STATUS_COMPLETED) {
    throw RecordError("the session daemon went away while it finished the session");
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
    const std::string_view name = list[i].name;
    const bool is_traced = name.starts_with("cie:") || (has_ros2_ && name.starts_with("ros2:"));
    if (is_traced && list[i].pid > 0) {
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
