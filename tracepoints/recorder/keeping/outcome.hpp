// What came of a recording.
#pragma once

#include <cie/tracepoints/recording_manifest.hpp>

#include "options/options.hpp"

#include <cstdint>
#include <string>
#include <variant>

namespace cie::record {

// How it was kept.
struct KeptInDirectory {};
struct KeptInChunks {
  std::uint64_t sealed = 0;
  std::uint64_t removed = 0;  // the oldest of them
};
struct KeptInSnapshots {
  std::uint64_t saved = 0;
  std::uint64_t left_out = 0;      // for which the limits let nothing be saved
  bool has_kernel_events = false;  // each of them
};
struct KeptElsewhere {};  // at a relay daemon, or shown live

struct Outcome {
  Options options;
  RecordingManifest manifest;
  bool is_directory_there = true;  // false: it was removed or renamed meanwhile
  std::variant<KeptInDirectory, KeptInChunks, KeptInSnapshots, KeptElsewhere> kept;

  // Everything was recorded, or what was lost is only discarded events, which are counted.
  bool is_success() const { return all_problems(manifest).empty(); }
};

// For people, in lines: how the command ended, what was lost, where the recording is and what to do
// next, or why it failed.
std::string summary(const Outcome& outcome);

// Of the recorder: 0 or kFailed. Of what succeeded with --preserve-status the command's own, 128 + N if
// signal N killed it, as shells and timeout(1) have it.
int exit_status(const Outcome& outcome);

}  // namespace cie::record
