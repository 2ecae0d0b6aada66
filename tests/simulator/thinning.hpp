// Recordings with events missing, as a tracer loses them.
#pragma once

#include "simulator/random.hpp"
#include "simulator/tape.hpp"
#include "support/trace_text.hpp"

namespace cie::sim {

// Without events of a way that is drawn: some, those of a kind, a stretch of a stream or of all of
// them. Stretches may be recorded as discarded; what is lost of the kernel always is, because its
// events carry no numbers that would show it.
test::TextTrace thinned(const test::TextTrace& trace, Random& random);

// With holes in the kernel's record alone, of several kinds at once: events discarded and counted,
// packets lost or damaged, streams that end early or are missing, and, if asked for, switches that
// the kernel does not report: these may be missed, where those that are left fit together.
test::TextTrace with_kernel_holes(const test::TextTrace& trace, Random& random,
                                  bool has_silent_ones = true);

}  // namespace cie::sim
