// One LTTng recording session of the user-space domain.
#pragma once

#include "options.hpp"
#include "pending_chunk.hpp"

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <sys/types.h>

struct lttng_handle;
struct lttng_session_descriptor;

namespace cie::record {

// Two channels: `state` holds the events that describe objects and clocks (and are few), so that no
// burst of the others can cost them; `events` holds all others.
inline constexpr const char* kStateChannel = "state";
inline constexpr const char* kEventChannel = "events";
// The same for the profile `ros2`, whose readers want every event's process name.
inline constexpr const char* kRos2StateChannel = "ros2_state";
inline constexpr const char* kRos2EventChannel = "ros2";

struct ChannelLoss {
  std::string name;
  std::uint64_t discarded_events = 0;
  std::uint64_t lost_packets = 0;
};

// Where a session sends to that a reader can follow while it runs: a relay daemon.
struct RelayDestination {
  std::string control_url;  // tcp://HOST:PORT
  std::string data_url;
  std::chrono::milliseconds interval{};  // how often what was traced is sent
  bool keeps_all = true;  // false: the newest packets of each stream only, for a reader of now
};

// A process that carries tracepoints of the provider `cie`.
struct TracedProcess {
  pid_t pid = 0;
  std::string name;
};

// Every function throws RecordError when LTTng refuses. The destructor destroys the session if
// destroy() was not called, without a word.
class TracingSession {
 public:
  // Creates the session, its channels, contexts and event rules. Nothing is recorded before
  // start().
  TracingSession(const std::string& name, const Options& options);
  // The same for a session that is sent to a relay daemon; options.directory is not used.
  TracingSession(const std::string& name, const Options& options,
                 const RelayDestination& destination);
  ~TracingSession();
  TracingSession(const TracingSession&) = delete;
  TracingSession& operator=(const TracingSession&) = delete;

  // Bytes of the buffers that such a session has on each CPU.
  static std::uint64_t buffer_bytes_per_cpu(const Options& options);

  void start();
  // Has every traced process describe itself again.
  void describe_again();
  // Writes what a snapshot session holds into a directory below `directory`.
  void save_snapshot(const std::filesystem::path& directory);
  // Ends a chunk: what is emitted from now on belongs to the next one. Neither snapshot nor live
  // sessions do that.
  PendingChunk begin_chunk();
  // Stops and waits until the buffers are written out and everything that they discarded is
  // counted; false if that takes longer than a minute.
  bool stop();
  std::vector<ChannelLoss> losses() const;
  // The verdict on what was written: LTTng tells here, not at stop(), that a disk was full or a
  // consumer daemon died.
  void destroy();

  // Asks every registered application. May take some milliseconds each.
  std::vector<TracedProcess> traced_processes() const;

 private:
  // `operation`: what could not be done, for errors.
  void create(lttng_session_descriptor* descriptor, const std::string& operation,
              const Options& options);
  void set_up(const Options& options);
  // Waits until the buffers are written out; false if that takes longer than a minute.
  bool drain();
  bool has_stream_that_ends_before(std::uint64_t time) const;
  void close_packets_again();
  void enable_channel(const char* name, std::uint64_t subbuf_size, std::uint64_t num_subbuf,
                      std::chrono::milliseconds flush_interval);
  void add_contexts(const char* channel, const std::vector<int>& types);
  void enable_own_events(const Options& options);
  void enable_ros2_events(const Options& options);
  void enable_events(const char* channel, const std::string& pattern,
                     const std::vector<std::string>& exclusions);

  struct HandleDeleter {
    void operator()(lttng_handle* handle) const noexcept;
  };
  std::string name_;
  std::filesystem::path directory_;  // of a recording; relay daemons have their own
  bool is_snapshot_ = false;
  bool is_divided_ = false;  // into chunks
  std::unique_ptr<lttng_handle, HandleDeleter> handle_;
  bool exists_ = false;
  bool is_live_ = false;   // sent to a relay daemon
  bool keeps_all_ = true;  // there
};

}  // namespace cie::record
