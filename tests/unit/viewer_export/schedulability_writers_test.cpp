#include <cie/viewer_export/schedulability_writers.hpp>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace cie::viewer_export {
namespace {

using analysis::ParameterSource;
using ::testing::Contains;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Le;
using ::testing::MatchesRegex;
using ::testing::Not;
using ::testing::SizeIs;
using ::testing::StartsWith;

analysis::SchedulabilityReport sample() {
  analysis::CallbackSchedulability bounded{
      .logical_id = "/plan@Timer(1)",
      .tid = 5,
      .policy = "SCHED_FIFO",
      .priority = 80,
      .cpus = {0},
      .execution = analysis::TaskParameter{2'000'000, ParameterSource::measured},
      .period = analysis::TaskParameter{10'000'000, ParameterSource::declared},
      .deadline = analysis::TaskParameter{3'000'000, ParameterSource::declared},
      .method = analysis::BoundMethod::fixed_priority,
      .bound_ns = 4'000'000,
      .reason = {},
      .observed_ns = 4'500'000,
      .explanations = {{"kernel", "the kernel took 1.0 us", 1'000}},
      .is_flagged = true};
  analysis::CallbackSchedulability unbounded;
  unbounded.logical_id = "/other\x1b";
  unbounded.reason = "it never ran";
  return {.callbacks = {bounded, unbounded},
          .cpus = {{.cpu = 0, .real_time_ppb = 200'000'000}},
          .deadline = {{.cpus = {0},
                        .servers = 2,
                        .processors = 1,
                        .reserved_ppb = 980'000'000,
                        .admissible_ppb = 950'000'000,
                        .is_guaranteed = true}},
          .outside = {"thread 9 \"recv\" (SCHED_FIFO 90)"}};
}

// The report that is said to have been analysed: it has the callbacks' process.
analysis::Report analyzed() {
  analysis::Report report;
  report.processes.emplace_back().pid = 4;
  return report;
}

std::string text_of(const analysis::SchedulabilityReport& report) {
  std::ostringstream out;
  write_schedulability_text(out, report, analyzed(), {});
  return out.str();
}

TEST(SchedulabilityText, SaysOutcomeBoundsAndWhatIsNotInThem) {
  const auto text = text_of(sample());
  EXPECT_THAT(
      text, StartsWith("1 of 2 callbacks has a bound; 1 of 1 deadline not guaranteed; 1 above the "
                       "bound without explanation\n"));
  EXPECT_THAT(text, HasSubstr("CPU 0: real-time callbacks demand up to 20.00 %\n"));
  EXPECT_THAT(
      text,
      HasSubstr(
          "SCHED_DEADLINE: 2 threads reserve 98.00 % of 1 CPU; the kernel admits "
          "95.00 % by default; the EDF\n  test shows that each gets its runtime by its deadline\n"));
  EXPECT_THAT(text,
              HasSubstr("observed is 500.0 us above the bound, NOT explained by what is known:\n"
                        "      - the kernel took 1.0 us\n"));
  EXPECT_THAT(text, HasSubstr("Without a bound\n  1 callback: it never ran\n      /other\\x1b\n"));
  EXPECT_THAT(text, HasSubstr("thread 9 \"recv\" (SCHED_FIFO 90)"));
}

TEST(SchedulabilityText, NamesTheWindowThatWasAskedFor) {
  auto of = analyzed();
  of.trace.recording_begin = analysis::Timestamp{0};
  of.trace.begin = analysis::Timestamp{7};
  of.trace.end = analysis::Timestamp{9};
  std::ostringstream text;
  write_schedulability_text(text, sample(), of, {});
  EXPECT_THAT(text.str(), HasSubstr("\nmeasured in the window 7..9 ns (2 ns) alone\n"));
  std::ostringstream json;
  write_schedulability_json(json, sample(), of);
  const auto window = nlohmann::json::parse(json.str()).at("window");
  EXPECT_EQ(window, nlohmann::json::parse(R"({"begin_ns": 7, "end_ns": 9})"));
}

// An EDF test is of the runtime alone.
TEST(SchedulabilityText, NamesWhatExecutesBeyondTheRuntimeOfItsThread) {
  auto report = sample();
  auto& callback = report.callbacks[0];
  callback.policy = "SCHED_DEADLINE";
  callback.runtime_ns = callback.execution->ns;
  EXPECT_THAT(text_of(report), Not(HasSubstr("throttled"))) << "2 ms of 2 ms";
  callback.execution->ns += 3'000'000;
  EXPECT_THAT(
      text_of(report),
      HasSubstr("/plan@Timer(1) executes for longer than the runtime of its thread, which is "
                "then throttled: 5.000 ms\n  of 2.000 ms\n"));
  callback.waiting_ns = 3'000'000;
  EXPECT_THAT(text_of(report), Not(HasSubstr("throttled"))) << "waiting takes no runtime";
  callback.waiting_ns = 1'000'000;
  report.callbacks.push_back(callback);
  EXPECT_THAT(
      text_of(report),
      HasSubstr("2 callbacks execute for longer than the runtime of their threads, which is then "
                "throttled:\n  /plan@Timer(1) 4.000 ms of 2.000 ms\n"));
  std::ostringstream out;
  write_schedulability_json(out, report, analyzed());
  EXPECT_EQ(nlohmann::json::parse(out.str())["callbacks"][0]["runtime_ns"], 2'000'000);
}

TEST(SchedulabilityText, SaysWhichCpusAreAdmittedApart) {
  auto report = sample();
  report.deadline.push_back(report.deadline[0]);
  report.deadline[0].cpus = {0, 1};
  report.deadline[1].cpus = {4};
  report.deadline[1].servers = 1;
  const auto text = text_of(report);
  EXPECT_THAT(text, HasSubstr("SCHED_DEADLINE on CPUs 0-1: 2 threads reserve 98.00 % of 1 CPU;"));
  EXPECT_THAT(text, HasSubstr("SCHED_DEADLINE on CPU 4: 1 thread reserves 98.00 % of 1 CPU;"));
}

TEST(SchedulabilityText, SaysWhatTheEdfTestDoesNotKnow) {
  auto report = sample();
  report.deadline[0].cpus.clear();
  report.deadline[0].is_guaranteed.reset();
  report.deadline[0].unknown = "the CPUs of thread 7 are not known";
  const auto text = text_of(report);
  EXPECT_THAT(text, HasSubstr("SCHED_DEADLINE on unknown CPUs: 2 threads reserve"));
  EXPECT_THAT(text, HasSubstr("says nothing, because the CPUs of thread 7"));
  std::ostringstream out;
  write_schedulability_json(out, report, analyzed());
  EXPECT_EQ(nlohmann::json::parse(out.str())["sched_deadline"]["guaranteed"], nullptr);
}

TEST(SchedulabilityText, RoundsADemandUp) {
  auto report = sample();
  report.cpus[0].real_time_ppb = 1'000'000'001;
  EXPECT_THAT(text_of(report), HasSubstr("demand up to 100.01 %\n"));
}

TEST(SchedulabilityText, SaysOfHowManyRunsAnExecutionTimeIs) {
  auto report = sample();
  auto& callback = report.callbacks[0];
  callback.runs = callback.runs_measured = 8;
  EXPECT_THAT(text_of(report), Not(HasSubstr("Measured in part")));
  callback.runs_measured = 1;
  EXPECT_THAT(text_of(report), HasSubstr("Measured in part, for holes in the kernel's record\n"
                                         "  /plan@Timer(1): C of 1 of 8 instances\n"));
  callback.execution->source = ParameterSource::declared;
  EXPECT_THAT(text_of(report), Not(HasSubstr("Measured in part")));
}

TEST(SchedulabilityText, SaysThatNoDeadlineIsBounded) {
  auto report = sample();
  report.callbacks = {report.callbacks[1], report.callbacks[1]};
  for (auto& callback : report.callbacks)
    callback.deadline = analysis::TaskParameter{3'000'000, ParameterSource::declared};
  report.cpus[0].real_time_ppb.reset();
  auto text = text_of(report);
  EXPECT_THAT(text, HasSubstr("\n2 deadlines, none decided: execution times unknown\n"));
  EXPECT_THAT(text, HasSubstr("CPU 0: what real-time callbacks demand is unknown"));
  EXPECT_THAT(text, Not(HasSubstr("0.00 %")));

  report.callbacks.push_back(sample().callbacks[0]);
  text = text_of(report);
  EXPECT_THAT(
      text,
      StartsWith("1 of 3 callbacks has a bound; 1 of 3 deadlines not guaranteed, 2 undecided; "
                 "1 above the"));

  std::ostringstream out;
  write_schedulability_json(out, report, analyzed());
  const auto json = nlohmann::json::parse(out.str());
  EXPECT_EQ(json["cpus"][0]["real_time_ppb"], nullptr);
  EXPECT_EQ(json["deadlines"], nlohmann::json::parse(R"({"count": 3, "decided": 1})"));
}

TEST(SchedulabilityText, SaysEachReasonOnceAndFirst) {
  auto report = sample();
  for (const auto* id : {"/third", "/fourth", "/fifth"}) {
    report.callbacks.push_back(report.callbacks[1]);
    report.callbacks.back().logical_id = id;
  }
  report.callbacks.push_back(report.callbacks[1]);
  report.callbacks.back().reason = "it is blocked";
  const auto text = text_of(report);
  EXPECT_THAT(text, HasSubstr("Without a bound\n"
                              "  4 callbacks: it never ran\n"
                              "      /other\\x1b\n      /third\n      /fourth\n      /fifth\n"
                              "  1 callback: it is blocked\n      /other\\x1b\n"));
  const auto table = text.substr(text.find("observed\n"));
  EXPECT_THAT(table, Not(HasSubstr("/third"))) << "nothing of it was measured";
}

// 3 ms are its deadline, and one instance took 5 ms at least.
TEST(SchedulabilityText, SaysWhatWasMissedAndWhatCHolds) {
  auto report = sample();
  auto& callback = report.callbacks[0];
  EXPECT_THAT(text_of(report),
              HasSubstr("  2.000 ms   =10.00 ms  =3.000 ms  4.000 ms  4.500 ms\n"));
  callback.observed_at_least_ns = 5'000'000;
  callback.execution->source = ParameterSource::declared;
  const auto text = text_of(report);
  EXPECT_THAT(text, HasSubstr("; 1 of 1 deadline missed; "));
  EXPECT_THAT(text, HasSubstr(" =2.000 ms   =10.00 ms  =3.000 ms  4.000 ms  >5.000 ms\n"));
  callback.waiting_ns = 500'000;
  EXPECT_THAT(text_of(report), HasSubstr(" 2.000 ms   =10.00 ms")) << "a part of it was measured";
}

// A callback of 1 ms every 10 ms, whose deadline that is.
analysis::CallbackSchedulability kept(std::uint32_t number) {
  analysis::CallbackSchedulability callback = sample().callbacks[0];
  callback.index = analysis::CallbackIndex{number};
  callback.logical_id = "/n" + std::to_string(number) + "@Timer(10000000)";
  callback.execution->ns = 1'000'000;
  callback.deadline->ns = 10'000'000;
  callback.bound_ns = callback.observed_ns = 1'000'000;
  callback.explanations.clear();
  callback.is_flagged = false;
  return callback;
}

class SchedulabilityScreen : public ::testing::Test {
 protected:
  SchedulabilityScreen() {
    analyzed_ = analyzed();
    for (std::uint32_t i = 0; i < 40; ++i) {
      report_.callbacks.push_back(kept(i));
      auto& row = analyzed_.callbacks.emplace_back();
      row.index = analysis::CallbackIndex{i};
      row.logical_id = report_.callbacks.back().logical_id;
      row.response_time = analysis::Summary{.count = 1, .max = 17'670'000};
    }
  }

  std::vector<std::string> lines(const std::vector<WorstRun>& worst_runs = {}) const {
    std::stringstream text;
    write_schedulability_screen(
        text, report_, analyzed_, {},
        {.worst_runs = worst_runs, .verify_arguments = "run1", .view_arguments = "run1"},
        {.columns = 80});
    std::vector<std::string> lines;
    for (std::string line; std::getline(text, line);)
      lines.push_back(line);
    return lines;
  }

  static constexpr std::size_t kFirstRow = 4;  // behind the outcome, a blank line, and titles

  analysis::SchedulabilityReport report_;
  analysis::Report analyzed_;
};

TEST_F(SchedulabilityScreen, NamesTheWindowThatWasAskedFor) {
  EXPECT_EQ(lines()[1], "");
  analyzed_.trace.recording_begin = analysis::Timestamp{0};
  analyzed_.trace.begin = analysis::Timestamp{7};
  analyzed_.trace.end = analysis::Timestamp{9};
  EXPECT_EQ(lines()[1], "measured in the window 7..9 ns (2 ns) alone");
}

TEST_F(SchedulabilityScreen, NamesTheWorstFirstAndSaysWhyAndWhatNext) {
  auto& missed = report_.callbacks[33];
  missed.observed_ns = missed.observed_at_least_ns = 17'670'000;
  missed.bound_ns.reset();
  missed.method = analysis::BoundMethod::none;
  missed.reason = "it may run on 2 CPUs";
  report_.callbacks[20].bound_ns = 15'000'000;
  report_.callbacks[21].bound_ns = 20'000'000;
  const auto shown = lines({{.callback = missed.index,
                             .seq = 12,
                             .start = {},
                             .response_time = analysis::Duration{17'670'000},
                             .start_latency = analysis::Duration{15'000'000}}});
  EXPECT_EQ(shown.size(), 23U);
  EXPECT_THAT(shown, Each(SizeIs(Le(80U))));
  EXPECT_EQ(shown[0],
            "39 of 40 callbacks have a bound; 1 of 40 deadlines missed, 2 not guaranteed");
  EXPECT_THAT(shown[kFirstRow], MatchesRegex("  n33 timer 10 ms +MISSED +10.00ms +- +17.67ms .*"));
  EXPECT_THAT(shown[kFirstRow + 1], MatchesRegex("  n21 timer 10 ms +NO +10.00ms +20.00ms .*"));
  EXPECT_THAT(shown[kFirstRow + 2], MatchesRegex("  n20 timer 10 ms +NO +10.00ms +15.00ms .*"));
  EXPECT_THAT(shown[kFirstRow + 3], MatchesRegex("  n0 timer 10 ms +yes .*"));
  EXPECT_THAT(
      shown,
      Contains("  worst: n33 timer 10 ms, instance 12 took 17.67 ms: 15.00 ms waiting to start,"));
  EXPECT_THAT(shown, Contains(StartsWith("  -> shorten it or what is as urgent")));
  EXPECT_THAT(shown, Contains("  no bound: n33 timer 10 ms: it may run on 2 CPUs"));
  EXPECT_THAT(shown, Contains(HasSubstr("cie analyze schedulability run1 --all")));
}

TEST_F(SchedulabilityScreen, AdvisesWhatFitsThePolicy) {
  auto& worst = report_.callbacks[20];
  worst.bound_ns = 15'000'000;
  EXPECT_THAT(lines(), Contains(HasSubstr("raise its priority")));
  worst.policy = "SCHED_DEADLINE";
  EXPECT_THAT(lines(), Contains(HasSubstr("-> shorten it, give it more runtime")));
  report_.deadline = sample().deadline;
  report_.deadline[0].is_guaranteed = false;
  EXPECT_THAT(lines(), Contains(HasSubstr("-> reserve less of its CPUs")));
  worst.policy = "SCHED_OTHER";
  EXPECT_THAT(lines(), Contains(HasSubstr("-> shorten it, or give it SCHED_FIFO")));
  analyzed_.callbacks[20].isolation = analysis::Isolation::not_isolated;
  EXPECT_THAT(lines(), Contains(HasSubstr("-> shorten it, or give it a thread of its own")));
}

TEST_F(SchedulabilityScreen, SaysTheReasonOfTheWorstOnce) {
  for (const auto number : {20U, 21U, 22U}) {
    report_.callbacks[number].bound_ns.reset();
    report_.callbacks[number].reason = "its runtime is too short";
  }
  const auto shown = lines();
  EXPECT_THAT(shown, Contains("  worst: n20 timer 10 ms, no bound: its runtime is too short"));
  EXPECT_THAT(shown, Contains("  no bound: 2 callbacks: for the same reason"));
}

// 80 % of CPU 0, an unknown part of 1, 120 % of 2, 90 % of 3 and 4.
TEST_F(SchedulabilityScreen, NamesTheMostDemandedCpusFirst) {
  report_.cpus = {{.cpu = 0, .real_time_ppb = 800'000'000},
                  {.cpu = 1, .real_time_ppb = std::nullopt},
                  {.cpu = 2, .real_time_ppb = 1'200'000'000},
                  {.cpu = 3, .real_time_ppb = 900'000'000},
                  {.cpu = 4, .real_time_ppb = 900'000'000}};
  const auto shown = lines();
  const auto first = std::ranges::find(shown, "  CPU 2: real-time callbacks demand up to 120.00 %");
  ASSERT_NE(first, shown.end());
  EXPECT_THAT(*std::next(first), StartsWith("  CPU 1: what real-time callbacks demand is unknown"));
  EXPECT_THAT(shown, Contains("  ... 3 more on CPUs"));
}

TEST_F(SchedulabilityScreen, SaysOfWhatABoundConsists) {
  report_.callbacks[20].bound_ns = 15'000'000;
  EXPECT_THAT(lines(),
              Contains("  worst: n20 timer 10 ms, R 15.00 ms: 1.000 ms of its own, 14.00 ms "
                       "of callbacks"));
}

TEST_F(SchedulabilityScreen, StaysAScreenHoweverMuchThereIsToTell) {
  for (std::uint32_t i = 0; i < 10; ++i) {
    auto& unbounded = report_.callbacks[i];
    unbounded.bound_ns.reset();
    unbounded.method = analysis::BoundMethod::none;
    unbounded.reason = std::string(120, static_cast<char>('a' + i)) + " is not known";
    report_.cpus.push_back({.cpu = i, .real_time_ppb = std::nullopt});
    analyzed_.defects.push_back({.kind = analysis::DefectKind::seq_gaps,
                                 .severity = analysis::Severity::loss,
                                 .count = 1,
                                 .advice = "instances are missing from the record"});
  }
  report_.callbacks[11].bound_ns = 20'000'000;
  report_.callbacks[12].observed_ns = 1'000'001;
  report_.callbacks[12].explanations = {{"kernel", "it started late", 10'000'000}};
  report_.callbacks[12].reason = std::string(120, 'z');
  const auto shown = lines();
  EXPECT_THAT(shown, SizeIs(Le(24U)));
  EXPECT_THAT(shown, Contains(MatchesRegex("  n11 timer 10 ms +NO .*")));
  EXPECT_THAT(shown, Contains(HasSubstr("more without a bound")));
  EXPECT_THAT(shown, Contains(HasSubstr("more on CPUs")));
}

TEST_F(SchedulabilityScreen, MarksWhatNothingExplainsAndWhatIsUndecided) {
  auto& above = report_.callbacks[7];
  above.deadline.reset();
  above.observed_ns = 3'000'000;
  above.is_flagged = true;
  auto& exceeded = report_.callbacks[8];
  exceeded.observed_ns = 1'000'001;
  exceeded.explanations = {{"kernel", "it started late", 9'000'001}};  // beyond 10 ms by 1 ns
  exceeded.reason = "an instance took longer than its bound";
  report_.callbacks[9].observed_ns = 1'000'001;
  report_.callbacks[9].explanations = {{"kernel", "it started late", 9'000'000}};
  const auto shown = lines();
  EXPECT_EQ(shown[1], "without explanation") << "the outcome takes two lines";
  EXPECT_THAT(shown[kFirstRow + 1], MatchesRegex("  n7 timer 10 ms +ABOVE R .*"));
  EXPECT_THAT(shown[kFirstRow + 2], MatchesRegex("  n8 timer 10 ms +\\? .*"));
  EXPECT_THAT(shown[kFirstRow + 3], MatchesRegex("  n0 timer 10 ms +yes .*")) << "n9 is met, too";
  EXPECT_THAT(shown,
              Contains("  undecided: n8 timer 10 ms: an instance took longer than its bound"));
  EXPECT_THAT(shown,
              Contains(StartsWith("  worst: n7 timer 10 ms, observed is 2.000 ms above the")));
}

// Of a callback that its bound counts, whose wcet is 1 ms.
std::string not_kept(std::uint32_t number, const char* executed) {
  return "its bound rests on a declaration that was not kept: an instance of /n" +
         std::to_string(number) + "@Timer(10000000) executed " + executed +
         ", declared are 1000.0 us";
}

// No bound was exceeded; nearest to its deadline is 5.
TEST_F(SchedulabilityScreen, SaysOnceWhyDeadlinesAreUndecidedAndWhoseDeclarationWasNotKept) {
  for (const auto number : {3U, 4U, 5U}) {
    auto& undecided = report_.callbacks[number];
    undecided.broken_declaration = "an instance executed longer";
    undecided.reason = not_kept(number, number == 5 ? "4005.0 us" : "2000.0 us");
    undecided.bound_ns = 5'000'000;
    undecided.observed_ns = number * 900'000;
  }
  report_.callbacks[7].broken_declaration = "releases came nearer";
  report_.callbacks[7].reason = "its bound rests on releases that came nearer";
  auto shown = lines();
  EXPECT_EQ(shown[0], "40 of 40 callbacks have a bound; 4 of 40 deadlines undecided");
  const auto first = std::ranges::find_if(
      shown, [](const auto& line) { return line.starts_with("  undecided: "); });
  ASSERT_LT(std::distance(first, shown.end()), 8);
  EXPECT_EQ(first[0],
            "  undecided: 3 callbacks, worst n5 timer 10 ms: its bound rests on a declaration");
  EXPECT_EQ(first[1],
            "             that was not kept: an instance of n5 timer 10 ms executed 4005.0");
  EXPECT_EQ(first[2], "             us, declared are 1000.0 us");
  EXPECT_EQ(first[3], "  undecided: n7 timer 10 ms: its bound rests on releases that came nearer");
  EXPECT_THAT(shown, SizeIs(Le(24U)));
}

TEST_F(SchedulabilityScreen, SaysWhyEachOfAllIsUndecided) {
  report_.callbacks.resize(2);
  for (auto& undecided : report_.callbacks) {
    undecided.broken_declaration = "an instance executed longer";
    undecided.reason = not_kept(1, "2000.0 us");
  }
  report_.callbacks[0].observed_ns = 3'000'000;
  report_.callbacks[0].is_flagged = true;
  report_.callbacks[0].reason = "nothing known explains all of that";
  const auto shown = lines();
  EXPECT_EQ(shown[2], "2 deadlines, none decided: why is said of each");
  EXPECT_THAT(shown, Contains(StartsWith("  worst: n0 timer 10 ms, observed is 2.000 ms above")));
  EXPECT_THAT(shown, Contains(StartsWith("  undecided: n1 timer 10 ms: its bound rests on a")));
  EXPECT_THAT(shown, Not(Contains(StartsWith("  undecided: n0"))));
}

TEST(SchedulabilityText, SaysWhyADeadlineWithinItsBoundIsUndecided) {
  auto report = sample();
  report.callbacks = {kept(1), kept(2)};
  for (auto& undecided : report.callbacks) {
    undecided.broken_declaration = "an instance executed longer";
    undecided.reason = not_kept(1, "2000.0 us");
  }
  EXPECT_THAT(text_of(report),
              HasSubstr("\nUndecided\n"
                        "  2 callbacks: its bound rests on a declaration that was not kept: an "
                        "instance of\n      /n1@Timer(10000000) executed 2000.0 us, declared are "
                        "1000.0 us\n      /n1@Timer(10000000)\n      /n2@Timer(10000000)\n"));
}

TEST(SchedulabilityJson, SaysWhyABoundDecidesNothing) {
  auto report = sample();
  report.callbacks[0].reason = "nothing known explains all of that";
  std::ostringstream out;
  write_schedulability_json(out, report, analyzed());
  EXPECT_EQ(nlohmann::json::parse(out.str())["callbacks"][0]["reason"],
            "nothing known explains all of that");
  EXPECT_THAT(text_of(report), HasSubstr("undecided: nothing known explains all of that\n"));
}

TEST(SchedulabilityJson, HoldsEverything) {
  std::ostringstream out;
  write_schedulability_json(out, sample(), analyzed());
  const auto json = nlohmann::json::parse(out.str());
  EXPECT_EQ(json["schema"], "cie.schedulability/1");
  EXPECT_EQ(json["callbacks"][1]["method"], nullptr);  // of the callback without a bound
  EXPECT_EQ(json["finding"], true);
  const auto& callback = json["callbacks"][0];
  EXPECT_EQ(callback["execution"],
            nlohmann::json::parse(R"({"ns": 2000000, "source": "measured"})"));
  EXPECT_EQ(callback["bound_ns"], 4'000'000);
  EXPECT_EQ(callback["reason"], nullptr);
  EXPECT_EQ(callback["meets_deadline"], false);
  EXPECT_EQ(callback["above_bound"], true);
  EXPECT_EQ(json["callbacks"][1]["bound_ns"], nullptr);
  EXPECT_EQ(json["callbacks"][1]["policy"], nullptr);
  EXPECT_EQ(json["callbacks"][1]["meets_deadline"], nullptr);
  EXPECT_EQ(json["sched_deadline"]["guaranteed"], true);
}

}  // namespace
}  // namespace cie::viewer_export
