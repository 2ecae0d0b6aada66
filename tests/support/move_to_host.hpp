// A second machine for traces written as text, whose times are true times.
#pragma once

#include "support/trace_text.hpp"

#include <cstdint>
#include <string>

namespace cie::test {

struct OtherHost {
  std::string name;
  std::int64_t monotonic = 0;  // its CLOCK_MONOTONIC is so far ahead of the first host's
  std::int64_t realtime = 0;   // likewise its CLOCK_REALTIME: nobody is there to know
};

// Has the process of that pid run on another host: its times are what the clocks there show.
void move_to_host(TextTrace& trace, std::int64_t pid, const OtherHost& host);

// The trace with all of `other` beside it, which happened on another host: names, pids, tids and
// ids of both may be the same. Writers of messages have identities of their own.
TextTrace beside(const TextTrace& trace, const TextTrace& other, const OtherHost& host);

}  // namespace cie::test
