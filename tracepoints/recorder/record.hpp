// The two ways to record: into something that stays, or for one who watches.
#pragma once

#include "options/options.hpp"

namespace cie::record {

// From the first check to the manifest. Says on standard error how it goes and what came of it;
// gives the exit status. Throws UsageError if the directory is taken, RecordError if nothing could
// be recorded: nothing is left behind then.
int record(const Options& options);

// Until the command, the peer or a signal ends it. What goes wrong is told to the peer; false then.
bool stream_live(const Options& options);

}  // namespace cie::record
