// When a stream ends that goes on no more.
#pragma once

#include <cie/analysis/recording.hpp>
#include <cie/analysis/structure_events.hpp>

#include <span>
#include <string>

namespace cie::analysis {

// Each stream of its trace ends with its last packet: of a CPU or a channel that was quiet, early. So it is in a chunk
// (`lttng rotate`, `cie record --rotate`) and in a copy. Else LTTng ends all of them as one, whatever they hold. Of a
// chunk whose recorder had a problem that is not said: there a stream may have been cut. `path`: where the stream's file
// lies.
bool ends_with_last_packet(std::span<const Recording> recordings, PacketWriter writer,
                           const std::string& path);

}  // namespace cie::analysis
