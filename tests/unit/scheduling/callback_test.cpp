// How the life of a callback ends.
#include <cie/scheduling/callback.hpp>

#include "loop_support.hpp"

#include <atomic>
#include <thread>

#include <gtest/gtest.h>

namespace cie::scheduling {
namespace {

// An instance is counted until it has returned; then the last one to know lets go, once.
TEST(AnyCallback, EndsWhenItsInstanceHas) {
  std::atomic<bool> is_inside{false};
  std::atomic<bool> may_end{false};
  std::atomic<bool> has_ended{false};
  Counted callback{group(GroupType::reentrant), [&] {
                     EXPECT_TRUE(Callback::is_in_instance());
                     is_inside = true;
                     while (!may_end)
                       std::this_thread::yield();
                     has_ended = true;
                   }};
  callback.release();
  std::thread runner{[&] { callback.execute_one(); }};
  while (!is_inside)
    std::this_thread::yield();
  callback.release();
  callback.close();
  EXPECT_FALSE(callback.execute_one()) << "no instance begins any more";
  std::thread first{[&] {
    callback.end();
    EXPECT_TRUE(has_ended);
  }};
  may_end = true;
  callback.end();
  EXPECT_TRUE(has_ended);
  runner.join();
  first.join();
  EXPECT_FALSE(Callback::is_in_instance());
}

TEST(AnyCallback, DoesNotWaitForItself) {
  Counted callback{group(GroupType::mutually_exclusive), [&callback] {
                     callback.end();
                     EXPECT_TRUE(callback.is_closed());
                   }};
  callback.release();
  EXPECT_TRUE(callback.execute_one());
}

}  // namespace
}  // namespace cie::scheduling
