// For what is compiled while configuring: a function or an operation of Cyclone DDS has this very type.
#pragma once

#include <type_traits>

template <typename Expected, typename Actual>
void same(Actual*) {
  static_assert(std::is_same_v<Expected, Actual>, "another type than the one it was written for");
}
