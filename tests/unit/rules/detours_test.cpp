// M4 of a callback that comes to the thread that replaced another one by way of a third.
#include "support/verdicts.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using testing::AllOf;
using testing::HasSubstr;

// Where it ran meanwhile, another thread lives all along.
TEST(MappingPersistent, FailsWhenACallbackGoesToTheNewThreadByWayOfAThirdOne) {
  auto trace = trace_of(R"(
    callback fusion pooled
    thread t1 pool tid=101
    thread t2 pool tid=102
    thread t3 pool tid=103
    10 start fusion on=t1
    12 end fusion on=t1
    14 finish t1
    18 begin t2
    20 start fusion on=t3
    22 end fusion on=t3
    30 start fusion on=t2
    32 end fusion on=t2)");
  const Verified verified(trace);
  EXPECT_EQ(verified.of("M4", "callback fusion"), Verdict::fail);
  EXPECT_THAT(verified.evidence("M4", "callback fusion"),
              AllOf(HasSubstr("14 thread_fini"), HasSubstr("18 thread_init"),
                    HasSubstr("30 callback_start")));
  trace.erase<ThreadFini>([](const ThreadFini& e, const EventHead&) { return e.tid == 101; });
  EXPECT_EQ(Verified(trace).of("M4", "callback fusion"), Verdict::inconclusive) << "L2";
}

TEST(MappingPersistent, AcceptsAMoveByWayOfAThirdThreadAfterANewRegistration) {
  const auto registered = [](const std::string& time) {
    return Verified(R"(
    callback fusion pooled
    thread t1 pool
    thread t2 pool
    thread t3 pool
    10 start fusion on=t1
    12 end fusion on=t1
    14 finish t1
    18 begin t2
    20 start fusion on=t3
    22 end fusion on=t3
    30 start fusion on=t2
    32 end fusion on=t2
    )" + time + " init fusion")["M4"];
  };
  EXPECT_EQ(registered("16"), Verdict::pass);
  EXPECT_EQ(registered("25"), Verdict::pass);
  EXPECT_EQ(registered("40"), Verdict::fail);
}

}  // namespace
}  // namespace cie::test
