// When the kernel of a host was recorded, by several traces.
#include "model/kernel_record.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using testing::ElementsAre;
using testing::IsEmpty;

Stretch stretch(std::int64_t begin, std::int64_t end) { return {{begin}, {end}}; }

KernelPart part(std::set<std::int32_t> cpus, std::int64_t begin, std::int64_t end,
                bool has_switches = true) {
  return {.has_switches = has_switches, .cpus = std::move(cpus), .covers = stretch(begin, end)};
}

TEST(KernelRecord, IsWhatOneOfItsTracesCovers) {
  EXPECT_THAT(recorded({part({0, 1}, 10, 20), part({0, 1}, 30, 40)}),
              ElementsAre(stretch(10, 20), stretch(30, 40)));
  EXPECT_THAT(recorded({part({0, 1}, 30, 40), part({0, 1}, 10, 35)}), ElementsAre(stretch(10, 40)));
  EXPECT_THAT(recorded({part({0, 1}, 10, 40), part({0, 1}, 20, 30)}), ElementsAre(stretch(10, 40)));
}

TEST(KernelRecord, GoesOnWhereNoTimeLiesBetween) {
  EXPECT_THAT(recorded({part({0}, 10, 20), part({0}, 20, 30)}), ElementsAre(stretch(10, 30)));
  EXPECT_THAT(recorded({part({0}, 10, 20), part({0}, 21, 30)}), ElementsAre(stretch(10, 30)));
  EXPECT_THAT(recorded({part({0}, 10, 20), part({0}, 22, 30)}),
              ElementsAre(stretch(10, 20), stretch(22, 30)));
}

TEST(KernelRecord, NeedsEveryCpuOfEachTime) {
  const std::vector parts{part({0}, 10, 40), part({0, 1}, 40, 60), part({1}, 5, 20)};
  EXPECT_THAT(recorded(parts), ElementsAre(stretch(10, 20), stretch(40, 60)));
  EXPECT_THAT(recorded(parts, 0), ElementsAre(stretch(10, 60)));
  EXPECT_THAT(recorded(parts, 1), ElementsAre(stretch(5, 20), stretch(40, 60)));
}

TEST(KernelRecord, OfATraceThatNamesNoCpuHasAll) {
  EXPECT_THAT(recorded({part({}, 10, 20), part({0, 1}, 20, 30)}), ElementsAre(stretch(10, 30)));
}

// One session records switches, another one wake-ups.
TEST(KernelRecord, NeedsTracesThatTellOfDifferentThings) {
  EXPECT_THAT(recorded({part({0}, 10, 40), part({0}, 20, 50, false)}),
              ElementsAre(stretch(20, 40)));
  EXPECT_THAT(recorded({part({0}, 10, 40, false)}), ElementsAre(stretch(10, 40)));
}

TEST(KernelRecord, IsEmptyWhereNothingIsCovered) {
  EXPECT_THAT(recorded({}), IsEmpty());
  EXPECT_THAT(recorded({KernelPart{.has_switches = true, .cpus = {0}}}), IsEmpty());
  EXPECT_THAT(recorded({part({0}, 10, 20), KernelPart{.has_switches = true, .cpus = {1}}}),
              IsEmpty())
      << "CPU 1 exists";
}

}  // namespace
}  // namespace cie::test
