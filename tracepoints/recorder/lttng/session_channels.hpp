// Which events a session records, and into what buffers.
#pragma once

#include "options/options.hpp"

#include <cstdint>
#include <string>
#include <vector>

struct lttng_handle;

namespace cie::record {

// Patterns of LTTng of what is recorded: the events asked for, and those of ROS 2's tracers.
std::vector<std::string> event_patterns(const Options& options);

// What becomes of a session's packets.
enum class SessionKind {
  whole,      // written into one directory
  divided,    // into chunks
  snapshots,  // kept in memory until they are saved
  relayed,    // sent to a relay daemon, which keeps them all
  live,       // which keeps the newest of each stream, for who reads them now
};

// Enables channels, contexts and event rules of the session that the handle is of. Throws
// RecordError when LTTng refuses.
void enable_channels(lttng_handle* session, SessionKind kind, const Options& options);

// Bytes of the buffers that a session has on each CPU.
std::uint64_t buffer_bytes_per_cpu(const Options& options);

}  // namespace cie::record
