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

std::string number(std::int64_t count) { return "/n@Timer(10)#" + std::to_string(count); }

// The least of several.
template <typename Name>
std::int64_t cost_of(const Name& last_name, std::int64_t count,
                     std::string (*expected)(std::int64_t)) {
  auto least = std::int64_t{1} << 62;
  for (int i = 0; i < 3; ++i) {
    const auto begin = used_cpu_time();
    EXPECT_EQ(last_name(count), expected(count));
    least = std::min(least, used_cpu_time() - begin);
  }
  return least;
}

template <typename Name>
void expect_linear(const Name& last_name, std::string (*expected)(std::int64_t) = number) {
  constexpr std::int64_t kFew = 2'000;
  constexpr std::int64_t kTimes = 8;
  EXPECT_LE(cost_of(last_name, kTimes * kFew, expected),
            cost_of(last_name, kFew, expected) * kTimes * 5 / 2);
}

TEST(Ros2NamingGrowth, OfManyCallbacksOfOneName) { expect_linear(last_name_of); }

Telling made_at(std::int64_t time) {
  return {.repeats = true, .told = Timestamp{1'000'000'000}, .made = Timestamp{time}};
}

void tell_timer(Directory& directory, Address handle, std::int64_t made) {
  directory.add_timer(handle, 10, {}, made_at(made));
  directory.link_timer(handle, 1, made_at(made));
}

std::string name_of_timer_at(Directory& directory, Address handle, std::int64_t made) {
  directory.add_handle_callback(CallbackKind::timer, handle, handle + 16, made_at(made));
  return directory.logical_id(directory.callback(handle + 16, Timestamp{made}));
}

// A tracer that repeats tells of all that had one handle, the last one first.
TEST(Ros2NamingGrowth, OfManyThatHadOneHandle) {
  expect_linear([](std::int64_t count) {
    Directory directory;
    directory.add_node(1, "n", "/", made_at(1));
    for (auto made = count; made > 0; --made)
      tell_timer(directory, 0x1000, 1 + made);
    return name_of_timer_at(directory, 0x1000, 1 + count);
  });
}

// Of each of many handles, every other of them a callback's, what had it before.
TEST(Ros2NamingGrowth, OfManyHandlesThatAnotherOneHadBefore) {
  expect_linear([](std::int64_t count) {
    Directory directory;
    directory.add_node(1, "n", "/", made_at(1));
    Address handle = 0x1000;
    for (auto i = count / 2; i > 0; --i, handle += 64) {
      tell_timer(directory, handle, 1 + count + i);
      directory.add_handle_callback(CallbackKind::timer, handle, handle + 16,
                                    made_at(1 + count + i));
      tell_timer(directory, handle, 1 + i);
    }
    return directory.logical_id(directory.callback(0x1000 + 16, Timestamp{1 + 2 * count}));
  });
}

// Each of many callbacks has a name of its own, which what had its handle before had, too.
TEST(Ros2NamingGrowth, OfManyCallbacksWhoseHandlesAnotherOneHadBefore) {
  expect_linear(
      [](std::int64_t count) {
        Directory directory;
        directory.add_node(1, "n", "/", made_at(1));
        const auto handle_of = [](std::int64_t i) { return static_cast<Address>(0x1000 + i * 64); };
        const auto tell = [&](std::int64_t i, std::int64_t made) {
          directory.add_timer(handle_of(i), static_cast<std::uint64_t>(i), {}, made_at(made));
          directory.link_timer(handle_of(i), 1, made_at(made));
        };
        for (std::int64_t i = 1; i <= count; ++i) {
          tell(i, 1 + count + i);
          directory.add_handle_callback(CallbackKind::timer, handle_of(i), handle_of(i) + 16,
                                        made_at(1 + count + i));
          tell(i, 1 + i);
        }
        std::string name;
        for (std::int64_t i = 1; i <= count; ++i)
          name =
              directory.logical_id(directory.callback(handle_of(i) + 16, Timestamp{1 + 2 * count}));
        return name;
      },
      [](std::int64_t count) { return "/n@Timer(" + std::to_string(count) + ")#2"; });
}

}  // namespace
}  // namespace cie::analysis::ros2
