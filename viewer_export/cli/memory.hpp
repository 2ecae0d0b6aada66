// What a command that reads traces may take of the machine, and how.
#pragma once

namespace cie::cli {

// From now on this process asks for at most half of the machine's memory: a trace with more
// processes, threads and callbacks than that holds ends the command with "out of memory", and
// nothing else on the machine suffers. A lower limit stays (ulimit -d). The heap, one for all
// threads, is of huge pages, and what was freed is used again: what reads a trace goes before the
// report is made. Beyond them, what is large goes back to the system when it is freed. To be called
// before there are other threads.
void prepare_memory() noexcept;

}  // namespace cie::cli
