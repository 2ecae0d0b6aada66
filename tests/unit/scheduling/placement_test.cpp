// Which callbacks a placement serves, and until when.
#include <cie/scheduling/own_thread.hpp>
#include <cie/scheduling/placement.hpp>
#include <cie/scheduling/serial_loop.hpp>
#include <cie/scheduling/shared_pool.hpp>
#include <cie/scheduling/thread_per_group.hpp>

#include "loop_support.hpp"

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace cie::scheduling {
namespace {

class PlacementTest : public testing::Test {
 protected:
  struct Counting {
    explicit Counting(std::shared_ptr<GroupState> group)
        : callback(std::make_shared<Counted>(std::move(group), [this] {
            ran_on = std::this_thread::get_id();
            ++runs;  // last: run_once() waits for it
          })) {}
    void run_once() {
      const int before = runs;
      callback->release();
      wait_for(runs, before + 1);
    }
    std::atomic<int> runs{0};
    std::atomic<std::thread::id> ran_on{};
    std::shared_ptr<Counted> callback;
  };
  static void serve(Placement& placement, const Placement::Callbacks& callbacks) {
    for (const auto& team : placement.serve(callbacks))
      team->open_gate();
  }
  static void end(Placement& placement) {
    placement.stop()();
    placement.clear();
  }

  ExecutorOptions options;
  ThreadConfigurator configurator{options};
  NoFailures failures;
  PlacementParts parts{options, configurator, failures};
  Counting a{group(GroupType::mutually_exclusive)};
  Counting b{group(GroupType::mutually_exclusive)};
};

TEST_F(PlacementTest, PerGroupGivesEachGroupAThread) {
  ThreadPerGroup placement{parts, make_lean_loop};
  serve(placement, {a.callback, b.callback});
  a.run_once();
  b.run_once();
  EXPECT_NE(a.ran_on.load(), b.ran_on.load());
  end(placement);
}

TEST_F(PlacementTest, ServesNoCallbackTwice) {
  options.threads = 2;
  ThreadPerGroup per_group{parts, make_lean_loop};
  SharedPool pool{parts, make_lean_loop};
  OwnThread own{std::make_unique<SerialLoop>(failures)};
  for (Placement* const placement : std::vector<Placement*>{&per_group, &pool, &own}) {
    serve(*placement, {a.callback});
    EXPECT_EQ(placement->serve({a.callback}).size(), 0U);
    placement->remove({a.callback})(Running::awaited);
    end(*placement);
  }
  a.callback->release();  // nobody serves it
  EXPECT_EQ(a.runs, 0);
}

TEST_F(PlacementTest, PerGroupKeepsAThreadUntilTheLastOfItsGroupGoes) {
  const auto shared = group(GroupType::mutually_exclusive);
  Counting first{shared};
  Counting second{shared};
  ThreadPerGroup placement{parts, make_lean_loop};
  serve(placement, {first.callback, second.callback});
  first.run_once();
  placement.remove({first.callback})(Running::awaited);
  first.callback->release();
  second.run_once();
  EXPECT_EQ(first.runs, 1);
  EXPECT_EQ(first.ran_on.load(), second.ran_on.load());
  placement.remove({second.callback})(Running::awaited);
  EXPECT_EQ(placement.serve({second.callback}).size(), 1U) << "a new team";
  end(placement);
}

TEST_F(PlacementTest, LeavesAloneWhatRunsAndSaysWhoIsToBeJoined) {
  std::atomic<bool> is_inside{false};
  std::atomic<bool> may_end{false};
  const auto callback = std::make_shared<Counted>(group(GroupType::mutually_exclusive), [&] {
    is_inside = true;
    while (!may_end)
      std::this_thread::yield();
  });
  ThreadPerGroup placement{parts, make_lean_loop};
  serve(placement, {callback});
  callback->release();
  while (!is_inside)
    std::this_thread::yield();
  const auto leaving = placement.remove({callback})(Running::left_alone);
  ASSERT_EQ(leaving.size(), 1U);
  EXPECT_FALSE(leaving.front()->has_left());
  EXPECT_TRUE(placement.remove({callback})(Running::left_alone).empty()) << "it has gone already";
  may_end = true;
  leaving.front()->join();
  EXPECT_TRUE(leaving.front()->has_left());
  end(placement);
}

// Each is forgotten at once, so that the second is seen to be the last.
TEST_F(PlacementTest, PerGroupEndsAThreadWhoseCallbacksGoSideBySide) {
  const auto shared = group(GroupType::mutually_exclusive);
  Counting first{shared};
  Counting second{shared};
  ThreadPerGroup placement{parts, make_lean_loop};
  serve(placement, {first.callback, second.callback});
  const auto vacate_first = placement.remove({first.callback});
  const auto vacate_second = placement.remove({second.callback});
  EXPECT_EQ(vacate_second(Running::left_alone).size(), 1U);
  vacate_first(Running::awaited);
  end(placement);
}

TEST_F(PlacementTest, KnowsWhoWouldWaitForHimself) {
  std::atomic<int> asked{0};
  std::atomic<bool> is_inside{false};
  ThreadPerGroup placement{parts, make_lean_loop};
  std::shared_ptr<Counted> callback;
  callback = std::make_shared<Counted>(group(GroupType::mutually_exclusive), [&] {
    is_inside = placement.is_on_thread_of({callback});
    ++asked;
  });
  serve(placement, {callback, a.callback});
  EXPECT_FALSE(placement.is_on_thread_of({callback}));
  callback->release();
  wait_for(asked, 1);
  EXPECT_TRUE(is_inside);
  end(placement);
}

}  // namespace
}  // namespace cie::scheduling
