// Callbacks that feed each other: what led to their messages grows without end, and is bounded.
#include "support/trace_text.hpp"
#include "support/verdicts.hpp"
#include "trackers/chain_tracker.hpp"
#include "trackers/host_clocks.hpp"
#include "trackers/registry.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;

// Every 2000: source -> relay -> {last, first <-> second}. The loop goes round `rounds` times, then
// last takes what relay published, and ends 910 after the release of source.
std::string loop_beside_a_chain(int rounds, int seeds) {
  std::string text = R"(
    publisher raw topic=/raw
    publisher data topic=/data
    publisher there topic=/there
    publisher back topic=/data
    callback source timer period=2000
    callback relay subscription topic=/raw
    callback first subscription topic=/data
    callback second subscription topic=/there
    callback last subscription topic=/data)";
  for (int seed = 0; seed < seeds; ++seed) {
    const auto add = [&text, at = 2000 * (seed + 1)](int after, const std::string& what) {
      text += "\n" + std::to_string(at + after) + " " + what;
    };
    const auto number = [&](int round) { return std::to_string(seed * rounds + round); };
    const auto seed_number = std::to_string(seed);
    add(1, "start source release=" + std::to_string(2000 * (seed + 1)));
    add(2, "publish raw on=source");
    add(3, "end source");
    add(5, "start relay release=none from=raw:" + seed_number);
    add(6, "publish data on=relay");
    add(7, "end relay");
    for (int round = 0; round < rounds; ++round) {
      const int begin = 10 + 20 * round;
      add(begin, "start first release=none from=" +
                     (round == 0 ? "data:" + seed_number : "back:" + number(round - 1)));
      add(begin + 2, "publish there on=first");
      add(begin + 4, "end first");
      add(begin + 10, "start second release=none from=there:" + number(round));
      add(begin + 12, "publish back on=second");
      add(begin + 14, "end second");
    }
    add(900, "start last release=none from=data:" + seed_number);
    add(910, "end last");
  }
  return text;
}

std::uint64_t count_of(const Report& report, DefectKind kind) {
  const auto defect = std::ranges::find(report.defects, kind, &TraceDefect::kind);
  return defect == report.defects.end() ? 0 : defect->count;
}

TEST(LongChains, LeaveOthersThatBeginLikeThemWhole) {
  for (const int rounds : {3, 14, 15, 16, 17, 31, 40}) {
    const auto report = analyze(trace_of(loop_beside_a_chain(rounds, 3))).report;
    const auto chain = std::ranges::find_if(
        report.chains, [](const ChainReport& c) { return c.hops.back() == "last"; });
    ASSERT_NE(chain, report.chains.end()) << rounds;
    EXPECT_EQ(chain->name, "source -> relay -> last") << rounds;
    EXPECT_EQ(chain->instances, 3U) << rounds;
    EXPECT_EQ(chain->path_latency->max, 910) << rounds;
    for (const auto& other : report.chains)
      EXPECT_EQ(other.hops.front(), "source") << rounds << ": nothing else begins a path";
  }
}

TEST(LongChains, AreNotListedAndCounted) {
  // Of two callbacks and 2 * 15 of the loop.
  const auto listed = analyze(trace_of(loop_beside_a_chain(15, 3))).report;
  EXPECT_EQ(listed.chains.size(), 2U);
  EXPECT_EQ(count_of(listed, DefectKind::chains_not_listed), 0U);

  // The last eight instances of each seed have more than 32 before them; what goes on to them is
  // no whole path.
  const auto report = analyze(trace_of(loop_beside_a_chain(19, 3))).report;
  ASSERT_EQ(report.chains.size(), 1U);
  EXPECT_EQ(report.chains[0].name, "source -> relay -> last");
  EXPECT_EQ(count_of(report, DefectKind::chains_not_listed), 3U * (2 + 2 * 19 - 32));
}

TEST(LongChains, OfASpecAreWholeHoweverOftenALoopGoesRound) {
  constexpr int kRounds = 40;
  constexpr int kSeeds = 3;
  const auto trace = trace_of(loop_beside_a_chain(kRounds, kSeeds));
  const auto spec = [](const std::string& callbacks, int latency) {
    return "chains: [{name: c, callbacks: [" + callbacks +
           "], path_latency: " + std::to_string(latency) + "}]";
  };
  const Verified kept(trace, spec("source, relay, last", 910));
  EXPECT_EQ(kept["Q2"], Verdict::pass) << kept.evidence("Q2", "chain c");
  EXPECT_EQ(Verified(trace, spec("source, relay, last", 909))["Q2"], Verdict::fail);

  const Verified within(trace, "chains: [{name: c, callbacks: [first, second], data_age: 10000}]");
  ASSERT_EQ(within.result.report.chains.size(), 1U);
  EXPECT_EQ(within.result.report.chains[0].instances, kRounds * kSeeds + 0U);
  EXPECT_EQ(within["Q2"], Verdict::pass) << within.evidence("Q2", "chain c");
  EXPECT_EQ(count_of(within.result.report, DefectKind::chains_not_listed), 0U);
}

// One callback on a publisher, whose instances are made by hand.
class Loop : public testing::Test {
 protected:
  static constexpr std::uint64_t kGid = 7;

  Loop() {
    announce(PublisherId{});
    callback_ = registry_.callback(ProcessIndex{}, CallbackId{});
  }
  // From here on that one publishes, with the same gid.
  void announce(PublisherId id) {
    EventHead head;
    head.pid = 100;
    head.tid = 100;
    registry_.apply(head, PublisherInit{.publisher = id, .topic = "/t", .writer_gid = kGid});
    publisher_ = registry_.publisher(ProcessIndex{}, id);
  }
  // `takes`: the source timestamp of its message; 0: none.
  ChainNodeRef instance(std::int64_t takes) {
    auto node = chains_.new_node(callback_);
    node->callback = callback_;
    node->writer_gid = takes == 0 ? 0 : kGid;
    node->source_timestamp = takes;
    chains_.link(*node);
    return node;
  }
  void publish(const ChainNodeRef& node, std::int64_t source_timestamp) {
    chains_.on_publish(publisher_, EventRef{}, source_timestamp, node);
    most_in_use_ = std::max(most_in_use_, chains_.nodes_in_use());
  }

  // 1024 messages wait, and each 32 of them share a copy of the 32 instances before them.
  static constexpr std::size_t kMost = 2 * (1024 + 3 * 32);

  Model model_;
  Registry registry_{model_};
  HostClocks clocks_{model_};
  LossTimes losses_;
  ChainTracker chains_{model_, registry_, clocks_, losses_, nullptr};
  std::uint32_t publisher_{};
  CallbackIndex callback_{};
  std::size_t most_in_use_ = 0;
};

// It takes what it published itself, forever.
TEST_F(Loop, KeepsNoMoreInstancesThanMessagesWait) {
  for (std::int64_t i = 1; i <= 20'000; ++i) {
    publish(instance(i - 1), i);
    // What others take of it changes nothing.
    for (int other = 0; other < 2; ++other)
      ASSERT_TRUE(instance(i)->parent);
  }
  EXPECT_LE(most_in_use_, kMost);
}

// As between hosts, where a message may be taken before it is seen to be published.
TEST_F(Loop, KeepsNoMoreInstancesWhereTheyAreLinkedLate) {
  publish(instance(0), 1);
  auto first = instance(1);
  for (std::int64_t i = 1; i <= 20'000; i += 2) {
    const auto second = instance(i + 1);
    publish(second, i + 2);
    publish(first, i + 1);
    first = instance(i + 2);
    chains_.on_complete(*second, EventRef{});
    ASSERT_TRUE(first->parent);
    ASSERT_TRUE(second->parent);
  }
  EXPECT_LE(most_in_use_, kMost);
}

TEST_F(Loop, TakesMessagesOfWhoToldTheirGidLast) {
  publish(instance(0), 1);
  ASSERT_TRUE(instance(1)->parent);
  announce(PublisherId{1});
  publish(instance(0), 2);
  EXPECT_TRUE(instance(2)->parent);
}

}  // namespace
}  // namespace cie::test
