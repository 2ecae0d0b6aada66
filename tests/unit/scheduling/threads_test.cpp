#include <cie/scheduling/started_threads.hpp>
#include <cie/scheduling/threads.hpp>

#include <chrono>
#include <cstdint>
#include <future>
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
StartedThreads after_the_first() {
  std::thread{[] {}}.join();
  return StartedThreads{};
}

// Busy threads stand for threads that wait for a CPU.
TEST(ThreadsThatAreStarted, AreWaitedForUntilTheyComeToNameThemselves) {
  const StartedThreads started = after_the_first();
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
  EXPECT_THAT(started.named(), ElementsAre(Pair(expected, "late")));
  end.set_value();
  late.join();
}

TEST(ThreadsThatAreStarted, AreNotThoseThatOthersStartMeanwhile) {
  std::promise<void> begin;
  std::promise<void> has_begun;
  std::promise<void> end;
  const auto ended = end.get_future().share();
  std::thread other{[&] {
    begin.get_future().wait();
    std::thread stranger{[&] {
      set_current_thread_name("stranger");
      has_begun.set_value();
      ended.wait();
    }};
    stranger.join();
  }};
  const StartedThreads started = after_the_first();
  begin.set_value();
  has_begun.get_future().wait();
  std::promise<std::uint32_t> tid;
  std::thread own{[&] {
    set_current_thread_name("own");
    tid.set_value(current_tid());
    ended.wait();
  }};
  const auto expected = tid.get_future().get();
  EXPECT_THAT(started.named(), ElementsAre(Pair(expected, "own")));
  end.set_value();
  own.join();
  other.join();
}

TEST(ThreadsThatAreStarted, ThatSleepUnderTheirCreatorsNameKeepIt) {
  const StartedThreads started = after_the_first();
  std::promise<void> end;
  std::thread nameless{[&] { end.get_future().wait(); }};
  const auto begin = steady_clock::now();
  const auto found = started.named();
  const auto took = steady_clock::now() - begin;
  end.set_value();
  nameless.join();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found.front().second, thread_name(current_tid()));
  EXPECT_LT(took, 9s) << "it waits ten for who lacks a CPU";
}

}  // namespace
}  // namespace cie::scheduling
