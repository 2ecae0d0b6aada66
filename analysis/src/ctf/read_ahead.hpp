// Reads traces on a thread of its own, ahead of whoever consumes the events.
#pragma once

#include "ctf/native_reader.hpp"

namespace cie::analysis::ctf {

// Like TraceReader::read(): the same events in the same order, `sink` called on the caller's thread.
// Exceptions of either side end both and reach the caller.
void read_ahead(TraceReader& traces, const BatchSink& sink);

}  // namespace cie::analysis::ctf
