#include "knowledge/knowledge.hpp"

#include <vector>

#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

constexpr ProcessIndex kProcess{1};
constexpr ThreadIndex kThread{7};
constexpr CallbackIndex kCallback{3};

TimeWindow window(std::int64_t from, std::int64_t to) { return {Timestamp{from}, Timestamp{to}}; }

Gap gap(EventKinds kinds, TimeWindow when, std::optional<std::uint64_t> at_most = std::nullopt) {
  Gap made;
  made.kinds = kinds;
  made.window = when;
  made.at_most = at_most;
  return made;
}

Scope of_callback() {
  Scope scope;
  scope.process = kProcess;
  scope.callback = kCallback;
  return scope;
}

Scope of_thread() {
  Scope scope;
  scope.process = kProcess;
  scope.thread = kThread;
  return scope;
}

Hidden hidden(EventKinds kinds, TimeWindow when, Scope scope = of_callback()) {
  Hidden made;
  made.kinds = kinds;
  made.window = when;
  made.scope = scope;
  return made;
}

bool is_possible(const Knowledge& knowledge, const std::vector<Hidden>& all) {
  return knowledge.gap(all) != nullptr;
}

TEST(Knowledge, HidesWhatLiesInAGapOfItsKind) {
  Knowledge knowledge;
  knowledge.add(gap(kRunKinds, window(10, 20)));
  EXPECT_TRUE(is_possible(knowledge, {hidden(EventKind::run_start, window(20, 30))}));
  EXPECT_FALSE(is_possible(knowledge, {hidden(EventKind::run_start, window(21, 30))}));
  EXPECT_FALSE(is_possible(knowledge, {hidden(EventKind::thread_exit, window(10, 20))}));
  EXPECT_TRUE(is_possible(knowledge,
                          {hidden({EventKind::thread_exit, EventKind::run_end}, window(10, 20))}));
}

TEST(Knowledge, HidesNothingOfAnother) {
  Knowledge knowledge;
  auto of_one = gap(kRunKinds, window(10, 20));
  of_one.scope = of_callback();
  knowledge.add(of_one);
  auto another = of_callback();
  another.callback = CallbackIndex{4};
  auto elsewhere = of_callback();
  elsewhere.process = ProcessIndex{2};
  EXPECT_TRUE(is_possible(knowledge, {hidden(EventKind::run_start, window(10, 20))}));
  EXPECT_FALSE(is_possible(knowledge, {hidden(EventKind::run_start, window(10, 20), another)}));
  EXPECT_FALSE(is_possible(knowledge, {hidden(EventKind::run_start, window(10, 20), elsewhere)}));
  EXPECT_TRUE(is_possible(knowledge, {hidden(EventKind::run_start, window(10, 20), Scope{})}));
}

TEST(Knowledge, OfACpuHidesWhatAThreadDoesThatMayRunThere) {
  Knowledge knowledge{[](const Hidden& event, std::int32_t cpu) {
    return event.scope.thread == kThread && cpu == 1;
  }};
  auto on_cpu = gap(kRunKinds | kKernelKinds, window(10, 20));
  on_cpu.scope.cpu = 0;
  knowledge.add(on_cpu);
  EXPECT_FALSE(is_possible(knowledge, {hidden(EventKind::run_start, window(10, 20), of_thread())}));
  EXPECT_TRUE(is_possible(knowledge,
                          {hidden(EventKind::priority_inheritance, window(10, 20), of_thread())}));
  on_cpu.scope.cpu = 1;
  knowledge.add(on_cpu);
  EXPECT_TRUE(is_possible(knowledge, {hidden(EventKind::run_start, window(10, 20), of_thread())}));
}

TEST(Knowledge, IsProvenByProofsThatCoverAGapTogether) {
  Knowledge knowledge;
  knowledge.add(gap(kRunKinds, window(10, 20)));
  const auto start = hidden(EventKind::run_start, window(0, 100));
  knowledge.discharge(EventKind::run_start, of_callback(), window(5, 14));
  EXPECT_TRUE(is_possible(knowledge, {start}));
  Scope of_process;
  of_process.process = kProcess;
  knowledge.discharge(EventKind::run_start, of_process, window(15, 20));
  EXPECT_FALSE(is_possible(knowledge, {start}));
  EXPECT_TRUE(is_possible(knowledge, {hidden(EventKind::run_end, window(0, 100))}));
}

TEST(Knowledge, IsNotProvenForWhatBelongsToANumberingThatNobodySaw) {
  Knowledge knowledge;
  knowledge.add(gap(kStateKinds, window(10, 20)));
  knowledge.discharge(EventKind::applied, of_thread(), window(0, 100));
  auto read_back = hidden(EventKind::applied, window(0, 100), of_thread());
  EXPECT_FALSE(is_possible(knowledge, {read_back}));
  read_back.is_unnumbered = true;
  EXPECT_TRUE(is_possible(knowledge, {read_back}));
}

TEST(Knowledge, HidesNoMoreEventsThanAGapCounts) {
  Knowledge knowledge;
  knowledge.add(gap(kStateKinds, window(10, 20), 1));
  const auto exit = hidden(EventKind::thread_exit, window(0, 100), of_thread());
  const auto announcement = hidden(EventKind::announcement, window(0, 100), of_thread());
  EXPECT_TRUE(is_possible(knowledge, {exit}));
  EXPECT_FALSE(is_possible(knowledge, {exit, announcement}));
  knowledge.add(gap(kStateKinds, window(50, 60), 1));
  EXPECT_TRUE(is_possible(knowledge, {exit, announcement}));
}

TEST(Knowledge, UsesUpACountByWhatIsHiddenForCertain) {
  Knowledge knowledge;
  knowledge.add(gap(kRunKinds | kStateKinds, window(10, 20), 1));
  knowledge.expect(hidden(EventKind::run_start, window(5, 30)));
  const auto exit = hidden(EventKind::thread_exit, window(0, 100), of_thread());
  EXPECT_TRUE(is_possible(knowledge, {exit}));
  knowledge.settle();
  EXPECT_FALSE(is_possible(knowledge, {exit}));
  EXPECT_TRUE(
      is_possible(knowledge, {hidden(EventKind::run_start, window(0, 100))}));  // it is that one
  auto another = of_callback();
  another.callback = CallbackIndex{4};
  EXPECT_FALSE(is_possible(knowledge, {hidden(EventKind::run_start, window(0, 100), another)}));
}

TEST(Knowledge, BoundsAHiddenEventByTheGapsThatMayHideIt) {
  Knowledge knowledge;
  knowledge.add(gap(kRunKinds, window(10, 20)));
  knowledge.add(gap(kRunKinds, window(40, 50)));
  knowledge.add(gap(kRunKinds, window(70, 80)));
  EXPECT_EQ(knowledge.bounds(hidden(EventKind::run_start, window(15, 60))), window(15, 50));
}

// Time that grows with the square of their number would be minutes.
TEST(Knowledge, TakesAMillionDamagedPackets) {
  Knowledge knowledge;
  for (std::int64_t i = 0; i < 1'000'000; ++i) {
    knowledge.add(gap(kRunKinds, window(10 * i, 10 * i + 1)));
    knowledge.discharge(EventKind::run_start, of_callback(), window(10 * i, 10 * i + 5));
  }
  EXPECT_TRUE(is_possible(knowledge, {hidden(EventKind::run_end, window(9'999'990, 9'999'991))}));
}

}  // namespace
}  // namespace cie::analysis
