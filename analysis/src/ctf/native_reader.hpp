// Reads CTF 1.8 traces without help: finds their files, merges their streams by time.
#pragma once

#include "stream_reader.hpp"

#include <filesystem>
#include <span>

namespace cie::analysis::ctf {

// Feeds everything to `sink`, merged by time; equal times in an order that depends on the traces
// alone, not on names or order of files. What cannot be read of a trace is told as DamagedPacket,
// Discarded and TimeRegression. Throws UnreadableTrace when metadata cannot be read, or nothing
// can. `metadata_from`, if not empty, is what to read traces with whose own metadata cannot be
// read: told as a DamagedPacket of all of the trace.
void read_traces(std::span<const std::filesystem::path> traces, const EventSink& sink,
                 const std::filesystem::path& metadata_from = {});

}  // namespace cie::analysis::ctf
