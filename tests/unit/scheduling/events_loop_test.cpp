#include <cie/scheduling/events_loop.hpp>

#include "loop_support.hpp"

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace cie::scheduling {
namespace {

// Three callbacks that write down their turn.
class EventsLoopTest : public testing::Test {
 protected:
  std::shared_ptr<Counted> writing(char letter) {
    return std::make_shared<Counted>(group(GroupType::mutually_exclusive), [this, letter] {
      order += letter;
      ++runs;
    });
  }
  NoFailures failures;
  EventsLoop loop{failures};
  std::string order;
  std::atomic<int> runs{0};
  std::shared_ptr<Counted> a = writing('a');
  std::shared_ptr<Counted> b = writing('b');
  std::shared_ptr<Counted> c = writing('c');
};

TEST_F(EventsLoopTest, ServesInTheOrderOfReadiness) {
  for (const auto& callback : {b, c, a}) {
    callback->release();  // of it the loop learns as the callback is added
    loop.add(callback);
  }
  {
    const RunningLoop running{loop, 1};
    wait_for(runs, 3);
    loop.remove({a, b, c});
  }
  EXPECT_EQ(order, "bca");
}

TEST_F(EventsLoopTest, LetsAFullQueueHoldUpNobody) {
  for (int i = 0; i < 4; ++i)
    a->release();
  b->release();
  for (const auto& callback : {a, b})
    loop.add(callback);
  {
    const RunningLoop running{loop, 1};
    wait_for(runs, 5);
    loop.remove({a, b});
  }
  EXPECT_EQ(order, "abaaa");
}

TEST_F(EventsLoopTest, ForgetsAReadyCallbackThatIsRemovedAndKeepsTheOthers) {
  for (const auto& callback : {a, b, c}) {
    callback->release();
    loop.add(callback);
  }
  loop.remove({b});
  b.reset();  // nothing may touch it any more
  {
    const RunningLoop running{loop, 1};
    wait_for(runs, 2);
    loop.remove({a, c});
  }
  EXPECT_EQ(order, "ac");
}

}  // namespace
}  // namespace cie::scheduling
