// Whole recordings moved in time, renumbered and put together.
#pragma once

#include "support/trace_text.hpp"
#include "system.hpp"

#include <cstdint>

namespace cie::sim {

struct Change {
  Ns time = 0;               // later by, on all clocks
  std::int64_t pid = 0;      // added to process and thread ids of all kinds, but the idle thread's
  std::int32_t cpu = 0;      // added to processors
  std::uint64_t writer = 0;  // added to writers of messages
  std::uint32_t stream = 0;  // added to streams and channels
};

// A copy whose events, fields included, are changed throughout. It shares the strings.
test::TextTrace changed(const test::TextTrace& trace, const Change& change);

// Both as one recording, which covers them from the first beginning to the last end. Streams of
// equal number are one stream.
test::TextTrace merged(const test::TextTrace& one, const test::TextTrace& other);

}  // namespace cie::sim
