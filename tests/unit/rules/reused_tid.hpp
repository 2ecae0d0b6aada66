// A thread that gets the tid of another one.
#pragma once

#include "support/trace_text.hpp"

#include <string>

namespace cie::test {

// fusion's thread ends at 14 and plan's, which gets its tid, begins at 18.
inline TextTrace of_reused_tid(const std::string& process, const std::string& more = "") {
  return trace_of(process + R"(
    callback fusion pooled
    callback plan pooled
    thread former callback of=fusion tid=101
    thread latter callback of=plan tid=101
    -90 begin former
    10 start fusion on=former
    12 end fusion on=former
    14 finish former
    18 begin latter
    30 start plan on=latter
    32 end plan on=latter
    34 finish latter)" +
                  more);
}

}  // namespace cie::test
