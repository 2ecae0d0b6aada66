// A snapshot as text, for pipes and logs.
#pragma once

#include <cie/viewer_export/text_style.hpp>

#include "choice.hpp"
#include "snapshot.hpp"

#include <string>
#include <string_view>

namespace cie::live {

// Ends with an empty line. Names are printable whatever the trace holds.
std::string batch_text(const Snapshot& snapshot, SortKey key, std::string_view filter,
                       const viewer_export::TextStyle& style);

// The first lines of every view: source, rate, losses. Without colours or line ends.
std::vector<std::string> headline(const Snapshot& snapshot);

// "20:15:07", of the local time zone.
std::string clock_time(std::int64_t realtime_ns);

}  // namespace cie::live
