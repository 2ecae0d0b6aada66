// A thread without `thread_fini` works until the user's record of it ends: what the kernel shows of it
// behind that may be in callbacks.
#include "kernel_traces.hpp"
#include "support/move_to_host.hpp"

#include <algorithm>
#include <cstdint>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using testing::HasSubstr;

constexpr StreamIndex kUserStream{0};
constexpr std::int64_t kStreamEnd = 92;  // of the streams

// From the first wait, at 1: outside its callback 10..11, 15..16, 50..51 and 90..91.
constexpr auto kUnended = R"(
  process app crash
  callback fusion
  0 switch 0 idle fusion
  1 switch 0 fusion idle state=1
  10 switch 0 idle fusion
  11 start fusion
  15 end fusion
  16 switch 0 fusion idle state=1
  50 switch 0 idle fusion
  51 start fusion
  90 end fusion
  91 switch 0 fusion idle state=1)";

std::string work_budget(std::int64_t per_second) {
  return "callback_groups:\n  - id: fusion\n    foreign_work_budget: " + std::to_string(per_second);
}

bool ends_stream(const Event& event) {
  return std::holds_alternative<PacketEnd>(event.body) ||
         std::holds_alternative<StreamEnd>(event.body);
}

void order(TextTrace& trace) {
  std::ranges::stable_sort(trace.events, {}, [](const Event& event) { return event.head.time; });
}

// As if the user's stream ended then.
TextTrace with_user_until(std::int64_t end, const std::string& more = "") {
  auto trace = trace_of(std::string(kUnended) + more);
  std::erase_if(trace.events, [end](const Event& event) {
    return event.head.stream == kUserStream && event.head.time.ns > end && !ends_stream(event);
  });
  for (auto& event : trace.events)
    if (event.head.stream == kUserStream && ends_stream(event)) event.head.time.ns = end;
  order(trace);
  return trace;
}

// Allows the thread exactly `work` in `span`.
void expect_foreign_work(const TextTrace& trace, const std::string& thread, std::int64_t work,
                         std::int64_t span) {
  const auto least = (work * 1'000'000'000 + span - 1) / span;
  EXPECT_EQ(Verified(trace, work_budget(least)).of("M6", thread), Verdict::pass) << span;
  EXPECT_THAT(Verified(trace, work_budget(least - 1)).evidence("M6", thread),
              HasSubstr(std::to_string(work) + " ns on a CPU outside callbacks within " +
                        std::to_string(span) + " ns"));
}

TEST(UserRecord, EndsTheWorkOfAThread) {
  expect_foreign_work(with_user_until(kStreamEnd), "thread 101", 2 + 2, kStreamEnd - 1);
  expect_foreign_work(with_user_until(40), "thread 101", 2, 40 - 1);
  expect_foreign_work(with_user_until(60), "thread 101", 2 + 1, 60 - 1);
}

TEST(UserRecord, EndsTheBusyTimeOfAThread) {
  const auto busy = [](std::int64_t end) {
    return thread_of(analyze(with_user_until(end)), 101).busy_ns;
  };
  EXPECT_EQ(busy(kStreamEnd), 1 + 6 + 41);
  EXPECT_EQ(busy(40), 1 + 6);
  EXPECT_EQ(busy(60), 1 + 6 + 10);
  constexpr auto kDies = "\n91 switch 0 idle fusion\n95 switch 0 fusion idle state=16";
  EXPECT_EQ(thread_of(analyze(with_user_until(40, kDies)), 101).busy_ns, 1 + 6);
}

TEST(UserRecord, EndsBeforeAWindowThatEndsLater) {
  AnalysisOptions options;
  options.window = TimeWindow{.from = {-20'000}, .to = {80}};
  const Verified verified(with_user_until(40), work_budget(52'000'000), options);
  EXPECT_EQ(verified.of("M6", "thread 101"), Verdict::pass) << "2 ns of 39";
}

// Two sessions, one after the other.
TEST(UserRecord, GoesOnInALaterTraceThatTellsOfTheThread) {
  constexpr StreamIndex kLaterStream{9};
  auto trace = with_user_until(kStreamEnd);
  for (auto& event : trace.events)
    if (event.head.stream == kUserStream && event.head.time.ns > 30)
      event.head.stream = kLaterStream;
  const auto begin = std::ranges::find_if(trace.events, [](const Event& event) {
    return event.head.stream == kUserStream && std::holds_alternative<StreamBegin>(event.body);
  });
  auto second = std::get<StreamBegin>(begin->body);
  second.trace = 1;
  second.channel = 9;
  const auto add = [&trace](std::int64_t time, StreamIndex stream, const EventBody& body) {
    trace.events.push_back(
        {.head = {.time = {time}, .stream = stream, .cpu = 0, .pid = {}, .tid = {}}, .body = body});
  };
  add(30, kUserStream, PacketEnd{});
  add(30, kUserStream, StreamEnd{});
  add(31, kLaterStream, second);
  add(31, kLaterStream, PacketBegin{});
  order(trace);
  expect_foreign_work(trace, "thread 101", 2 + 2, kStreamEnd - 1);
}

// By its own host's clock, whatever the other one's shows then.
TEST(UserRecord, EndsForEachHostByItself) {
  for (const std::int64_t ahead : {-50, 0, 50}) {
    const auto both = beside(trace_of(kUnended), with_user_until(60),
                             {.name = "desk", .monotonic = ahead, .realtime = 0});
    expect_foreign_work(both, "thread 101 (pid 100 on robot)", 2 + 2, kStreamEnd - 1);
    expect_foreign_work(both, "thread 101 (pid 100 on desk)", 2 + 1, 60 - 1);
  }
}

// Who records the kernel may do so for longer than the applications run.
TEST(UserRecord, EndsWhereGapsBetweenSwitchesCount) {
  const auto gaps = [](std::int64_t end) {
    const Verified verified(with_user_until(end, R"(
      thread rcu worker silent tid=7
      93 switch 1 idle rcu
      95 switch 1 fusion idle state=1
      96 switch 1 idle rcu
      98 switch 1 fusion idle state=1)"));
    const auto& defects = verified.result.report.defects;
    const auto found =
        std::ranges::find(defects, DefectKind::sched_switch_gaps, &TraceDefect::kind);
    return found == defects.end() ? 0U : found->count;
  };
  EXPECT_EQ(gaps(99), 2U);
  EXPECT_EQ(gaps(95), 1U);
  EXPECT_EQ(gaps(92), 0U);
}

}  // namespace
}  // namespace cie::test
