// Reads traces on a thread of its own, ahead of whoever consumes the events.
#pragma once

#include "ctf/native_reader.hpp"

#include <filesystem>
#include <span>

namespace cie::analysis::ctf {

// Like read_traces(): the same events in the same order, `sink` called on the caller's thread.
// Exceptions of either side end both and reach the caller.
void read_ahead(std::span<const std::filesystem::path> traces, const EventSink& sink,
                const ReadOptions& options = {});

}  // namespace cie::analysis::ctf
