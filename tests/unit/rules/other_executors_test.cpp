// Recordings of executors that read nothing back, held against the file of their configurator.
#include "support/verdicts.hpp"

#include <algorithm>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using ::testing::HasSubstr;

// Two callbacks, each on a thread of its own, as a translator of another vocabulary tells of them;
// the kernel shows their threads at real-time priority 50 on CPU 1 and at nice 0 on CPU 0.
AnalysisResult verified(const std::string& spec_text, bool has_kernel = true) {
  const auto spec = SchedulingSpec::parse(spec_text, "callback_groups.yaml");
  AnalysisOptions options;
  options.spec = &spec;
  Analyzer analyzer(options);
  const auto push = [&analyzer](std::int64_t time, std::uint32_t stream, std::int64_t tid,
                                std::int32_t cpu, const EventBody& body) {
    Event event{
        .head = {.time = {time}, .stream = StreamIndex{stream}, .cpu = cpu, .pid = 1, .tid = tid},
        .body = body};
    event.head.is_derived = stream == 0;
    analyzer.consume(event);
  };
  push(0, 0, 0, 0, StreamBegin{});
  StreamBegin kernel;
  kernel.channel = 1;
  kernel.domain = Domain::kernel;
  if (has_kernel) push(0, 1, 0, 0, kernel);
  push(0, 0, 0, 0, PacketBegin{});
  if (has_kernel) push(0, 1, 0, 0, PacketBegin{});
  const auto run = [&](std::int64_t time, std::uint32_t id, const char* name, std::int32_t cpu,
                       std::int32_t prio) {
    const auto tid = 10 + static_cast<std::int64_t>(id);
    CallbackInit init;
    init.callback = CallbackId{id};
    init.kind = CallbackKind::timer;
    init.logical_id = name;
    init.group = kNoGroup;
    push(time, 0, tid, cpu, init);
    CallbackStart start;
    start.callback = CallbackId{id};
    push(time + 1, 0, tid, cpu, start);
    push(time + 2, 0, tid, cpu, CallbackEnd{.callback = CallbackId{id}, .seq = 0, .status = {}});
    SchedSwitch out;
    out.prev_tid = tid;
    out.prev_prio = prio;
    out.prev_state = 1;
    if (has_kernel) push(time + 3, 1, tid, cpu, out);
    SchedSwitch in;
    in.next_tid = tid;
    in.next_prio = prio;
    if (has_kernel) push(time + 4, 1, tid, cpu, in);
  };
  run(10, 1, "/fast@Timer(10)", 1, 99 - 50);
  run(20, 2, "/slow@Timer(20)", 0, 120);
  return analyzer.finish();
}

SubjectVerdict s1(const std::string& fields, bool has_kernel = true) {
  const auto result =
      verified("callback_groups:\n  - {id: /fast@Timer(10), " + fields + "}\n", has_kernel);
  for (const auto& rule : result.verdicts.rules) {
    if (rule.id == "S1" && !rule.subjects.empty()) return rule.subjects.front();
  }
  return {};
}

TEST(OtherExecutors, AreJudgedByThePriorityThatTheKernelShows) {
  EXPECT_EQ(s1("policy: SCHED_FIFO, priority: 50").verdict, Verdict::pass);
  EXPECT_EQ(s1("policy: SCHED_RR, priority: 50").verdict, Verdict::pass) << "they look alike";
  const auto wrong = s1("policy: SCHED_FIFO, priority: 51");
  EXPECT_EQ(wrong.verdict, Verdict::fail);
  EXPECT_THAT(viewer_export::sentence(wrong.evidence.at(0).note),
              HasSubstr("callback_groups.yaml:2 asks for SCHED_FIFO 51"));
  EXPECT_THAT(viewer_export::sentence(wrong.evidence.at(0).note),
              HasSubstr("schedules thread 11 with real-time priority 50"));
  EXPECT_EQ(s1("policy: SCHED_OTHER, nice: 0").verdict, Verdict::fail);
  EXPECT_EQ(s1("policy: SCHED_DEADLINE, runtime: 2000, deadline: 3000, period: 4000").verdict,
            Verdict::fail);
}

TEST(OtherExecutors, AreJudgedByTheCpuThatTheyLastRanOn) {
  EXPECT_EQ(s1("affinity: [1]").verdict, Verdict::pass);
  EXPECT_EQ(s1("affinity: [0]").verdict, Verdict::fail);
  EXPECT_EQ(s1("affinity: ~, policy: SCHED_FIFO, priority: 50").verdict, Verdict::pass);
}

TEST(OtherExecutors, WithoutKernelEventsAreUndecided) {
  EXPECT_EQ(s1("policy: SCHED_FIFO, priority: 51", false).verdict, Verdict::inconclusive);
}

TEST(OtherExecutors, AreHeldAgainstTheConfiguratorsFileAsItIs) {
  const auto result = verified(R"(callback_groups:
  - id: /fast@Timer(10)@Waitable
    affinity:
      - 1
    policy: SCHED_FIFO
    priority: 50

  - id: /slow@Timer(20)
    affinity: ~
    policy: SCHED_OTHER
    priority: 0
)");
  const auto rule = std::ranges::find(result.verdicts.rules, "S1", &RuleVerdict::id);
  ASSERT_NE(rule, result.verdicts.rules.end());
  EXPECT_EQ(rule->subjects.size(), 2U);
  EXPECT_EQ(rule->verdict, Verdict::pass);
}

}  // namespace
}  // namespace cie::test
