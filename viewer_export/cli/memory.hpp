// What a command that reads traces may take of the machine, and how.
#pragma once

namespace cie::cli {

// From now on this process asks for at most half of the machine's memory: a trace with more
// processes, threads and callbacks than that holds ends the command with "out of memory", and
// nothing else on the machine suffers. A lower limit stays (ulimit -d). What is freed is used again
// and given back when the process ends. To be called before there are other threads.
void prepare_memory() noexcept;

}  // namespace cie::cli
