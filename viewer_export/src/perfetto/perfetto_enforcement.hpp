// The verifier's violations, on a track of their own for each host.
#pragma once

#include <cie/analysis/analyzer.hpp>

#include "perfetto_packets.hpp"
#include "perfetto_tracks.hpp"

#include <cstdint>

namespace cie::viewer_export::perfetto {

// An instant for every piece of evidence of every violated rule and subject, suppressed ones
// included and marked so: named by the rule, with what it demands and what was found. One without a
// time is where the file begins. The number of instants.
std::uint64_t draw_violations(PacketBuffer& packets, Tracks& tracks,
                              const analysis::AnalysisResult& result, const FileBegin& begin);

}  // namespace cie::viewer_export::perfetto
