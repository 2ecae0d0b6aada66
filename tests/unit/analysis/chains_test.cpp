#include "support/verdicts.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;

ChainReport chain_of(const TextTrace& trace) {
  const auto report = analyze(trace).report;
  EXPECT_EQ(report.chains.size(), 1U);
  return report.chains.empty() ? ChainReport{} : report.chains.front();
}

std::int64_t sum_of(const Rare<Summary>& summary) { return summary ? summary->sum : 0; }
std::uint64_t count_of(const Rare<Summary>& summary) { return summary ? summary->count : 0; }

// plan is released at 10 and 40, last ends at 30 and 60. The first time it is not known when mid
// was released.
constexpr const char* kThreeHops = R"(
  publisher out topic=/points
  publisher next topic=/tracks
  callback plan timer period=30
  callback mid subscription topic=/points
  callback last subscription topic=/tracks
  11 start plan release=10
  13 publish out on=plan
  15 end plan
  18 start mid release=none from=out:0
  22 publish next on=mid
  24 end mid
  27 start last release=25 from=next:0
  30 end last
  41 start plan release=40
  43 publish out on=plan
  45 end plan
  48 start mid release=46 from=out:1
  52 publish next on=mid
  54 end mid
  57 start last release=55 from=next:1
  60 end last)";

TEST(PathLatency, NeedsNoReleaseButTheFirst) {
  const auto chain = chain_of(trace_of(kThreeHops));
  EXPECT_EQ(chain.instances, 2U);
  EXPECT_EQ(count_of(chain.path_latency), 2U);
  EXPECT_EQ(sum_of(chain.path_latency), (30 - 10) + (60 - 40));
}

TEST(HopTable, LeavesOpenWhatAnUnknownReleaseDivides) {
  const auto chain = chain_of(trace_of(kThreeHops));
  ASSERT_EQ(chain.hop_table.size(), 3U);
  EXPECT_EQ(sum_of(chain.hop_table[0].processing), (13 - 10) + (43 - 40));
  EXPECT_EQ(count_of(chain.hop_table[0].communication), 1U);
  EXPECT_EQ(sum_of(chain.hop_table[0].communication), 46 - 43);
  EXPECT_EQ(count_of(chain.hop_table[1].processing), 1U);
  EXPECT_EQ(sum_of(chain.hop_table[1].processing), 52 - 46);
  EXPECT_EQ(sum_of(chain.hop_table[1].communication), (25 - 22) + (55 - 52));
  EXPECT_EQ(sum_of(chain.hop_table[2].processing), (30 - 25) + (60 - 55));
  // From the publish that mid took to its own.
  EXPECT_EQ(count_of(chain.undivided), 1U);
  EXPECT_EQ(sum_of(chain.undivided), 22 - 13);
  std::int64_t all = sum_of(chain.undivided);
  for (const auto& hop : chain.hop_table)
    all += sum_of(hop.processing) + sum_of(hop.communication);
  EXPECT_EQ(all, sum_of(chain.path_latency));
}

TEST(HopTable, OfInstancesWithoutTheFirstReleaseIsUnknown) {
  auto text = std::string(kThreeHops);
  for (const std::string line : {"11 start plan release=10", "41 start plan release=40"})
    text.replace(text.find(line), line.size(), line.substr(0, 22) + "none");
  const auto chain = chain_of(trace_of(text));
  EXPECT_EQ(chain.instances, 2U);
  EXPECT_FALSE(chain.path_latency);
  ASSERT_EQ(chain.hop_table.size(), 3U);
  for (const auto& hop : chain.hop_table) {
    EXPECT_FALSE(hop.processing);
    EXPECT_FALSE(hop.communication);
  }
  EXPECT_FALSE(chain.undivided);
}

// plan reads at 1, 11, 31, 51 and 71; what it read at 31 and 51 is overwritten by what follows.
constexpr const char* kOvertaken = R"(
  publisher out topic=/points
  callback plan timer period=20
  callback fusion subscription topic=/points
  1 start plan release=0
  5 end plan
  11 start plan release=10
  13 publish out on=plan
  15 end plan
  18 start fusion release=16 from=out:0
  25 end fusion
  31 start plan release=30
  33 publish out on=plan
  35 end plan
  51 start plan release=50
  53 publish out on=plan
  55 end plan
  71 start plan release=70
  73 publish out on=plan
  75 end plan
  78 start fusion release=76 from=out:3
  95 end fusion)";

TEST(ReactionTime, CountsEveryReadFromTheFirstChainOn) {
  const auto chain = chain_of(trace_of(kOvertaken));
  ASSERT_TRUE(chain.reaction_time);
  EXPECT_EQ(chain.reaction_time->count, 3U);
  EXPECT_EQ(chain.reaction_time->min, 95 - 51);
  EXPECT_EQ(chain.reaction_time->max, 95 - 11);
  EXPECT_EQ(chain.reaction_time->sum, (95 - 11) + (95 - 31) + (95 - 51));
  EXPECT_EQ(chain.reaction_time->p50, 95 - 31);
  ASSERT_TRUE(chain.data_age);
  EXPECT_EQ(chain.data_age->count, 1U);
  EXPECT_EQ(chain.data_age->max, chain.reaction_time->max);
}

TEST(ReactionTime, IsNotTakenAcrossALostRead) {
  auto trace = trace_of(kOvertaken);
  const auto is_lost = [](const auto& event, const EventHead&) { return event.seq == 3; };
  EXPECT_EQ(trace.erase<CallbackStart>(is_lost), 1U);
  EXPECT_EQ(trace.erase<CallbackEnd>(is_lost), 1U);
  const auto chain = chain_of(trace);
  EXPECT_EQ(chain.instances, 2U);
  EXPECT_FALSE(chain.reaction_time);
  EXPECT_FALSE(chain.data_age);
}

// plan and fusion take 10 each time, from release to end.
constexpr const char* kInTurn = R"(
  publisher out topic=/points
  callback plan timer period=20
  callback fusion subscription topic=/points
  1 start plan release=0
  3 publish out on=plan
  4 end plan
  6 start fusion release=5 from=out:0
  10 end fusion
  21 start plan release=20
  23 publish out on=plan
  24 end plan
  26 start fusion release=25 from=out:1
  30 end fusion
  41 start plan release=40
  43 publish out on=plan
  44 end plan
  46 start fusion release=45 from=out:2
  50 end fusion
  61 start plan release=60
  63 publish out on=plan
  64 end plan
  66 start fusion release=65 from=out:3
  70 end fusion)";

TEST(ReactionTime, IsNotTakenAcrossALostWriteOfTheLastCallback) {
  auto trace = trace_of(kInTurn);
  const auto is_lost = [](const auto& event, const EventHead& head) {
    return head.time.ns == 50 && event.seq == 2;
  };
  EXPECT_EQ(trace.erase<CallbackEnd>(is_lost), 1U);
  const auto chain = chain_of(trace);
  EXPECT_EQ(chain.instances, 3U);
  ASSERT_TRUE(chain.reaction_time);
  EXPECT_EQ(chain.reaction_time->max, 30 - 1);
  ASSERT_TRUE(chain.data_age);
  EXPECT_EQ(chain.data_age->max, 30 - 1) << "the value of 21 was overwritten at 50, not at 70";
}

// From the end of plan's second instance to the start of its fourth: the last message is no message of
// the second one, though that is not known to have ended.
TEST(PathLatency, IsNotTakenAcrossLostPublications) {
  auto trace = trace_of(kInTurn);
  const auto is_lost = [](const auto&, const EventHead& head) {
    return head.time.ns >= 24 && head.time.ns <= 61;
  };
  EXPECT_EQ(trace.erase<CallbackEnd>([&](const auto& event, const EventHead& head) {
    return is_lost(event, head) && head.time.ns % 20 == 4;
  }),
            2U);
  EXPECT_EQ(trace.erase<CallbackStart>([&](const auto& event, const EventHead& head) {
    return is_lost(event, head) && head.time.ns % 20 == 1;
  }),
            2U);
  EXPECT_EQ(trace.erase<Publish>(is_lost), 1U);
  const auto chain = chain_of(trace);
  ASSERT_TRUE(chain.path_latency);
  EXPECT_EQ(chain.path_latency->max, 10);
}

void add(std::string& text, int at, const std::string& what) {
  text += "\n" + std::to_string(at) + " " + what;
}

TEST(ReactionTime, OfTheLongestWaitIsExactHoweverManyReadsWait) {
  constexpr int kReads = 9'000;  // more than are kept
  std::string text = R"(
    publisher out topic=/points
    callback plan timer period=10
    callback fusion subscription topic=/points
    11 start plan release=10
    13 publish out on=plan
    15 end plan
    16 start fusion release=16 from=out:0
    18 end fusion)";
  for (int i = 1; i <= kReads + 1; ++i) {
    add(text, 11 + 10 * i, "start plan release=" + std::to_string(10 + 10 * i));
    if (i == kReads + 1) add(text, 12 + 10 * i, "publish out on=plan");
    add(text, 13 + 10 * i, "end plan");
  }
  const int last = 10 * (kReads + 1);
  add(text, 14 + last, "start fusion release=" + std::to_string(14 + last) + " from=out:1");
  add(text, 20 + last, "end fusion");
  const auto report = analyze(trace_of(text)).report;
  ASSERT_EQ(report.chains.size(), 1U);
  const auto& reaction = report.chains[0].reaction_time;
  ASSERT_TRUE(reaction);
  EXPECT_EQ(reaction->max, 20 + last - 11);
  EXPECT_EQ(reaction->min, 20 + last - (11 + 10 * kReads));
  const auto defect =
      std::ranges::find(report.defects, DefectKind::reads_not_kept, &TraceDefect::kind);
  ASSERT_NE(defect, report.defects.end());
  EXPECT_EQ(defect->count + reaction->count, kReads + 1U) << "what is left out is told";
}

TEST(ReactionTime, BeginsWithTheFirstChainHoweverOftenNothingWasPublished) {
  std::string text = R"(
    publisher out topic=/points
    callback plan timer period=10
    callback fusion subscription topic=/points)";
  for (int at = 1; at < 1000; at += 10) {
    add(text, at, "start plan release=" + std::to_string(at - 1));
    add(text, at + 2, "end plan");
  }
  text += R"(
    1001 start plan release=1000
    1003 publish out on=plan
    1005 end plan
    1006 start fusion release=1006 from=out:0
    1008 end fusion
    1011 start plan release=1010
    1013 end plan
    1021 start plan release=1020
    1022 publish out on=plan
    1023 end plan
    1024 start fusion release=1024 from=out:1
    1030 end fusion)";
  const auto chain = chain_of(trace_of(text));
  ASSERT_TRUE(chain.reaction_time);
  EXPECT_EQ(chain.reaction_time->count, 2U);
  EXPECT_EQ(chain.reaction_time->max, 1030 - 1001);
  EXPECT_EQ(chain.reaction_time->min, 1030 - 1011);
}

TEST(ReactionTime, CountsReadsThatBeganBeforeTheFirstPublication) {
  const auto chain = chain_of(trace_of(R"(
    publisher out topic=/points
    callback plan timer period=10
    callback fusion subscription topic=/points
    thread second pool
    1 start plan release=0
    3 start plan on=second release=2
    5 publish out on=plan
    7 end plan seq=0
    9 end plan on=second seq=1
    10 start fusion release=10 from=out:0
    12 end fusion
    21 start plan release=20
    22 publish out on=plan
    23 end plan
    24 start fusion release=24 from=out:1
    30 end fusion)"));
  ASSERT_TRUE(chain.reaction_time);
  EXPECT_EQ(chain.reaction_time->count, 2U);
  EXPECT_EQ(chain.reaction_time->sum, (30 - 1) + (30 - 3));
}

// The same chain of a spec in one process, or in two.
std::optional<ProcessIndex> process_of_chain(bool is_in_two) {
  const std::string node = R"(
    publisher OUT topic=/points
    callback PLAN timer period=30 id=/plan
    callback LAST subscription topic=/points id=/last
    11 start PLAN release=10
    13 publish OUT on=PLAN
    15 end PLAN
    18 start LAST release=16 from=OUT:0
    22 end LAST)";
  const auto named = [&](const std::string& suffix) {
    auto text = node;
    for (const std::string name : {"OUT", "PLAN", "LAST"}) {
      for (auto at = text.find(name); at != std::string::npos; at = text.find(name))
        text.replace(at, name.size(), "x" + name.substr(0, 1) + suffix);
    }
    return text;
  };
  auto text = "process first pid=100" + named("a");
  if (is_in_two) text += "\nprocess second pid=200" + named("b");
  const auto spec = SchedulingSpec::parse("chains: [{name: c, callbacks: [/plan, /last]}]", "s");
  const auto report = analyze(trace_of(text), {.spec = &spec}).report;
  for (const auto& chain : report.chains) {
    if (chain.name == "c") return chain.process;
  }
  ADD_FAILURE() << "no chain of the spec";
  return {};
}

TEST(Chains, OfASpecThatRunInTwoProcessesAreOfNeither) {
  EXPECT_TRUE(process_of_chain(false).has_value());
  EXPECT_FALSE(process_of_chain(true).has_value());
}

TEST(Chains, BeginInTheWindow) {
  auto trace = trace_of(kOvertaken);
  for (auto& event : trace.events) {
    if (std::holds_alternative<PacketBegin>(event.body)) event.head.time = Timestamp{12};
  }
  std::ranges::stable_sort(trace.events, {}, [](const Event& event) { return event.head.time; });
  EXPECT_EQ(chain_of(trace).instances, 1U) << "what fusion took at 18 was read at 11";
}

// The first message is of an instance before the recording: mid -> last is the rest of its path.
TEST(Chains, HaveNoneOfWhatBeganBeforeTheRecording) {
  auto trace = trace_of(kThreeHops);
  std::erase_if(trace.events, [](const Event& event) {
    return event.head.time.ns >= 11 && event.head.time.ns <= 15;
  });
  const auto chain = chain_of(trace);
  EXPECT_EQ(chain.hops.size(), 3U);
  EXPECT_EQ(chain.instances, 1U);
}

// Two processes have callbacks of the same ids. The second publication of the one that starts at 10 is
// lost, and the other one's instance came last before.
TEST(Chain, OfAProcessIsNotBridgedOverALostPublicationByThatOfAnother) {
  std::string text;
  for (const std::string process : {"1", "2"}) {
    text += "process p" + process + " pid=" + process + "00\n" + "publisher out" + process +
            " topic=/points\n" + "callback plan" + process + " id=plan timer period=20\n" +
            "callback fusion" + process + " id=fusion subscription topic=/points\n";
  }
  const auto run = [&text](int at, const std::string& process, int seq) {
    add(text, at, "start plan" + process + " release=" + std::to_string(at));
    add(text, at + 2, "publish out" + process + " on=plan" + process);
    add(text, at + 4, "end plan" + process);
    add(text, at + 6,
        "start fusion" + process + " release=" + std::to_string(at + 6) + " from=out" + process +
            ':' + std::to_string(seq));
    add(text, at + 10, "end fusion" + process);
  };
  run(10, "2", 0);
  run(30, "1", 0);
  run(50, "2", 1);
  run(90, "2", 2);
  run(130, "2", 3);
  run(170, "1", 1);
  auto trace = trace_of(text);
  trace.erase<Publish>([](const Publish& event, const EventHead& head) {
    return head.pid == 200 && event.seq == 1;
  });
  const Verified verified(trace,
                          "chains:\n  - {name: brake, callbacks: [plan, fusion], data_age: 500}\n");
  ASSERT_EQ(verified.result.report.chains.size(), 1U);
  const auto& chain = verified.result.report.chains.front();
  EXPECT_EQ(chain.instances, 5U);
  for (const auto& bridged : {chain.reaction_time, chain.data_age}) {
    EXPECT_EQ(count_of(bridged), 2U);
    EXPECT_EQ(sum_of(bridged), (140 - 90) + (180 - 30));
  }
}

}  // namespace
}  // namespace cie::test
