// What the screen says of violated rules: how often, by how much, why, and what to do.
#include "report_screens.hpp"
#include "sample_report.hpp"
#include "verify_screens.hpp"

#include <cstdint>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

using analysis::Verdict;
using testing::HasSubstr;
using testing::StartsWith;

TEST(VerifyScreen, CountsOfCallbacksCallbacksAlone) {
  using analysis::SubjectKind;
  const analysis::VerdictReport verdicts{
      .verdict = Verdict::fail,
      .rules = {{.id = "Q1",
                 .name = "no-queue-overflow",
                 .verdict = Verdict::fail,
                 .subjects = {judged(SubjectKind::callback, "callback /a", Verdict::fail),
                              judged(SubjectKind::callback, "callback /b", Verdict::pass),
                              judged(SubjectKind::trace, "trace", Verdict::inconclusive)}}}};
  EXPECT_THAT(screen_of(verdicts, test::sample_report()),
              StartsWith("FAIL  run 1: 1 of 2 callbacks lost messages\n"));
}

TEST(VerifyScreen, NamesViolatedRulesThatAreUndecidedOfSomeSubjects) {
  using analysis::SubjectKind;
  analysis::VerdictReport verdicts{.verdict = Verdict::fail, .rules = {}};
  for (const char* id : {"M2", "M3", "M4", "M5", "M6", "M7", "M8", "M9", "S1", "S2",
                         "S3", "S4", "S5", "E1", "E2", "E3", "R1", "R2", "R3", "R4"}) {
    verdicts.rules.push_back(
        {.id = id,
         .name = "rule",
         .verdict = Verdict::fail,
         .subjects = {judged(SubjectKind::thread, "thread 1", Verdict::fail),
                      judged(SubjectKind::thread, "thread 2", Verdict::inconclusive)}});
  }
  EXPECT_THAT(screen_of(verdicts, test::sample_report()),
              HasSubstr("\n  undecided in part: M2 M3 "));
  verdicts.rules[1].verdict = Verdict::inconclusive;
  verdicts.rules[1].subjects.erase(verdicts.rules[1].subjects.begin());
  EXPECT_THAT(screen_of(verdicts, test::sample_report()),
              HasSubstr("\n  undecided: M3; in part: M2 M4 "));
}

// Where it is undecided whether something is missing, no finding names it.
TEST(VerifyScreen, NamesWhatTheSpecHasAndTheRecordingHasNot) {
  const auto spec = SchedulingSpec::parse(
      "callback_groups:\n"
      "  - id: '/a/plan@Timer(20000000)'\n"
      "  - id: '/a/plam@Timer(20000000)'\n"
      "chains:\n  - {name: brake, callbacks: ['/a/plan@Timer(20000000)', '/b@Timer(1)']}\n",
      "specs/app.yaml");
  auto context = usual_verify_context();
  context.spec = &spec;
  const auto text = screen_of({.verdict = Verdict::inconclusive, .rules = {}},
                              test::sample_report(), {.columns = 120}, context);
  EXPECT_THAT(text, HasSubstr("  spec: 2 of 3 callbacks not in the recording: "
                              "/a/plam@Timer(20000000) (app.yaml:3), /b@Timer(1) (app.yaml:5)\n"));
}

// A misspelt node in "<node>/*" configures and judges nothing, and M1 is about exact ids.
TEST(VerifyScreen, NamesNodesOfTheSpecThatTheRecordingHasNot) {
  const auto spec = SchedulingSpec::parse(
      "callback_groups:\n"
      "  - id: '/a/plan@Timer(20000000)'\n"
      "  - id: '/a/plan/*'\n"
      "  - id: '/a/*'\n",
      "specs/app.yaml");
  auto context = usual_verify_context();
  context.spec = &spec;
  const auto text = screen_of({.verdict = Verdict::pass, .rules = {}}, test::sample_report(),
                              {.columns = 120}, context);
  EXPECT_THAT(text, HasSubstr("  spec: 1 of 3 ids not in the recording: /a/* (app.yaml:4)\n"));
}

TEST(VerifyScreen, OfADeadlineSaysHowOftenHowMuchAndWhy) {
  auto verdicts = test::sample_verdicts();
  verdicts.rules = {{.id = "R3",
                     .name = "deadline",
                     .verdict = Verdict::fail,
                     .subjects = {{.about = {.kind = analysis::SubjectKind::callback, .index = 0},
                                   .subject = "callback /a/plan@Timer(20000000)",
                                   .verdict = Verdict::fail,
                                   .checked = 7,
                                   .evidence = {}}}}};
  auto context = usual_verify_context();
  const auto spec = SchedulingSpec::parse(
      "callback_groups:\n\n\n\n\n\n  - {id: '/a/plan@Timer(20000000)', response_deadline: 100000}\n",
      "specs/app.yaml");
  context.spec = &spec;
  context.worst_runs = {{.callback = analysis::CallbackIndex{0},
                         .seq = 3,
                         .start = {983'001'500'000},
                         .response_time = {289'415},
                         .start_latency = analysis::Duration{14'885},
                         .preempted = analysis::Duration{200'000},
                         .preempted_by = "cc1plus",
                         .preempted_by_time = {200'000}}};
  auto report = test::sample_report();  // seven instances
  report.callbacks[0].response_deadline = analysis::Duration{100'000};
  report.callbacks[0].late = 5;
  EXPECT_THAT(
      screen_of(verdicts, report, {.columns = 120}, context),
      StartsWith(
          "FAIL  run 1: 1 of 1 callback missed deadlines: late 5 of 7 instances\n"
          "  R3 deadline                    1 of 1 callback missed deadlines\n"
          "     plan timer 20 ms  late 5 of 7, up to 289.4 us > 100.0 us "
          "(app.yaml:7)\n"
          "     worst: instance 3 at +1.500 ms took 289.4 us: 200.0 us preempted by cc1plus, "
          "14.88 us waiting to start\n"));
}

// The timer is late more often and takes longest of all, 54.39 ms; that is 1.1 times its deadline.
// The 45.89 ms of the subscription are 4.6 times its own.
TEST(VerifyScreen, OfDeadlinesSaysByWhatTheyAreOrderedAndWhoseTheWorstRunIs) {
  const auto failed = [](std::uint32_t index) {
    return analysis::SubjectVerdict{
        .about = {.kind = analysis::SubjectKind::callback, .index = index},
        .subject = "callback",
        .verdict = Verdict::fail,
        .checked = 7,
        .evidence = {}};
  };
  const analysis::VerdictReport verdicts{.verdict = Verdict::fail,
                                         .rules = {{.id = "R3",
                                                    .name = "deadline",
                                                    .verdict = Verdict::fail,
                                                    .subjects = {failed(0), failed(1)}}}};
  auto report = test::sample_report();
  report.callbacks[0].response_deadline = analysis::Duration{50'000'000};
  report.callbacks[0].response_time = test::summary(1'000'000, 54'390'000, 7);
  report.callbacks[0].late = 5;
  report.callbacks[1].response_deadline = analysis::Duration{10'000'000};
  report.callbacks[1].response_time_lower = test::summary(1'000'000, 45'890'000, 7);
  report.callbacks[1].late = 2;
  auto context = usual_verify_context();
  for (std::uint32_t i = 0; i < 2; ++i) {
    context.worst_runs.push_back({.callback = analysis::CallbackIndex{i},
                                  .seq = 3,
                                  .start = {983'001'500'000},
                                  .response_time = {i == 0 ? 54'390'000 : 45'890'000},
                                  .blocked = analysis::Duration{40'000'000}});
  }
  EXPECT_THAT(
      screen_of(verdicts, report, {.columns = 120}, context),
      HasSubstr(
          "  R3 deadline                    2 of 2 callbacks missed deadlines, worst first\n"
          "     lidar <- /sensing/lidar/top/points_raw  late 2 of 7, up to 45.89 ms > 10.00 ms\n"
          "     worst: instance 3 at +1.500 ms took 45.89 ms: 40.00 ms blocked\n"
          "     plan timer 20 ms                        late 5 of 7, up to 54.39 ms > 50.00 ms\n"));
}

// By how much of what the spec allows: 300 us of 100 us, and 1 ms of 900 us, which checked more.
TEST(VerifyScreen, OfBudgetsHasTheWorstFirst) {
  const auto failed = [](std::uint32_t index, std::uint64_t checked) {
    return analysis::SubjectVerdict{
        .about = {.kind = analysis::SubjectKind::callback, .index = index},
        .subject = "callback",
        .verdict = Verdict::fail,
        .checked = checked,
        .evidence = {{.event = "callback_start",
                      .time = analysis::Timestamp{1},
                      .cpu = {},
                      .pid = {},
                      .tid = {},
                      .note = {}},
                     {.event = "callback_end",
                      .time = analysis::Timestamp{2},
                      .cpu = {},
                      .pid = {},
                      .tid = {},
                      .note = analysis::free_text("of callback " + std::to_string(index))}}};
  };
  const analysis::VerdictReport verdicts{.verdict = Verdict::fail,
                                         .rules = {{.id = "R4",
                                                    .name = "budget",
                                                    .verdict = Verdict::fail,
                                                    .subjects = {failed(1, 70), failed(0, 7)}}}};
  auto report = test::sample_report();
  report.callbacks[0].execution_time = test::summary(1'000, 300'000, 7);
  report.callbacks[1].execution_time = test::summary(1'000, 1'000'000, 70);
  const auto spec = SchedulingSpec::parse(
      "callback_groups:\n"
      "  - {id: '/a/plan@Timer(20000000)', wcet: 100000}\n"
      "  - {id: '/perception/lidar@Subscription(/sensing/lidar/top/"
      "points_raw)', wcet: 900000}\n",
      "app.yaml");
  auto context = usual_verify_context();
  context.spec = &spec;
  EXPECT_THAT(screen_of(verdicts, report, {.columns = 120}, context),
              HasSubstr("2 of 2 callbacks exceeded the budget\n"
                        "     plan timer 20 ms                        of callback 0\n"
                        "     lidar <- /sensing/lidar/top/points_raw  of callback 1\n"));
}

// It took up to 289.4 us and was released every 100 us at least, of different instances, unless one
// was seen to end after the next release.
TEST(VerifyScreen, OfARestartSaysWhatWasAndWhatIs) {
  analysis::VerdictReport verdicts;
  verdicts.verdict = Verdict::fail;
  analysis::SubjectVerdict subject{
      .subject = "callback 1", .verdict = Verdict::fail, .checked = 1, .evidence = {}};
  for (const auto* note : {"was: timer", "is: service", "was: nice 3", "is: nice 5"}) {
    analysis::Evidence evidence{};
    evidence.event = "thread_sched";
    evidence.note = analysis::free_text(note);
    subject.evidence.push_back(evidence);
  }
  verdicts.rules = {{.id = "M5",
                     .name = "mapping-survives-restart",
                     .verdict = Verdict::fail,
                     .subjects = {subject}}};
  EXPECT_THAT(screen_of(verdicts, test::sample_report()),
              HasSubstr("was: timer; is: service; was: nice 3; is: nice 5\n"));
}

TEST(VerifyScreen, OfArrivalsSaysWhatWasFoundOfOneInstanceOrOfSeveral) {
  const auto text = [](const std::string& event, std::int64_t shortest) {
    auto verdicts = test::sample_verdicts();
    const analysis::Evidence first{.event = event,
                                   .time = analysis::Timestamp{983'005'016'596},
                                   .cpu = 0,
                                   .pid = 4001,
                                   .tid = 4008,
                                   .note = analysis::free_text("seq 3")};
    verdicts.rules = {{.id = "R1",
                       .name = "arrival-exceeds-turnaround",
                       .verdict = Verdict::fail,
                       .subjects = {{.about = {.kind = analysis::SubjectKind::callback, .index = 0},
                                     .subject = "callback /a/plan@Timer(20000000)",
                                     .verdict = Verdict::fail,
                                     .checked = 7,
                                     .evidence = {first}}}}};
    auto report = test::sample_report();
    report.callbacks[0].inter_arrival = test::summary(shortest, 20'000'000, 6);
    return screen_of(verdicts, report, {.columns = 120});
  };
  const std::string of_several =
      "FAIL  run 1: 1 of 1 callback overran the next release\n"
      "  R1 arrival-exceeds-turnaround  1 of 1 callback overran the next release\n"
      "     plan timer 20 ms  up to 289.4 us, releases as close as 100.0 us";
  EXPECT_THAT(text("callback_start", 100'000), StartsWith(of_several + "\n"));
  EXPECT_THAT(text("callback_end", 100'000), StartsWith(of_several + "; one overran\n"));
  EXPECT_THAT(text("callback_start", 289'414),
              HasSubstr("  up to 289.4 us, releases as close as 289.4 us (1 ns less)\n"));
  EXPECT_THAT(text("callback_start", 289'415),
              HasSubstr("  up to 289.4 us, releases as close as 289.4 us\n"));
}

// One that took the place of another has the id of that.
TEST(VerifyScreen, NamesACallbackOfSeveralLifetimesOnce) {
  auto report = shared_report();
  auto later = report.callbacks[0];
  later.index = analysis::CallbackIndex{3};
  later.lifetime = 2;
  report.callbacks.push_back(later);
  report.threads[1].ran = {analysis::CallbackIndex{0}, analysis::CallbackIndex{3}};
  EXPECT_THAT(screen_of(test::sample_verdicts(), report, {.columns = 120}),
              HasSubstr("1 callback in 2 lifetimes: plan timer 20 ms\n"));
}

TEST(VerifyScreen, AdvisesWhatFitsTheKindOfTheCallbacksThatOverran) {
  const auto text = [](CallbackKind kind, CallbackKind of_other) {
    auto verdicts = test::sample_verdicts();
    const auto failing = [](std::uint32_t index) {
      return analysis::SubjectVerdict{
          .about = {.kind = analysis::SubjectKind::callback, .index = index},
          .subject = "callback " + std::to_string(index),
          .verdict = Verdict::fail,
          .checked = 2,
          .evidence = {}};
    };
    verdicts.rules = {{.id = "R1",
                       .name = "arrival-exceeds-turnaround",
                       .verdict = Verdict::fail,
                       .subjects = {failing(0), failing(1)}}};
    auto report = test::sample_report();
    report.callbacks[0].kind = kind;
    report.callbacks[1].kind = of_other;
    return screen_of(verdicts, report, {.columns = 200});
  };
  using enum CallbackKind;
  EXPECT_THAT(text(timer, timer), HasSubstr("or give it a longer period; cie report"));
  EXPECT_THAT(text(subscription, subscription), HasSubstr("or let its publishers send less often"));
  EXPECT_THAT(text(waitable, waitable), HasSubstr("or let what it waits for (goals, events)"));
  EXPECT_THAT(text(timer, subscription),
              HasSubstr("a timer with a longer period, anything else by"));
}

TEST(VerifyScreen, SaysOfAGroupThatItIsOne) {
  auto verdicts = test::sample_verdicts();
  auto& rule = verdicts.rules[2];
  rule.id = "M8";
  auto& subject = rule.subjects[1];
  subject.about = {.kind = analysis::SubjectKind::group, .process = subject.about.process};
  subject.subject = "group 0";
  subject.evidence.resize(1);
  subject.evidence[0].note = analysis::free_text("a group of 2 callbacks");
  rule.subjects = {subject};
  EXPECT_THAT(screen_of(verdicts, test::sample_report()),
              HasSubstr("     group 0  a group of 2 callbacks\n"));
}

}  // namespace
}  // namespace cie::viewer_export
