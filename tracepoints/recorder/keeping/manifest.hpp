// manifest.json of what this recorder records: what is known at first, and the checksums that seal
// it.
#pragma once

#include <cie/tracepoints/recording_manifest.hpp>

#include "base/directory.hpp"
#include "options/options.hpp"

namespace cie::record {

// What is known before the beginning.
RecordingManifest manifest_of(const Options& options);

// There are kernel events, of which this was measured.
void note_kernel(RecordedKernel measured, RecordingManifest& manifest);

// A problem, unless others may be why: what could not be written may be what was emitted. `is_anybody`: some
// application registered with the session daemon.
void note_nothing_recorded(const Options& options, bool is_anybody, RecordingManifest& manifest);

// Hashes every file of the recording (of one that is divided into chunks: their manifests, which
// hash the rest) and writes DIRECTORY/manifest.json, whole or not at all. Throws std::system_error.
void write_manifest(const Directory& directory, RecordingManifest manifest);

}  // namespace cie::record
