// One LTTng recording session of the user-space domain.
#pragma once

#include <cie/tracepoints/recording_manifest.hpp>

#include "lttng/pending_chunk.hpp"
#include "lttng/session_channels.hpp"
#include "options/options.hpp"

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

// Where sessions send to that a reader can follow while they run: a relay daemon.
struct RelayDestination {
  std::string control_url;  // tcp://HOST:PORT
  std::string data_url;
  std::chrono::milliseconds interval{};  // how often what was traced is sent
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
  // The same for a session that is relayed or live; options.directory is not used.
  TracingSession(SessionKind kind, const std::string& name, const Options& options,
                 const RelayDestination& destination);
  ~TracingSession();
  TracingSession(const TracingSession&) = delete;
  TracingSession& operator=(const TracingSession&) = delete;

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
  std::vector<RecordedChannel> losses() const;
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

  struct HandleDeleter {
    void operator()(lttng_handle* handle) const noexcept;
  };
  SessionKind kind_;
  std::string name_;
  std::filesystem::path directory_;  // of a recording; relay daemons have their own
  std::unique_ptr<lttng_handle, HandleDeleter> handle_;
  bool has_ros2_ = false;  // applications of ROS 2 are looked for, too
  bool exists_ = false;
};

}  // namespace cie::record
