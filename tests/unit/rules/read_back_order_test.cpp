// S3 of read-backs of one nanosecond: whoever announces a change may do so from several CPUs.
#include "support/verdicts.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

using analysis::Event;
using analysis::Verdict;

using Compared = std::pair<Verdict, std::uint64_t>;  // how many were compared

// The verdicts of all orders in which the four read-backs of time 30 may be recorded, if they agree.
std::optional<Compared> compared_in_any_order(const std::string& last) {
  const auto trace = trace_of(
      "callback fusion\n-100 initial fusion\n10 start fusion\n12 end fusion\n"
      "30 applied fusion cpus=0,1\n30 audit fusion cpus=0,1 change=1\n"
      "30 applied fusion cpus=0 change=1\n30 audit fusion cpus=" +
      last + " change=1\n40 start fusion\n42 end fusion");
  const auto first =
      std::ranges::find(trace.events, 30, [](const Event& event) { return event.head.time.ns; }) -
      trace.events.begin();
  std::array<std::ptrdiff_t, 4> order{0, 1, 2, 3};
  std::optional<Compared> all;
  do {
    auto shuffled = trace;
    for (std::size_t i = 0; i < order.size(); ++i)
      shuffled.events[static_cast<std::size_t>(first) + i] =
          trace.events[static_cast<std::size_t>(first + order[i])];
    const Verified verified(shuffled);
    const auto subject = verified.on("S3", "thread 101");
    const Compared one{subject.verdict, subject.checked};
    if (all && *all != one) return std::nullopt;
    all = one;
  } while (std::ranges::next_permutation(order).found);
  return all;
}

TEST(ReadBacksOfOneNanosecond, AreComparedByTheirNumbers) {
  EXPECT_EQ(compared_in_any_order("0"), (Compared{Verdict::pass, 2}));
  EXPECT_EQ(compared_in_any_order("0,1"), (Compared{Verdict::fail, 2}));
}

}  // namespace
}  // namespace cie::test
