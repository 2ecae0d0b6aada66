// When something happened, on both clocks.
#pragma once

#include <cie/tracepoints/recording_manifest.hpp>

namespace cie::record {

using Instant = RecordedInstant;
Instant now();

}  // namespace cie::record
