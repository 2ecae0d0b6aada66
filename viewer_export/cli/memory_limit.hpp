// What a command that reads traces may take of the machine.
#pragma once

namespace cie::cli {

// From now on this process asks for at most half of the machine's memory: a trace with more
// processes, threads and callbacks than that holds ends the command with "out of memory", and
// nothing else on the machine suffers. A lower limit stays (ulimit -d). What is large goes back to
// the system when it is freed: what reads a trace goes before the report is made. Heaps grow by a
// mebibyte at a time.
void limit_memory() noexcept;

}  // namespace cie::cli
