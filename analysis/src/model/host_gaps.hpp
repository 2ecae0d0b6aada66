// When nothing was recorded of a machine whose applications went on: its connection was cut, it was
// switched off, or its recorder began anew.
#pragma once

#include "facts.hpp"

#include <string>
#include <vector>

namespace cie::analysis {

// Between two sessions that recorded the same process: what it did then is lost. In order of time.
std::vector<HostGap> gaps_within_lives(const Model& model);

// These, and from the last packet of a machine that did not say good-bye to the end of what other
// machines recorded. By machine, in order of time.
std::vector<HostGap> host_gaps(const Model& model);

// "nothing is known of robot from 3.250 s to 4.125 s after the begin of the recording: ..."
std::string in_words(const HostGap& gap, const Model& model);
// "2 instances on robot, from 3.250 s to 3.300 s after the recording's begin: in the window of neither ..."
std::string in_words(const RunsBetweenSessions& runs, const Model& model);

}  // namespace cie::analysis
