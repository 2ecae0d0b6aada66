#include <cie/analysis/comparison.hpp>

#include "support/move_to_host.hpp"
#include "support/verdicts.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kQueue = R"(
  callback fusion subscription
  10 release fusion
  12 start fusion
  20 end fusion)";

TEST(NoQueueOverflow, FailsForLostAndOverwrittenSamples) {
  EXPECT_EQ(Verified(kQueue).of("Q1", "callback fusion"), Verdict::pass);
  const Verified lost(std::string(kQueue) + "\n15 lost fusion count=3");
  EXPECT_EQ(lost.of("Q1", "callback fusion"), Verdict::fail);
  EXPECT_THAT(lost.evidence("Q1", "callback fusion"),
              HasSubstr("15 sample_lost 3 samples were lost"));
  EXPECT_THAT(
      Verified(std::string(kQueue) + "\n15 lost fusion count=1").evidence("Q1", "callback fusion"),
      HasSubstr("15 sample_lost 1 sample was lost"));

  const auto overwriting = std::string(kQueue) + "\n15 release fusion overwritten=2";
  const Verified verified(overwriting);
  EXPECT_EQ(verified.of("Q1", "callback fusion"), Verdict::fail);
  EXPECT_THAT(verified.evidence("Q1", "callback fusion"),
              HasSubstr("15 callback_release 2 samples were overwritten"));
  EXPECT_EQ(Verified(overwriting, "callback_groups:\n  - id: fusion\n    overwrites_allowed: 2")
                .of("Q1", "callback fusion"),
            Verdict::pass);
}

// cie_rclcpp, which announces a worker for what rclcpp serves for itself, counts by what the middleware
// announces, and lacks some.
TEST(NoQueueOverflow, SaysAtLeastWhereTheCountLacksSome) {
  const auto overwriting = std::string(kQueue) + "\n15 release fusion overwritten=2";
  const Verified verified("thread cie-rclcpp worker" + overwriting);
  EXPECT_EQ(verified.of("Q1", "callback fusion"), Verdict::fail);
  EXPECT_THAT(verified.evidence("Q1", "callback fusion"),
              HasSubstr("at least 2 samples were overwritten"));
  EXPECT_THAT(Verified("thread other worker" + overwriting).evidence("Q1", "callback fusion"),
              Not(HasSubstr("at least")));
}

TEST(NoQueueOverflow, IsInconclusiveWithoutTotals) {
  EXPECT_EQ(Verified("process app crash" + std::string(kQueue))["Q1"], Verdict::inconclusive);
  EXPECT_EQ(Verified("process app crash" + std::string(kQueue) + "\n15 lost fusion")["Q1"],
            Verdict::fail)
      << "column R: the witness is there";
  EXPECT_EQ(Verified("process app attached crash" + std::string(kQueue))["Q1"], Verdict::pass)
      << "attached: the running totals count";
}

// Q1 judges what the process counted; two recordings of it are compared by what happened in each.
TEST(NoQueueOverflow, CountsWhatWasBeforeTheAttachAndTellsItApart) {
  const Verified verified(R"(
    process app attached crash
    callback fusion subscription next=20
    10 release fusion overwritten=500
    12 start fusion
    14 end fusion
    15 release fusion overwritten=502
    16 start fusion
    17 lost fusion count=3
    18 end fusion)");
  EXPECT_EQ(verified["Q1"], Verdict::fail);
  const auto& report = verified.result.report.callbacks.at(0);
  EXPECT_EQ(report.overwritten_samples, 502U);
  EXPECT_EQ(report.overwritten_before, 500U);
  EXPECT_EQ(report.lost_samples, 3U);
  EXPECT_EQ(report.lost_before, std::nullopt);
  const auto sample = CallbackSample::of(report);
  EXPECT_EQ(sample.overwritten_samples, 2U);
  EXPECT_EQ(sample.lost_samples, 3U);
}

TEST(NoQueueOverflow, JudgesTimersNot) {
  EXPECT_EQ(Verified("callback fusion timer\n2 start fusion release=1\n3 end fusion")["Q1"],
            Verdict::not_applicable);
}

// Two instances of the chain: released at 10 and 30, ended at 25 and 55.
constexpr const char* kChain = R"(
  publisher out topic=/t
  callback plan timer period=20
  callback fusion subscription topic=/t
  11 start plan release=10
  13 publish out on=plan
  15 end plan
  16 release fusion
  18 start fusion from=out:0
  25 end fusion
  31 start plan release=30
  33 publish out on=plan
  35 end plan
  36 release fusion
  38 start fusion from=out:1
  55 end fusion)";

std::string chain(const std::string& bound) {
  return "chains:\n  - name: brake\n    callbacks: [plan, fusion]\n    " + bound + "\n";
}

TEST(ChainBounds, BoundsThePathLatency) {
  EXPECT_EQ(Verified(kChain, chain("path_latency: 25"))["Q2"], Verdict::pass);
  const Verified verified(kChain, chain("path_latency: 24"));
  EXPECT_EQ(verified.of("Q2", "chain brake"), Verdict::fail);
  EXPECT_THAT(verified.evidence("Q2", "chain brake"),
              AllOf(HasSubstr("31 callback_start first callback of the chain starts"),
                    HasSubstr("55 callback_end path latency 25 ns, spec.yaml:2 allows 24 ns")));
}

TEST(ChainBounds, BoundsTheDataAge) {
  // The value read at 11 is in use until the next write at 55.
  EXPECT_EQ(Verified(kChain, chain("data_age: 44"))["Q2"], Verdict::pass);
  EXPECT_EQ(Verified(kChain, chain("data_age: 43"))["Q2"], Verdict::fail);
}

TEST(ChainBounds, BoundsTheReactionTime) {
  // A stimulus just after the read at 11 is answered by the write at 55.
  EXPECT_EQ(Verified(kChain, chain("reaction_time: 44"))["Q2"], Verdict::pass);
  EXPECT_EQ(Verified(kChain, chain("reaction_time: 43"))["Q2"], Verdict::fail);
}

// The chain stops answering; its first callback reads on, and the last one is still there.
TEST(ChainBounds, AreUndecidedWhereNothingAnswersForLonger) {
  const auto reads_on = [](const std::vector<int>& times) {
    std::string text = kChain;
    for (const auto time : times) {
      const auto at = std::to_string(time);
      text +=
          '\n' + at + " start plan release=" + at + '\n' + std::to_string(time + 2) + " end plan";
    }
    return text;
  };
  const auto silent = reads_on({60, 80, 100, 120});
  for (const auto* bound : {"reaction_time: 44", "data_age: 44"}) {
    const Verified verified(silent, chain(bound));
    EXPECT_EQ(verified["Q2"], Verdict::inconclusive) << bound;
    EXPECT_THAT(verified.evidence("Q2", "chain brake"),
                HasSubstr("4 reads of the first callback from here on had no answer 60 ns later"));
    EXPECT_EQ(Verified(reads_on({60, 80, 100}), chain(bound))["Q2"], Verdict::pass) << bound;
    EXPECT_EQ(Verified(silent + "\n90 fini fusion", chain(bound))["Q2"], Verdict::pass)
        << "nobody was there any more to answer";
  }
  EXPECT_EQ(Verified(silent, chain("path_latency: 25"))["Q2"], Verdict::pass);
}

// Two processes, as of two robots, whose callbacks have the same ids: what the one does makes nothing of the other new.
TEST(ChainBounds, AreMeasuredAmongTheSameCallbacks) {
  const auto process = [](const std::string& name, int pid, const std::string& topic) {
    return "process " + name + " pid=" + std::to_string(pid) + "\npublisher " + name +
           ".out topic=" + topic + "\ncallback " + name +
           ".plan id=plan timer period=20\ncallback " + name +
           ".fusion id=fusion subscription topic=" + topic + "\n";
  };
  const auto run = [](const std::string& name, int at, int number) {
    const auto line = [&](int after, const std::string& what) {
      return std::to_string(at + after) + ' ' + what + '\n';
    };
    return line(0, "start " + name + ".plan release=none") +
           line(1, "publish " + name + ".out on=" + name + ".plan") +
           line(2, "end " + name + ".plan") +
           line(3, "start " + name + ".fusion release=none from=" + name +
                       ".out:" + std::to_string(number)) +
           line(5, "end " + name + ".fusion");
  };
  const auto text = process("a", 100, "/a") + process("b", 200, "/b") + run("a", 100, 0) +
                    run("b", 200, 0) + run("a", 300, 1) + run("b", 450, 1);
  // What a read at 100 is in use until 305, what b read at 200 until 455.
  EXPECT_EQ(Verified(text, chain("data_age: 255"))["Q2"], Verdict::pass);
  EXPECT_EQ(Verified(text, chain("data_age: 254"))["Q2"], Verdict::fail);
  EXPECT_EQ(Verified(text, chain("reaction_time: 255"))["Q2"], Verdict::pass);
  EXPECT_EQ(Verified(text, chain("reaction_time: 254"))["Q2"], Verdict::fail);
}

TEST(ChainBounds, AreMeasuredHoweverLongTheChainIs) {
  constexpr int kHops = 40;
  std::string text;
  std::string callbacks;
  for (int i = 0; i < kHops; ++i) {
    const auto n = std::to_string(i);
    const auto at = [i](int after) { return std::to_string(100 + 10 * i + after) + ' '; };
    text += "publisher p" + n + " topic=/t" + n + "\ncallback c" + n +
            (i == 0 ? " timer period=1000\n"
                    : " subscription topic=/t" + std::to_string(i - 1) + '\n') +
            at(0) + "start c" + n + " release=" + at(0) +
            (i == 0 ? "\n" : " from=p" + std::to_string(i - 1) + ":0\n") + at(2) + "publish p" + n +
            " on=c" + n + '\n' + at(4) + "end c" + n + '\n';
    callbacks += (i == 0 ? "c" : ", c") + n;
  }
  const auto spec = [&callbacks](int bound) {
    return "chains:\n  - name: brake\n    callbacks: [" + callbacks +
           "]\n    path_latency: " + std::to_string(bound) + "\n";
  };
  EXPECT_EQ(Verified(text, spec(10 * (kHops - 1) + 4))["Q2"], Verdict::pass);
  EXPECT_EQ(Verified(text, spec(10 * (kHops - 1) + 3))["Q2"], Verdict::fail);
}

TEST(ChainBounds, AreInconclusiveWhenAPublisherIsMissingAltogether) {
  auto trace = trace_of("publisher other topic=/t\n" + std::string(kChain));
  EXPECT_EQ(Verified(trace, chain("path_latency: 25"))["Q2"], Verdict::pass);
  const auto gone = [](const auto& event, const EventHead&) {
    return event.publisher == PublisherId{0};
  };
  ASSERT_EQ(trace.erase<PublisherInit>(gone) + trace.erase<PublisherFini>(gone), 2U);
  EXPECT_EQ(Verified(trace, chain("path_latency: 25"))["Q2"], Verdict::inconclusive);
}

TEST(ChainBounds, IsInconclusiveWhenAPublishIsUnseen) {
  auto trace = trace_of(kChain);
  trace.erase<Publish>([](const Publish& e, const EventHead&) { return e.seq == 1; });
  EXPECT_EQ(Verified(trace, chain("path_latency: 100"))["Q2"], Verdict::inconclusive);
}

TEST(ChainBounds, IsInconclusiveWhenACallbackOfItLostInstances) {
  auto trace = trace_of(kChain);
  trace.erase<CallbackFini>();
  EXPECT_EQ(Verified(trace, chain("path_latency: 24"))["Q2"], Verdict::inconclusive)
      << "column L: loss withdraws a FAIL";
}

// Written at 8, taken by 11, whenever it arrived between; the chain ends at 25.
TEST(ChainBounds, TheBoundsOfAnUnknownFirstReleaseMayDecide) {
  constexpr const char* kTaken = R"(
    thread radar worker
    publisher in topic=/in
    publisher out topic=/t
    callback plan subscription topic=/in
    callback fusion subscription topic=/t
    8 publish in on=radar
    11 start plan release=none from=in:0
    13 publish out on=plan
    15 end plan
    16 release fusion
    18 start fusion from=out:0
    25 end fusion)";
  const Verified kept(kTaken, chain("path_latency: 17"));
  EXPECT_EQ(kept["Q2"], Verdict::pass);
  const Verified unknown(kTaken, chain("path_latency: 16"));
  EXPECT_EQ(unknown["Q2"], Verdict::inconclusive);
  EXPECT_THAT(unknown.evidence("Q2", "chain brake"),
              HasSubstr("the path latency may have been up to 17 ns"));
  EXPECT_EQ(Verified(kTaken, chain("path_latency: 14"))["Q2"], Verdict::inconclusive);
  EXPECT_EQ(Verified(kTaken, chain("path_latency: 13"))["Q2"], Verdict::fail);
  EXPECT_EQ(Verified(kTaken, chain("path_latency: 17\n    data_age: 100"))["Q2"],
            Verdict::inconclusive)
      << "of which one instance tells nothing";

  auto working_on = std::string(kTaken);
  working_on.replace(working_on.find("15 end plan"), 11, "30 end plan");
  EXPECT_EQ(Verified(working_on, chain("path_latency: 17"))["Q2"], Verdict::pass)
      << "the first callback ends last";
  auto clock_set = trace_of(kTaken);  // forward, by 4 ns, before the first message was written
  std::int64_t written = 0;
  for (auto& event : clock_set.events) {
    if (auto* publish = std::get_if<Publish>(&event.body); publish != nullptr && written == 0) {
      written = publish->source_timestamp_realtime_ns;
      publish->source_timestamp_realtime_ns += 4;
    }
    auto* start = std::get_if<analysis::CallbackStart>(&event.body);
    if (start != nullptr && written != 0 && start->source_timestamp_realtime_ns == written) {
      start->source_timestamp_realtime_ns += 4;
    }
  }
  EXPECT_EQ(Verified(clock_set, chain("path_latency: 1000"))["Q2"], Verdict::inconclusive)
      << "no message is written after it was taken";
}

TEST(ChainBounds, NeedsTheFirstReleaseForThePathLatencyAndNoOther) {
  auto text = std::string(kChain);
  text.replace(text.find("31 start plan release=30"), 24, "31 start plan           ");
  const Verified verified(text, chain("path_latency: 100"));
  EXPECT_EQ(verified["Q2"], Verdict::inconclusive);
  EXPECT_THAT(verified.evidence("Q2", "chain brake"),
              HasSubstr("the first release of 1 instance of the chain is not known exactly"));
  EXPECT_EQ(Verified(text, chain("data_age: 44"))["Q2"], Verdict::pass) << "it needs no release";

  const Verified late(text, chain("path_latency: 23"));
  EXPECT_EQ(late["Q2"], Verdict::fail) << "whenever it was released before 31: to 55 that is 24";
  EXPECT_THAT(late.evidence("Q2", "chain brake"), HasSubstr("path latency at least 24 ns"));
  EXPECT_EQ(Verified(text, chain("path_latency: 24"))["Q2"], Verdict::inconclusive);

  // From 30 to 55, whenever fusion was released between.
  text = kChain;
  text.replace(text.find("38 start fusion from"), 15, "38 start fusion release=none");
  EXPECT_EQ(Verified(text, chain("path_latency: 25"))["Q2"], Verdict::pass);
  EXPECT_EQ(Verified(text, chain("path_latency: 24"))["Q2"], Verdict::fail);
}

// Of a second process of the same kind, whose path takes 85.
TEST(ChainBounds, IsInconclusiveWhereACallbackIsUnknownThatMayBeOfIt) {
  auto trace = trace_of("process one pid=100 until=60" + std::string(kChain) + R"(
  process two pid=200 from=1000
  publisher out2 topic=/t
  callback plan2 id=plan timer period=20
  callback fusion2 id=fusion subscription topic=/t
  1011 start plan2 release=1010
  1013 publish out2 on=plan2
  1015 end plan2
  1016 release fusion2
  1018 start fusion2 from=out2:0
  1095 end fusion2)");
  EXPECT_EQ(Verified(trace, chain("path_latency: 25"))["Q2"], Verdict::fail);
  trace.erase<CallbackInit>([](const CallbackInit& e, const EventHead& head) {
    return head.pid == 200 && e.logical_id == "fusion";
  });
  EXPECT_EQ(Verified(trace, chain("path_latency: 25"))["Q2"], Verdict::inconclusive);
}

TEST(ChainBounds, IsInconclusiveWhenNothingCouldBeLinked) {
  const auto is_unlinked = [](const Verified& verified) {
    EXPECT_EQ(verified.of("Q2", "chain brake"), Verdict::inconclusive);
    EXPECT_THAT(verified.evidence("Q2", "chain brake"), HasSubstr("could be linked"));
    const auto& chains = verified.result.report.chains;
    ASSERT_EQ(chains.size(), 1U);
    EXPECT_EQ(chains[0].name, "brake");
    EXPECT_EQ(chains[0].instances, 0U);
    EXPECT_EQ(chains[0].hop_table.size(), 2U) << "its hops, of which nothing is known";
  };
  // Messages without source timestamps.
  auto trace = trace_of(kChain);
  for (auto& event : trace.events) {
    if (auto* start = std::get_if<CallbackStart>(&event.body)) {
      start->source_timestamp_realtime_ns = 0;
      start->writer_gid = 0;
    }
  }
  is_unlinked(Verified(trace, chain("path_latency: 100")));
  // Callbacks that do not exist.
  is_unlinked(Verified(kQueue, chain("data_age: 100")));
}

TEST(ChainBounds, IsInconclusiveWhenNothingOfABoundCouldBeMeasured) {
  const auto end_of_first = std::string(kChain).find("31 start");
  const auto text = std::string(kChain).substr(0, end_of_first);
  EXPECT_EQ(Verified(text, chain("path_latency: 100"))["Q2"], Verdict::pass);
  const Verified verified(text, chain("path_latency: 100\n    reaction_time: 100"));
  EXPECT_EQ(verified["Q2"], Verdict::inconclusive);
  EXPECT_THAT(verified.evidence("Q2", "chain brake"),
              HasSubstr("no reaction time could be measured: it takes two instances"));
}

// plan on one host, fusion on another one whose clock is 300 ahead. Ends at 25 and 55 of a path
// that begins at 10 and 30; the message takes 2 and 10. Back, none takes less than `back`.
Verified on_two_hosts(const std::string& spec, std::int64_t back, std::int64_t ahead) {
  auto text = std::string(R"(
    process robot pid=100
    publisher out topic=/points
    callback plan timer period=20
    callback ack subscription topic=/ack
    process desk pid=200
    publisher back topic=/ack
    callback fusion subscription topic=/points
    10 start plan release=10
    12 publish out on=plan
    13 end plan
    15 start fusion release=14 from=out:0
    20 publish back on=fusion
    25 end fusion
    30 start plan release=30
    32 publish out on=plan
    33 end plan
    43 start fusion release=42 from=out:1
    55 end fusion)");
  if (back > 0) {
    const auto release = 20 + back;
    text += "\n" + std::to_string(release) + " start ack release=" + std::to_string(release) +
            " from=back:0\n" + std::to_string(release + 1) + " end ack";
  }
  auto trace = trace_of(text);
  move_to_host(trace, 200, {.name = "desk", .monotonic = 7'000, .realtime = ahead});
  return Verified(trace, spec);
}

Verdict of_two_hosts(const std::string& bound, std::int64_t back, std::int64_t ahead = 300) {
  return on_two_hosts(chain(bound), back, ahead)["Q2"];
}

// What took a message may be read before what published it, and before its publisher is announced.
TEST(ChainBounds, BetweenHostsCountEveryInstanceWhateverTheClocks) {
  const auto instances = [](const std::string& callbacks, std::int64_t ahead) {
    const auto spec =
        "chains:\n  - {name: brake, callbacks: [" + callbacks + "], path_latency: 1000}\n";
    const auto chains = on_two_hosts(spec, 6, ahead).result.report.chains;
    return chains.size() == 1 ? chains.front().instances : 0;
  };
  for (const std::int64_t ahead : {0, 300, -4, -10, -20, -300, 20'000, -20'000}) {
    EXPECT_EQ(instances("plan, fusion", ahead), 2U) << ahead;
    EXPECT_EQ(instances("plan, fusion, ack", ahead), 1U) << ahead;
  }
}

TEST(ChainBounds, BetweenHostsNeedWhatTheClocksMayDifferByBesides) {
  // The longest path takes 25, shown as 325. Fastest 2 there and 6 back: true is 23 to 31.
  EXPECT_EQ(of_two_hosts("path_latency: 31", 6), Verdict::pass);
  EXPECT_EQ(of_two_hosts("path_latency: 30", 6), Verdict::inconclusive);
  EXPECT_EQ(of_two_hosts("path_latency: 23", 6), Verdict::inconclusive);
  EXPECT_EQ(of_two_hosts("path_latency: 22", 6), Verdict::fail);
}

// By its clock the other host took and answered messages before they were published.
TEST(ChainBounds, BetweenHostsHoldWhicheverClockIsAhead) {
  EXPECT_EQ(of_two_hosts("path_latency: 31", 6, -300), Verdict::pass);
  EXPECT_EQ(of_two_hosts("path_latency: 30", 6, -300), Verdict::inconclusive);
  EXPECT_EQ(of_two_hosts("path_latency: 22", 6, -300), Verdict::fail);
}

TEST(ChainBounds, BetweenHostsAreNotProvenByMessagesOfOneDirection) {
  EXPECT_EQ(of_two_hosts("path_latency: 1000", 0), Verdict::inconclusive);
  EXPECT_EQ(of_two_hosts("path_latency: 22", 0), Verdict::fail);  // whatever the clocks
}

TEST(ChainBounds, BetweenHostsNeedTheClocksForDataAgeEvenWithoutReleases) {
  // plan reads at 10 and 30, fusion ends at 25 and 55: the value read at 10 is 45 old, shown as
  // 345.
  auto trace = trace_of(R"(
    process robot pid=100
    publisher out topic=/points
    callback plan timer period=20
    process desk pid=200
    callback fusion subscription topic=/points
    10 start plan release=none
    12 publish out on=plan
    13 end plan
    15 start fusion release=none from=out:0
    25 end fusion
    30 start plan release=none
    32 publish out on=plan
    33 end plan
    43 start fusion release=none from=out:1
    55 end fusion)");
  move_to_host(trace, 200, {.name = "desk", .monotonic = 7'000, .realtime = 300});
  EXPECT_EQ(Verified(trace, chain("data_age: 100"))["Q2"], Verdict::inconclusive);
  EXPECT_EQ(Verified(trace, chain("data_age: 1000"))["Q2"], Verdict::inconclusive);
}

TEST(ChainBounds, AppliesNotToAChainWithoutBound) {
  EXPECT_EQ(Verified(kChain, "chains:\n  - {name: c, callbacks: [plan, fusion]}")["Q2"],
            Verdict::not_applicable);
}

// Whether releases are recorded is asked of each machine.
TEST(NoQueueOverflow, IsJudgedOfAMachineAsIfItWereAlone) {
  auto without = trace_of(
      "callback fusion subscription topic=/a\n5 release fusion\n10 start fusion\n12 end fusion");
  without.erase<CallbackRelease>();
  ASSERT_EQ(Verified(without)["Q1"], Verdict::pass);
  const auto with = trace_of(
      "callback fusion subscription topic=/a\n5 release fusion\n10 start fusion\n12 end fusion");
  EXPECT_EQ(Verified(beside(with, without, {.name = "desk"}))["Q1"], Verdict::pass);
}

}  // namespace
}  // namespace cie::test
