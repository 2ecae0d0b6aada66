// Looks over the stream files of a finished recording without decoding events.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace cie::record {

// What the packet headers of one stream file say.
struct StreamSummary {
  std::filesystem::path file;
  std::uint64_t size = 0;  // in bytes
  std::uint64_t packets = 0;
  std::uint64_t content_bytes = 0;     // of events, headers included, padding not
  std::uint64_t discarded_events = 0;  // the tracer's count in the last packet
  std::uint64_t lost_packets = 0;      // holes in the packet numbers, those before the first too
  std::uint64_t next_packet = 0;       // the number that would have followed
  std::uint64_t begin = 0;             // of the first packet, on the trace's clock
  std::uint64_t end = 0;               // of the last one
  std::uint64_t largest_packet = 0;    // in bytes
  bool is_damaged = false;             // ends within a packet, or is no stream of LTTng-UST
  bool is_cut_by_limit = false;        // see mark_cut_by_limit()
};

// Marks the streams whose file has no room left for another packet of its size below `limit`, the greatest size
// of a file in bytes, and that end before another stream does: what came after could not be written.
void mark_cut_by_limit(std::vector<StreamSummary>& streams, std::uint64_t limit);

// Why what the stream tells is not whole; empty if it is, as far as the file itself shows.
std::string incompleteness_of(const StreamSummary& stream);

// Whether a stream of hot events holds any: its packets hold more than how they begin. (The channel
// that describes has the tracer's own word for who registers.)
bool has_events(const StreamSummary& stream);

// Every stream file of the traces below `directory`, in order of path, those marked that this process's
// limit of the size of files (RLIMIT_FSIZE) has cut. Throws std::filesystem::filesystem_error if the directory
// cannot be read.
std::vector<StreamSummary> check_streams(const std::filesystem::path& directory);

// How much of the last time the streams of hot events hold, of buffers whose oldest packets newer ones overwrite.
struct HeldTime {
  std::chrono::nanoseconds common{};  // every stream
  // The stream that holds least of those that lack older packets; empty: nothing was overwritten.
  std::optional<std::chrono::nanoseconds> overwritten{};
};
HeldTime held_by(const std::vector<StreamSummary>& streams);

// A channel of which a trace has no stream.
struct AbsentChannel {
  std::filesystem::path trace;
  std::string channel;
};

// Of each trace that has some of the streams, those of `channels` that it has none of. A channel that was
// enabled has a stream on each CPU from when its buffers are made, whether anything goes into them or not.
std::vector<AbsentChannel> absent_channels(const std::vector<StreamSummary>& streams,
                                           const std::vector<std::string>& channels);

// Paths of metadata files below `directory` that are empty: nothing beside one can be decoded.
std::vector<std::filesystem::path> empty_metadata(const std::filesystem::path& directory);

}  // namespace cie::record
