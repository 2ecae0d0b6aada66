#include <cie/scheduling/threads.hpp>

#include <chrono>
#include <cstdint>
#include <future>
#include <set>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::scheduling {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using ::testing::ElementsAre;
using ::testing::Pair;

// A sanitizer's own thread comes with the first one.
std::set<std::uint32_t> ids_before() {
  std::thread{[] {}}.join();
  return thread_ids();
}

// Busy threads stand for threads that wait for a CPU.
TEST(NewNamedThreads, AreWaitedForUntilTheyComeToNameThemselves) {
  const auto before = ids_before();
  std::promise<void> end;
  std::promise<std::uint32_t> tid;
  std::thread late{[&] {
    tid.set_value(current_tid());
    for (const auto named = steady_clock::now() + 300ms; steady_clock::now() < named;) {
    }
    set_current_thread_name("late");
    end.get_future().wait();
  }};
  const auto expected = tid.get_future().get();
  EXPECT_THAT(new_named_threads(before), ElementsAre(Pair(expected, "late")));
  end.set_value();
  late.join();
}

TEST(NewNamedThreads, ThatSleepUnderTheirCreatorsNameKeepIt) {
  const auto before = ids_before();
  std::promise<void> end;
  std::thread nameless{[&] { end.get_future().wait(); }};
  const auto begin = steady_clock::now();
  const auto found = new_named_threads(before);
  const auto took = steady_clock::now() - begin;
  end.set_value();
  nameless.join();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found.front().second, thread_name(current_tid()));
  EXPECT_LT(took, 9s) << "it waits ten for who lacks a CPU";
}

}  // namespace
}  // namespace cie::scheduling
