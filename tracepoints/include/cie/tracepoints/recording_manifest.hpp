// manifest.json: what a recording of `cie record` says of itself. The recorder writes it, and
// analyzers hold it against what they find.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace cie {

inline constexpr const char* kManifestName = "manifest.json";
// In the directory of a recording while it is being made, and after a recorder that was killed.
inline constexpr const char* kRecordingClaimName = ".cie-record";
// Where, below a recording or chunk, its kernel events are.
inline constexpr const char* kKernelDirectory = "kernel";

// One moment by both clocks.
struct RecordedInstant {
  std::int64_t monotonic_ns = 0;
  std::int64_t realtime_ns = 0;

  bool operator==(const RecordedInstant&) const = default;
};

// How the command ended: one of the two.
struct RecordedExit {
  std::optional<int> code;
  std::optional<int> signal;

  bool operator==(const RecordedExit&) const = default;
};
// "exited with status 3", "was killed by signal 9 (Killed)".
std::string describe(const RecordedExit& exit);

struct RecordedSnapshot {
  std::string reason;
  std::int64_t held_ns = 0;  // how much of the time before it it holds

  bool operator==(const RecordedSnapshot&) const = default;
};

// One session at a relay daemon.
struct RelayedSession {
  std::string path;  // there
  RecordedInstant begin;
  std::optional<RecordedInstant> lost;  // when its connection was found to be broken
  std::optional<RecordedInstant> end;   // empty: LTTng did not answer

  bool operator==(const RelayedSession&) const = default;
};
struct RecordedRelay {
  std::string address;
  std::vector<RelayedSession> sessions;

  bool operator==(const RecordedRelay&) const = default;
};

struct RecordedKernel {
  std::string route;                    // "bpf", "tracefs"
  std::uint64_t buffer_size = 0;        // bytes per CPU
  std::uint64_t streams = 0;            // CPUs that recorded anything
  std::optional<std::uint64_t> events;  // empty: the manifest does not say
  std::uint64_t lost_events = 0;  // overwritten before they were read, or dropped by the kernel
  // Switches that the kernel did not tell although no buffer overran: the thread that leaves a CPU
  // is not the one that entered it last.
  std::uint64_t untold_switches = 0;
  std::vector<std::string>
      problems{};  // why they are not what was asked for; no event of applications is lost by them

  bool operator==(const RecordedKernel&) const = default;
};

struct RecordedSession {
  std::string name;
  std::vector<std::string> events;  // patterns
  std::uint64_t subbuf_size = 0;
  std::uint64_t num_subbuf = 0;
  std::int64_t flush_interval_ms = 0;

  bool operator==(const RecordedSession&) const = default;
};

// A process whose `run_begin` was recorded.
struct RecordedProcess {
  std::int64_t pid = 0;
  std::string name;
  std::optional<std::int64_t> start_ns;  // process_start_ns of run_begin; empty: not known
  // Of one that tells nothing of it itself, in a time namespace: by what its CLOCK_MONOTONIC is ahead of the
  // machine's.
  std::optional<std::int64_t> monotonic_offset_ns{};

  bool operator==(const RecordedProcess&) const = default;
};

struct RecordedChannel {
  std::string name;
  std::uint64_t discarded_events = 0;
  std::uint64_t lost_packets = 0;

  bool operator==(const RecordedChannel&) const = default;
};

struct RecordedFile {
  std::string path;  // below the manifest's directory, without "." and ".."
  std::uint64_t size = 0;
  std::string sha256;  // lower-case hex

  bool operator==(const RecordedFile&) const = default;
};

struct RecordingManifest {
  std::string tool_version;
  std::string mode;  // "command", "attach"
  std::vector<std::string> command;
  std::optional<RecordedExit> exit;  // of the command; empty: attached, or it still ran
  std::string host;
  std::string boot_id;
  RecordedInstant begin;
  RecordedInstant end;
  std::optional<RecordedSnapshot> snapshot;  // empty: everything from begin to end
  std::optional<RecordedRelay> relay;        // empty: its trace is beside it
  std::optional<std::uint64_t> chunk;        // its number, from 1; empty: not divided, or the whole
  std::optional<std::uint64_t> removed_chunks;  // the oldest, by --keep; empty: undivided
  bool has_kernel_events = false;
  RecordedKernel kernel;      // if there are kernel events
  std::string kernel_reason;  // why there are none
  RecordedSession session;
  std::vector<RecordedProcess> processes;
  bool names_all_processes = true;  // false: the tracer did not tell of some
  std::vector<RecordedChannel> channels;
  std::vector<std::string> problems;  // why the recording is not what was asked for
  std::vector<RecordedFile> files;    // of a recording in chunks: their manifests

  bool operator==(const RecordingManifest&) const = default;
};

// Of the applications' events and of the kernel's, each once.
std::vector<std::string> all_problems(const RecordingManifest& manifest);
// Adds it; false: it is there already.
bool add_problem(std::vector<std::string>& problems, std::string problem);

// As the file has it. What is no UTF-8 (names and arguments are bytes) becomes replacement
// characters.
std::string to_json(const RecordingManifest& manifest);

// The manifest cannot be used: what() says where it is not what it should be.
class ManifestError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The text may be anybody's: its size and depth are bounded, and no path leads out of the
// recording. What is absent keeps its default. Empty: JSON, but no manifest of a recording. Throws
// ManifestError.
std::optional<RecordingManifest> parse_recording_manifest(std::string_view text);
// The manifest.json of a directory; empty if there is none. Throws ManifestError.
std::optional<RecordingManifest> load_recording_manifest(const std::filesystem::path& directory);

}  // namespace cie
