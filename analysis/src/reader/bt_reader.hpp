// Reads CTF traces through libbabeltrace2's own graph: src.ctf.fs, flt.utils.muxer, our sink.
#pragma once

#include <cie/analysis/analyzer.hpp>

#include <filesystem>
#include <span>

namespace cie::analysis::bt {

// Feeds every message of the traces to `analyzer`, merged by time. Throws UnreadableTrace when a
// trace cannot be opened. Trouble after the first event is a DamagedPacket: what was read is kept.
void read_traces(std::span<const std::filesystem::path> traces, Analyzer& analyzer);

}  // namespace cie::analysis::bt
