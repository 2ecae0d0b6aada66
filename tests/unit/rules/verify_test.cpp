#include <cie/analysis/rule_pages.hpp>

#include "rules/judgement.hpp"
#include "rules/rule.hpp"
#include "support/verdicts.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using analysis::Verdict;
using ::testing::ElementsAre;

constexpr const char* kTwoTimers = R"(
  callback fusion timer period=10
  callback plan timer period=10
  10 start fusion release=9
  12 end fusion
  13 start plan release=11
  15 end plan
  20 start fusion release=19
  22 end fusion
  23 start plan release=21
  25 end plan)";

TEST(Verify, ASoundTracePassesEveryRuleThatApplies) {
  const Verified verified(kTwoTimers);
  for (const auto& rule : verified.result.verdicts.rules) {
    for (const auto& subject : rule.subjects) {
      EXPECT_EQ(subject.verdict, Verdict::pass) << rule.id << ' ' << subject.subject << '\n'
                                                << verified.evidence(rule.id, subject.subject);
      EXPECT_GE(subject.checked, 1U) << rule.id;
    }
  }
  EXPECT_EQ(verified.result.verdicts.verdict, Verdict::pass);
}

// "0 checked" is no pass (L1).
TEST(Verify, IsUndecidedWhereNoRuleApplies) {
  const analysis::RuleVerdict none{
      .id = "S1", .name = "", .verdict = Verdict::not_applicable, .subjects = {}};
  const analysis::RuleVerdict kept{
      .id = "M2",
      .name = "",
      .verdict = Verdict::pass,
      .subjects = {
          {.subject = "thread 1", .verdict = Verdict::pass, .checked = 1, .evidence = {}}}};
  auto suppressed = kept;
  suppressed.verdict = suppressed.subjects.front().verdict = Verdict::fail;
  suppressed.subjects.front().suppression = analysis::Suppression{};
  const auto overall = [](std::vector<analysis::RuleVerdict> rules) {
    return analysis::overall_verdict({.verdict = {}, .rules = std::move(rules)});
  };
  EXPECT_EQ(overall({none, none}), Verdict::inconclusive);
  EXPECT_EQ(overall({none, kept}), Verdict::pass);
  EXPECT_EQ(overall({none, suppressed}), Verdict::pass) << "it was judged";
}

TEST(Verify, TellsNoTimeOfEvidenceThatHasNone) {
  const auto time_at = [](const analysis::EventRef& where) {
    return analysis::evidence("", where, {}).time;
  };
  EXPECT_EQ(time_at({}), std::nullopt);
  EXPECT_EQ(time_at(analysis::moment(std::nullopt)), std::nullopt);
  EXPECT_EQ(time_at(analysis::moment(analysis::kBoot)), std::nullopt) << "a trace without times";
  EXPECT_EQ(time_at(analysis::moment(analysis::Timestamp{7})), analysis::Timestamp{7});
}

TEST(Verify, JudgesForAReportAloneWhatItRestsOn) {
  const Verified all(kTwoTimers);
  const Verified few(trace_of(kTwoTimers), {}, {.is_judged = false});
  std::vector<std::string> judged;
  for (const auto& rule : few.result.verdicts.rules) {
    judged.push_back(rule.id);
    EXPECT_EQ(rule.verdict, Verdict::pass) << rule.id;
    EXPECT_TRUE(rule.subjects.empty()) << rule.id;
  }
  EXPECT_THAT(judged, ElementsAre("T2", "T3", "T4"));
  EXPECT_TRUE(all.result.report.trace.complete);
  EXPECT_TRUE(few.result.report.trace.complete);
  EXPECT_TRUE(few.result.report.processes.at(0).complete);
}

// Another process of the same pid begins while the first one runs: as the change of the first one's
// run_begin says.
template <typename Change>
TextTrace with_another_process(Change change) {
  auto trace = trace_of(kTwoTimers);
  const auto is_run_begin = [](const analysis::Event& event) {
    return std::holds_alternative<analysis::RunBegin>(event.body);
  };
  auto other = *std::ranges::find_if(trace.events, is_run_begin);
  auto& body = std::get<analysis::RunBegin>(other.body);
  body.process_start_ns += 1;
  change(body);
  other.head.time = {16};
  const auto later = std::ranges::find_if(
      trace.events, [](const analysis::Event& event) { return event.head.time.ns > 16; });
  trace.events.insert(later, other);
  return trace;
}

TEST(Verify, ProvesNothingOfProcessesThatShareAPid) {
  const TextTrace traces[] = {
      with_another_process([](analysis::RunBegin& begin) { begin.pid_ns += 1; }),  // a container
      with_another_process([](analysis::RunBegin& begin) { begin.pid += 1; }),     // a child
      with_another_process([](analysis::RunBegin& begin) {
        begin.process_start_ns -= 1;  // both began in one tick of the kernel's clock
        begin.pid_ns += 1;
      })};
  for (const auto& trace : traces) {
    const Verified verified(trace);
    for (const auto& rule : verified.result.verdicts.rules) {
      if (rule.id == "T1" || rule.id == "T2" || rule.id == "T5" || rule.id == "T6") continue;
      EXPECT_THAT(rule.verdict, ::testing::AnyOf(Verdict::inconclusive, Verdict::not_applicable))
          << rule.id;
    }
    EXPECT_EQ(verified["M2"], Verdict::inconclusive);
    EXPECT_EQ(verified["M3"], Verdict::inconclusive);
    const auto& defects = verified.result.report.defects;
    EXPECT_TRUE(std::ranges::any_of(defects, [](const auto& defect) {
      return defect.kind == analysis::DefectKind::shared_pid && defect.count == 2;
    }));
  }
}

TEST(Verify, APidThatIsUsedAgainIsNotShared) {
  // Of the same namespace, a pid is given again only when its process is gone, whatever it left.
  const Verified verified(with_another_process([](analysis::RunBegin&) {}));
  const auto& defects = verified.result.report.defects;
  EXPECT_FALSE(std::ranges::any_of(
      defects, [](const auto& defect) { return defect.kind == analysis::DefectKind::shared_pid; }));
}

TEST(Verify, KeepsTheContractsOrder) {
  std::string order;
  for (const auto& rule : analysis::rules())
    order += std::string(rule.id) + ' ';
  EXPECT_EQ(order,
            "T1 T2 T3 T4 T5 T6 M1 M2 M3 M4 M5 M6 M7 M8 M9 S1 S2 S3 S4 S5 E1 E2 E3 "
            "R1 R2 R3 R4 R5 Q1 Q2 ");
}

TEST(Verify, EveryRuleHasAPageOfFourParts) {
  using ::testing::ContainsRegex;
  for (const auto& rule : analysis::rule_pages()) {
    EXPECT_FALSE(rule.name.empty()) << rule.id;
    EXPECT_THAT(rule.page, ContainsRegex("^[A-Z][^\n]{40,}[.:)]\n"
                                         "Why it matters: [^\n]{40,}\\.\n"
                                         "Inconclusive when [^\n]{15,}\\.\n"
                                         "Remedy: [^\n]{30,}\\."
                                         "(\nRemedy with rclcpp: [^\n]{30,}\\.)?$"))
        << rule.id;
  }
}

TEST(Verify, APageIsThePartsThatItsRuleHas) {
  const auto* page = analysis::find_rule_page("M7");
  ASSERT_NE(page, nullptr);
  EXPECT_EQ(
      page->page,
      "No two callbacks of one process live under the same logical id.\n"
      "Why it matters: With equal ids one entry of a spec configures whichever comes first, and "
      "the other runs unconfigured.\n"
      "Inconclusive when whether the earlier callback of the id still lived is unknown, for a "
      "callback that was never seen to be registered, and where the process counts callbacks of "
      "which no event was seen.\n"
      "Remedy: give callbacks explicit names, or periods that differ.\n"
      "Remedy with rclcpp: its callbacks have no names: give timers periods that differ, and "
      "what shares a node and a topic or service nodes of its own.");
  EXPECT_EQ(page->violation, "had ids that others have");
  EXPECT_EQ(analysis::find_rule_page("M0"), nullptr);
}

TEST(Verify, TheGravestRulesAreOfTheMappingAndDeadlines) {
  auto pages = analysis::rule_pages();
  std::ranges::stable_sort(pages, std::ranges::greater{}, &analysis::RulePage::gravity);
  std::string order;
  for (const auto& page : pages)
    order += std::string(page.id) + ' ';
  EXPECT_THAT(order, ::testing::StartsWith("M2 M3 R3 T1 T2 T3"));
}

TEST(Verify, SortsNumbersInSubjectsByValue) {
  const Verified verified(R"(
    thread t9 pool tid=9
    thread t10 pool tid=10
    thread t101 pool tid=101
    callback a pooled
    callback b pooled
    callback c pooled
    1 start a on=t101
    2 end a on=t101
    3 start b on=t10
    4 end b on=t10
    5 start c on=t9
    6 end c on=t9)");
  std::vector<std::string> subjects;
  for (const auto& subject : verified.rule("M2").subjects)
    subjects.push_back(subject.subject);
  EXPECT_THAT(subjects, ElementsAre("thread 9", "thread 10", "thread 101"));
}

// What its first subject shows of instances.
std::vector<analysis::Evidence> starts_of(const analysis::VerdictReport& verdicts,
                                          std::string_view rule) {
  auto evidence =
      std::ranges::find(verdicts.rules, rule, &analysis::RuleVerdict::id)->subjects.at(0).evidence;
  std::erase_if(evidence, [](const auto& item) { return item.event != "callback_start"; });
  return evidence;
}

TEST(Verify, EvidenceNamesTheStreamAndThePacketOfItsEvent) {
  using namespace analysis;
  Analyzer analyzer(AnalysisOptions{});
  const auto push = [&analyzer](std::int64_t time, std::uint32_t stream, const EventBody& body) {
    analyzer.consume(
        Event{.head = {.time = {time}, .stream = StreamIndex{stream}, .cpu = 0, .pid = 1, .tid = 2},
              .body = body});
  };
  const auto start = [&push](std::int64_t time, std::uint32_t callback) {
    CallbackStart event;
    event.callback = CallbackId{callback};
    push(time, 1, event);
    push(time + 1, 1, CallbackEnd{.callback = CallbackId{callback}, .seq = 0, .status = {}});
  };
  push(0, 0, StreamBegin{});
  StreamBegin second;
  second.path = "run/channel0_1";
  push(0, 1, second);
  push(0, 0, PacketBegin{});
  for (const auto& [begin, callback] : {std::pair(10, 7U), std::pair(20, 8U)}) {
    push(begin, 1, PacketBegin{});
    start(begin + 1, callback);
    push(begin + 5, 1, PacketEnd{});
  }
  const auto evidence = starts_of(analyzer.finish().verdicts, "M2");
  ASSERT_EQ(evidence.size(), 2U);
  EXPECT_EQ(evidence[0].file, "run/channel0_1");
  EXPECT_EQ(evidence[0].packet, 0U);
  EXPECT_EQ(evidence[1].packet, 1U);
}

// As chunks of a recording have: packets are counted in each.
TEST(Verify, EvidenceNamesTheFileOfAStreamWithSeveral) {
  using namespace analysis;
  Analyzer analyzer(AnalysisOptions{});
  const auto push = [&analyzer](std::int64_t time, const EventBody& body) {
    analyzer.consume(
        Event{.head = {.time = {time}, .stream = StreamIndex{0}, .cpu = 0, .pid = 1, .tid = 2},
              .body = body});
  };
  StreamBegin stream;
  stream.path = "chunk-000001/channel0_0";
  push(0, stream);
  const std::string_view second = "chunk-000002/channel0_0";
  std::uint32_t callback = 7;
  for (const auto& [begin, file] : {std::pair(10, std::string_view{}), std::pair(20, second),
                                    std::pair(30, std::string_view{})}) {
    push(begin, PacketBegin{.file = file});
    CallbackStart start;
    start.callback = CallbackId{callback++};
    push(begin + 1, start);
    push(begin + 2, CallbackEnd{.callback = start.callback, .seq = 0, .status = {}});
    push(begin + 5, PacketEnd{});
  }
  const auto evidence = starts_of(analyzer.finish().verdicts, "M2");
  ASSERT_EQ(evidence.size(), 3U);
  EXPECT_EQ(evidence[0].file, stream.path);
  EXPECT_EQ(evidence[0].packet, 0U);
  EXPECT_EQ(evidence[1].file, second);
  EXPECT_EQ(evidence[1].packet, 0U);
  EXPECT_EQ(evidence[2].file, second);
  EXPECT_EQ(evidence[2].packet, 1U);
}

TEST(Verify, NamesThePidWhenThereAreSeveralProcesses) {
  const Verified verified(R"(
    process first pid=100
    callback a
    process second pid=200
    callback b
    1 start a
    2 end a
    3 start b
    4 end b)");
  EXPECT_EQ(verified.of("M3", "callback a (pid 100)"), Verdict::pass);
  EXPECT_EQ(verified.of("M3", "callback b (pid 200)"), Verdict::pass);
}

}  // namespace
}  // namespace cie::test
