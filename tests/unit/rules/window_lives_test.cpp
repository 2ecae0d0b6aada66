// `--window`: callbacks that ran, began or returned outside it, and threads that were gone before.
#include "windows.hpp"

#include <string>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;

TEST(Window, ACallbackRanOutsideItIfItsTotalSaysSo) {
  auto trace = trace_of(R"(
    callback seldom
    callback often
    5 start seldom
    6 end seldom
    10 start often
    12 end often
    20 fini seldom
    30 start often
    32 end often)");
  trace.erase<CallbackStart>([](const auto&, const EventHead& head) { return head.time.ns == 5; });
  trace.erase<CallbackEnd>([](const auto&, const EventHead& head) { return head.time.ns == 6; });
  constexpr const char* kSpec = "callback_groups:\n  - {id: seldom}\n";
  EXPECT_EQ(Verified(trace, kSpec)["M1"], Verdict::pass);
  EXPECT_EQ(Verified(trace, kSpec, window(25, 40))["M1"], Verdict::pass);
  EXPECT_EQ(Verified(trace, kSpec, window(8, 15))["M1"], Verdict::pass);
}

}  // namespace
}  // namespace cie::test
