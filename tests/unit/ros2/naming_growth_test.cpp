// What it costs to name callbacks grows as their number does: none is held against every other one.
#include "vocabulary/ros2/directory.hpp"

#include <algorithm>
#include <cstdint>
#include <ctime>
#include <string>

#include <gtest/gtest.h>

namespace cie::analysis::ros2 {
namespace {

std::int64_t used_cpu_time() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return time.tv_sec * 1'000'000'000 + time.tv_nsec;
}

// Timers of one period are made again and again at a few addresses; each runs at once.
std::string last_name_of(std::int64_t count) {
  Directory directory;
  const Telling telling;
  directory.add_node(1, "n", "/", telling);
  std::string name;
  for (std::int64_t i = 0; i < count; ++i) {
    const auto handle = static_cast<Address>(0x1000 + i % 3 * 64);
    directory.add_timer(handle, 10, {}, telling);
    directory.add_handle_callback(CallbackKind::timer, handle, handle + 16, telling);
    directory.link_timer(handle, 1, telling);
    auto& callback = directory.callback(handle + 16, Timestamp{});
    callback.is_told = true;
    name = directory.logical_id(callback);
  }
  return name;
}

// The least of several.
std::int64_t cost_of_naming(std::int64_t count) {
  auto least = std::int64_t{1} << 62;
  for (int i = 0; i < 3; ++i) {
    const auto begin = used_cpu_time();
    EXPECT_EQ(last_name_of(count), "/n@Timer(10)#" + std::to_string(count));
    least = std::min(least, used_cpu_time() - begin);
  }
  return least;
}

TEST(Ros2NamingGrowth, OfManyCallbacksOfOneName) {
  constexpr std::int64_t kFew = 2'000;
  constexpr std::int64_t kTimes = 8;
  EXPECT_LE(cost_of_naming(kTimes * kFew), cost_of_naming(kFew) * kTimes * 5 / 2);
}

}  // namespace
}  // namespace cie::analysis::ros2
