// Recordings of real systems against figures that others computed from them.
//
// Every folder with an `expected.json`, below ours or the one that CIE_TRACES names, holds a
// recording and, by address of each callback, how often it ran, how long and on which threads.
// Addresses of one subscription are one callback here, so figures of equal names are added up
// before they are compared. A `caret_reference.json` beside it has what CARET says of the messages.
#include <cie/analysis/analyzer.hpp>
#include <cie/analysis/report_rows.hpp>
#include <cie/viewer_export/sentences.hpp>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace cie::analysis {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct Figures {
  std::uint64_t count = 0;
  std::int64_t min = INT64_MAX;
  std::int64_t max = INT64_MIN;
  std::map<std::int64_t, std::uint64_t> tids;

  void add(std::int64_t value) {
    ++count;
    min = std::min(min, value);
    max = std::max(max, value);
  }
  bool operator==(const Figures&) const = default;
};

std::ostream& operator<<(std::ostream& out, const Figures& figures) {
  out << figures.count << " from " << figures.min << " to " << figures.max << " on";
  for (const auto& [tid, count] : figures.tids)
    out << ' ' << tid << ':' << count;
  return out;
}

// Process, kind, node, topic or service or period.
using Name = std::tuple<std::int64_t, std::string, std::string, std::string>;

struct Run {
  CallbackIndex callback{};
  std::int64_t pid = 0;
  std::int64_t tid = 0;
  std::int64_t start = 0;
  std::int64_t end = -1;
};
class Everything final : public Observer {
 public:
  std::vector<Run> runs;

  void on_instance(const Instance& instance) override {
    runs.push_back(Run{.callback = instance.callback,
                       .pid = instance.pid,
                       .tid = instance.tid,
                       .start = instance.start.ns,
                       .end = instance.end ? instance.end->ns : -1});
  }
};

json read(const fs::path& path) {
  std::ifstream file(path);
  return json::parse(file);
}

// Folders below this one with figures of callbacks.
std::vector<fs::path> recordings(const char* folder) {
  std::vector<fs::path> found;
  if (folder == nullptr) return found;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.path().filename() == "expected.json" &&
        read(entry.path()).contains("callback_threads")) {
      found.push_back(entry.path().parent_path());
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::string text_or(const json& object, const char* key, std::string fallback = {}) {
  const auto found = object.find(key);
  return found == object.end() || found->is_null() ? fallback : found->get<std::string>();
}

std::map<Name, Figures> expected_figures(const json& expected) {
  std::map<Name, Figures> figures;
  const auto take = [&](const json& callback, std::int64_t pid, const json& named) {
    if (!callback.contains("duration_ns")) return;
    auto source = text_or(named, "name");
    if (named.contains("period_ns"))
      source = std::to_string(named["period_ns"].get<std::int64_t>());
    auto& entry = figures[{pid, text_or(named, "type"), text_or(named, "node"), source}];
    const auto& durations = callback["duration_ns"];
    entry.count += durations["count"].get<std::uint64_t>();
    entry.min = std::min(entry.min, durations["min"].get<std::int64_t>());
    entry.max = std::max(entry.max, durations["max"].get<std::int64_t>());
  };
  for (const auto& callback : expected["callbacks"]) {
    const auto pid = callback["vpid"].get<std::int64_t>();
    if (callback.contains("generations")) {
      for (const auto& generation : callback["generations"])
        take(generation, pid, generation);
    } else {
      take(callback, pid, callback);
    }
  }
  return figures;
}

// What ran on which threads is not told by generation: over all callbacks of a process.
std::map<std::pair<std::int64_t, std::int64_t>, std::uint64_t> expected_threads(
    const json& expected) {
  std::map<std::pair<std::int64_t, std::int64_t>, std::uint64_t> threads;
  for (const auto& callback : expected["callbacks"]) {
    if (!callback.contains("tids")) continue;
    for (const auto& [tid, count] : callback["tids"].items()) {
      threads[{callback["vpid"].get<std::int64_t>(), std::stoll(tid)}] +=
          count.get<std::uint64_t>();
    }
  }
  return threads;
}

// By callback: pid, kind, node, and source or period.
std::map<CallbackIndex, Name> names_of(const Report& report) {
  const ReportRows rows(report);
  std::map<CallbackIndex, Name> names;
  for (const auto& callback : report.callbacks) {
    const auto source = callback.kind == CallbackKind::timer
                            ? std::to_string(callback.period_ns.value_or(0))
                            : callback.source;
    names[callback.index] = {rows.process_of(callback).pid,
                             callback.kind ? std::string(label(*callback.kind)) : "unknown",
                             callback.node, source};
  }
  return names;
}

void check_callbacks(const json& expected, const AnalysisResult& result,
                     const Everything& everything) {
  const auto names = names_of(result.report);
  std::map<Name, Figures> figures;
  std::map<std::pair<std::int64_t, std::int64_t>, std::uint64_t> threads;
  std::uint64_t complete = 0;
  std::uint64_t open = 0;
  for (const auto& run : everything.runs) {
    if (run.end < 0) {
      ++open;
      continue;
    }
    ++complete;
    ++threads[{run.pid, run.tid}];
    const auto name = names.find(run.callback);
    const auto key = name != names.end() ? name->second : Name{run.pid, "unknown", "", ""};
    figures[key].add(run.end - run.start);
  }
  EXPECT_EQ(complete, expected["total_instances"].get<std::uint64_t>());
  EXPECT_EQ(open, expected["total_open_at_end"].get<std::uint64_t>() +
                      expected["total_unmatched_start"].get<std::uint64_t>());
  EXPECT_EQ(result.report.trace.events, expected["events"].get<std::uint64_t>());
  EXPECT_EQ(threads, expected_threads(expected));
  const auto wanted = expected_figures(expected);
  for (const auto& [name, each] : wanted) {
    const auto& [pid, kind, node, source] = name;
    EXPECT_TRUE(figures.contains(name)) << pid << ' ' << kind << ' ' << node << ' ' << source;
    EXPECT_EQ(figures[name], each) << pid << ' ' << kind << ' ' << node << ' ' << source;
  }
  EXPECT_EQ(figures.size(), wanted.size());
}

void expect_equal(const Rare<Summary>& seen, const json& wanted, const std::string& what) {
  ASSERT_TRUE(seen) << what;
  EXPECT_EQ(seen->count, wanted["count"].get<std::uint64_t>()) << what;
  EXPECT_EQ(seen->min, wanted["min"].get<std::int64_t>()) << what;
  EXPECT_EQ(seen->max, wanted["max"].get<std::int64_t>()) << what;
  EXPECT_NEAR(seen->mean, wanted["mean"].get<double>(), 0.001) << what;
}

// CARET's communication latency: from the call of publish to the callback's start. Its node latency
// is compared where the callback that takes also publishes; where a node keeps the message for
// another callback, CARET follows the node's declaration, which no event tells. Both stand in the
// report.
void check_messages(const json& caret, const Report& report) {
  const ReportRows rows(report);
  for (const auto& link : caret["communications"]) {
    const auto topic = text_or(link, "topic");
    const auto edge = std::ranges::find_if(report.edges, [&](const GraphEdge& each) {
      return each.from && each.topic == topic &&
             rows.find(each.to)->node == text_or(link, "subscriber");
    });
    ASSERT_NE(edge, report.edges.end()) << topic;
    expect_equal(edge->publish_to_start, link["publish_to_callback_start_ns"], topic);
  }
  std::size_t compared = 0;
  for (const auto& path : caret["node_paths"]) {
    for (const auto& chain : report.chains) {
      for (const auto& hop : chain.hop_table) {
        if (!hop.to_callback) continue;
        const auto& from = *rows.find(*hop.from_callback);
        const bool is_it = from.node == text_or(path, "node") &&
                           from.source == text_or(path, "sub") &&
                           rows.find(*hop.to_callback)->source == text_or(path, "pub");
        if (!is_it) continue;
        expect_equal(hop.start_to_publish, path["latency_ns"], from.logical_id);
        ++compared;
      }
    }
  }
  EXPECT_EQ(compared, 2U);  // the other nodes keep messages
}

void check_recording(const fs::path& folder) {
  SCOPED_TRACE(folder.string());
  Everything everything;
  const std::vector<fs::path> paths{folder};
  const auto result = analyze(paths, {}, &everything);
  check_callbacks(read(folder / "expected.json"), result, everything);
  const auto caret = folder / "caret_reference.json";
  if (fs::exists(caret)) check_messages(read(caret), result.report);
  EXPECT_NE(result.verdicts.verdict, Verdict::pass);
}

Verdict verdict(const AnalysisResult& result, std::string_view rule) {
  const auto found = std::ranges::find(result.verdicts.rules, rule, &RuleVerdict::id);
  return found == result.verdicts.rules.end() ? Verdict::not_applicable : found->verdict;
}

// Two seconds of three timers and three subscriptions in two processes, under ROS 2 Humble.
const fs::path kOwn = CIE_RECORDINGS;

TEST(Ros2Recordings, OursGiveTheFiguresThatOthersComputed) {
  const auto folders = recordings(kOwn.c_str());
  EXPECT_EQ(folders.size(), 2U);
  for (const auto& folder : folders)
    check_recording(folder);
}

TEST(Ros2Recordings, ACallbackIsolatedExecutorIsFoundToBeOne) {
  const std::vector<fs::path> paths{kOwn / "isolated"};
  const auto result = analyze(paths, {});
  for (const auto& callback : result.report.callbacks)
    EXPECT_NE(callback.isolation, Isolation::not_isolated) << callback.logical_id;
  EXPECT_NE(verdict(result, "M2"), Verdict::fail);
  EXPECT_EQ(verdict(result, "M3"), Verdict::pass);
}

TEST(Ros2Recordings, AMultiThreadedExecutorIsFoundToBeOne) {
  const std::vector<fs::path> paths{kOwn / "multi_threaded"};
  const auto result = analyze(paths, {});
  EXPECT_EQ(verdict(result, "M2"), Verdict::fail);
  EXPECT_EQ(verdict(result, "M3"), Verdict::fail);
}

// By a script that takes rcl_timer_init - 10 us for the grid's begin and each start for the call. The
// first start comes half a second late; one of the third timer's is 1 218 914 ns late, on an idle
// thread.
TEST(Ros2Recordings, TimersStartAsLateAsOthersComputed) {
  const std::vector<fs::path> paths{kOwn / "isolated"};
  const auto result = analyze(paths, {});
  using Latency = std::tuple<std::uint64_t, std::int64_t, std::int64_t>;
  std::set<Latency> latencies;  // count, min, sum
  for (const auto& callback : result.report.callbacks) {
    if (callback.kind != CallbackKind::timer) continue;
    ASSERT_TRUE(callback.start_latency) << callback.logical_id;
    const auto& latency = *callback.start_latency;
    latencies.emplace(latency.count, latency.min, latency.sum);
  }
  EXPECT_EQ(latencies, (std::set<Latency>{{149, 92'454, 19'362'152},
                                          {149, 67'178, 18'976'547},
                                          {148, 100'259, 20'011'365 - 1'218'914}}));
}

TEST(Ros2Recordings, TimersAndWhatTheyPublishToAreChains) {
  const std::vector<fs::path> paths{kOwn / "isolated"};
  const auto result = analyze(paths, {});
  std::set<std::string> topics;
  for (const auto& chain : result.report.chains) {
    ASSERT_EQ(chain.hops.size(), 2U) << chain.name;
    EXPECT_TRUE(chain.hops[0].starts_with("/pub_node@Timer(10000000)")) << chain.name;
    topics.insert(chain.hops[1]);
  }
  EXPECT_EQ(topics, (std::set<std::string>{"/sub_node@Subscription(/topic0)",
                                           "/sub_node@Subscription(/topic1)",
                                           "/sub_node@Subscription(/topic2)"}));
}

// A client and a subscription share a group there. What the client's thread ran 39 times for it, no
// event shows.
TEST(Ros2Recordings, AClientsThreadIsNotFoundToBeIsolated) {
  const std::vector<fs::path> paths{kOwn / "client_in_group"};
  const auto result = analyze(paths, {});
  for (const auto& callback : result.report.callbacks) {
    if (callback.instances == 0) continue;
    EXPECT_FALSE(callback.is_isolated()) << callback.logical_id;
  }
  for (const auto* rule : {"M2", "M3", "M4", "M6", "E2", "E3"})
    EXPECT_EQ(verdict(result, rule), Verdict::inconclusive) << rule;
  EXPECT_EQ(verdict(result, "T5"), Verdict::pass);
  ASSERT_EQ(result.report.processes.size(), 1U);
  EXPECT_TRUE(result.report.processes.front().complete);
  const auto m2 = std::ranges::find(result.verdicts.rules, "M2", &RuleVerdict::id);
  ASSERT_NE(m2, result.verdicts.rules.end());
  EXPECT_EQ(m2->subjects.size(), 11U);  // threads that ran callbacks
  for (const auto& subject : m2->subjects) {
    ASSERT_EQ(subject.evidence.size(), 1U) << subject.subject;
    EXPECT_EQ(viewer_export::sentence(subject.evidence.front().note),
              "may also have served the client of /car/enable (node /car/plan), whose responses "
              "ROS 2's events do not show");
  }
}

// babeltrace2 shows one procname in the context of every event. Nothing else in it names anybody.
TEST(Ros2Recordings, ContextsNameProcessesAndThreads) {
  const std::vector<fs::path> paths{kOwn / "isolated"};
  const auto result = analyze(paths, {});
  EXPECT_EQ(result.report.processes.size(), 2U);
  EXPECT_GT(result.report.threads.size(), 2U);
  for (const auto& process : result.report.processes)
    EXPECT_EQ(process.name, "cie_bench");
  for (const auto& thread : result.report.threads)
    EXPECT_EQ(thread.name, "cie_bench") << thread.tid;
}

// An executor inside rclcpp told of each instance in this project's events, and rclcpp in its own.
// Numbers of cie:callback_start by callback_id, as babeltrace2 counts them.
TEST(Ros2Recordings, WhatTwoProvidersTellCountsOnce) {
  const std::map<std::string, std::uint64_t> started{
      {"/car/sensor@Timer(20000000)", 191},
      {"/car/sensor@Timer(50000000)", 77},
      {"/car/fusion@Subscription(/car/lidar)", 191},
      {"/car/fusion@Subscription(/car/camera)", 77},
      {"/car/fusion@Timer(200000000)", 20},
      {"/car/plan@Subscription(/car/fused)", 191},
      {"/car/plan@Service(/car/enable)", 39},
      {"/car/plan@Client(/car/enable)", 39},
      {"/car/plan@Timer(100000000)", 39},
  };
  const std::vector<fs::path> paths{kOwn / "both_providers"};
  const auto result = analyze(paths, {});
  std::map<std::string, std::uint64_t> seen;
  for (const auto& callback : result.report.callbacks)
    seen[callback.logical_id] += callback.instances + callback.incomplete;
  EXPECT_EQ(seen, started);
  EXPECT_FALSE(result.report.chains.empty());  // through what only rclcpp's events tell
}

// The same executor without rclcpp's events beside its own. R1 and R2 fail by the machine's load.
TEST(Ros2Recordings, ASecondProviderMakesNoVerdictWorse) {
  const std::vector<fs::path> both{kOwn / "both_providers"};
  const std::vector<fs::path> one{kOwn / "rclcpp_with_cie_events"};
  const auto result = analyze(both, {});
  const auto reference = analyze(one, {});
  for (const auto& rule : reference.verdicts.rules) {
    if (rule.id == "R1" || rule.id == "R2") continue;
    EXPECT_EQ(verdict(result, rule.id), rule.verdict) << rule.id;
  }
}

TEST(Ros2Recordings, OthersGiveTheFiguresThatOthersComputed) {
  const auto folders = recordings(std::getenv("CIE_TRACES"));
  if (folders.empty()) {
    GTEST_SKIP() << "not possible here: CIE_TRACES names no folder with recordings of ROS 2";
  }
  for (const auto& folder : folders)
    check_recording(folder);
}

}  // namespace
}  // namespace cie::analysis
