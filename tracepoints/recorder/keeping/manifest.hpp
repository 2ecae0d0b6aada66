// manifest.json: what a recording is, and the checksums that seal it.
#pragma once

#include <cie/tracepoints/recording_manifest.hpp>

#include "kernel/kernel_recording.hpp"
#include "lttng/tracing_session.hpp"
#include "options/options.hpp"
#include "system/child_process.hpp"
#include "system/instant.hpp"

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace cie::record {

struct SnapshotFacts {
  std::string reason;
  std::chrono::nanoseconds held{};
};

// One session at a relay daemon. There it is HOST/NAME-DATE.
struct RelaySession {
  std::string name;
  Instant begin;
  std::optional<Instant> lost;  // when its connection was found to be broken
  std::optional<Instant> end;   // of LTTng's work on it; empty: LTTng did not answer
};

struct Manifest {
  Options options;
  std::string session;
  Instant begin;
  Instant end;
  std::optional<ExitStatus> exit;  // of the command; empty when attached
  std::vector<RecordedProcess> processes;
  bool names_all_processes = true;  // false: LTTng did not tell of some
  std::vector<ChannelLoss> losses;
  std::optional<KernelSummary> kernel;    // empty: no kernel events
  std::string no_kernel_because;          // empty: they were recorded, or --kernel=no
  std::optional<SnapshotFacts> snapshot;  // empty: everything from begin to end
  std::optional<std::uint64_t> chunk;     // its number; empty: not divided, or the whole
  std::uint64_t removed_chunks = 0;       // of the whole
  std::vector<RelaySession> relayed;      // one after the other; empty: nothing was streamed
  std::vector<std::string> problems;      // why the recording is not what was asked for
};

// Hashes every file of the recording (of one that is divided into chunks: their manifests, which
// hash the rest) and writes DIR/manifest.json, whole or not at all. Throws RecordError,
// std::system_error or std::filesystem::filesystem_error.
void write_manifest(const Manifest& manifest);

}  // namespace cie::record
