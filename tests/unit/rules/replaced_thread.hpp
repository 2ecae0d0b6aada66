// A callback that goes on on a thread which replaced its own.
#pragma once

namespace cie::test {

inline constexpr const char* kReplaced = R"(
  callback fusion pooled
  thread t1 callback of=fusion tid=101
  thread t2 callback of=fusion tid=102
  -500 begin t1
  10 start fusion on=t1
  12 end fusion on=t1
  14 finish t1
  20 begin t2
  30 start fusion on=t2
  32 end fusion on=t2
  34 finish t2)";

}  // namespace cie::test
