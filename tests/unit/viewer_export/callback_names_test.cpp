#include "words/callback_names.hpp"

#include "sample_report.hpp"

#include <cstdint>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

constexpr TextStyle kAscii{};
constexpr TextStyle kSymbols{.unicode = true};

std::string name_of(const std::string& id, const TextStyle& style = kSymbols) {
  return CallbackNames({id}, style).of_id(id);
}

TEST(CallbackNames, SayTheNodeAndWhatItRunsFor) {
  EXPECT_EQ(name_of("/planning/planner@Timer(100000000)"), "planner timer 100 ms");
  EXPECT_EQ(name_of("/planning/planner@Subscription(/pose)"), "planner ← /pose");
  EXPECT_EQ(name_of("/car/cruise@Service(/car/limit)"), "cruise ⇐ /car/limit");
  EXPECT_EQ(name_of("/car/cruise@Client(/add)"), "cruise client /add");
  EXPECT_EQ(name_of("/car/cruise@Waitable(guard)"), "cruise Waitable guard");
  EXPECT_EQ(name_of("/a/plan@Timer(watchdog)"), "plan timer watchdog");
  EXPECT_EQ(name_of("/a/track@Subscription(/t0)#2"), "track ← /t0 #2");
}

TEST(CallbackNames, AreAsciiWhereThereAreNoSymbols) {
  EXPECT_EQ(name_of("/planner@Subscription(/pose)", kAscii), "planner <- /pose");
  EXPECT_EQ(name_of("/cruise@Service(/limit)", kAscii), "cruise <= /limit");
}

TEST(CallbackNames, SayPeriodsByFourDigits) {
  EXPECT_EQ(name_of("/n@Timer(1)"), "n timer 1 ns");
  EXPECT_EQ(name_of("/n@Timer(20000)"), "n timer 20 us");
  EXPECT_EQ(name_of("/n@Timer(33333333)"), "n timer 33.33 ms");
  EXPECT_EQ(name_of("/n@Timer(1500000000)"), "n timer 1.5 s");
  EXPECT_EQ(name_of("/n@Timer(3600000000000)"), "n timer 3600 s");
  EXPECT_EQ(name_of("/n@Timer(99999999999999999999)"), "n timer 99999999999999999999");
}

TEST(CallbackNames, SayTheNodeOnlyOnce) {
  EXPECT_EQ(name_of("/car/plan@Service(/car/plan/get_parameters)"), "plan ⇐ ~/get_parameters");
  EXPECT_EQ(name_of("/car/plan@Service(/car/planner/get)"), "plan ⇐ /car/planner/get");
}

TEST(CallbackNames, HaveAsMuchOfTheNamespaceAsTellsNodesApart) {
  const std::vector<std::string> ids{"/a/x/plan@Timer(1)", "/b/x/plan@Timer(1)",
                                     "/a/x/drive@Timer(1)", "/plan@Timer(1)"};
  const CallbackNames names(ids, kSymbols);
  EXPECT_EQ(names.of_id(ids[0]), "a/x/plan timer 1 ns");
  EXPECT_EQ(names.of_id(ids[1]), "b/x/plan timer 1 ns");
  EXPECT_EQ(names.of_id(ids[2]), "drive timer 1 ns");
  EXPECT_EQ(names.of_id(ids[3]), "/plan timer 1 ns");
}

TEST(CallbackNames, AreIdsWhereTheyWouldBeTheSame) {
  const std::vector<std::string> ids{"/n@Timer(33333333)", "/n@Timer(33333334)"};
  const CallbackNames names(ids, kSymbols);
  EXPECT_EQ(names.of_id(ids[0]), ids[0]);
  EXPECT_EQ(names.of_id(ids[1]), ids[1]);
}

TEST(CallbackNames, AreIdsWhereTheyAreNoneOrAskedFor) {
  for (const char* odd :
       {"", "odd", "@Timer(1)", "/n@Timer", "/n@Timer)1(", "/n@Timer(1)x", "/n@Timer(1)#"})
    EXPECT_EQ(name_of(odd), odd);
  EXPECT_EQ(name_of("/n@Timer(1)", {.ids = true}), "/n@Timer(1)");
  EXPECT_EQ(CallbackNames(std::vector<std::string>{}, kSymbols).of_id("/n@Timer(1)"), "/n@Timer(1)")
      << "of another recording";
}

// By host and pid.
analysis::Report of_processes(const std::vector<std::pair<std::string, std::int64_t>>& processes) {
  analysis::Report report;
  for (std::uint32_t i = 0; i < processes.size(); ++i) {
    auto& process = report.processes.emplace_back();
    process.index = analysis::ProcessIndex{i};
    std::tie(process.host, process.pid) = processes[i];
    auto callback = test::callback("/n@Timer(1000)", CallbackKind::timer);
    callback.index = analysis::CallbackIndex{i};
    callback.process = analysis::ProcessIndex{i};
    report.callbacks.push_back(callback);
  }
  return report;
}

std::vector<std::string> names_in(const analysis::Report& report) {
  const CallbackNames names(report, kSymbols);
  std::vector<std::string> all;
  for (const auto& callback : report.callbacks)
    all.push_back(names.of(callback));
  return all;
}

TEST(CallbackNames, HavePidAndHostOnlyWhereNamesRepeat) {
  using All = std::vector<std::string>;
  auto report = of_processes({{"a", 1}, {"a", 2}});
  EXPECT_EQ(names_in(report), (All{"n timer 1 us (pid 1)", "n timer 1 us (pid 2)"}));
  report.callbacks[1].logical_id = "/n@Timer(2000)";
  EXPECT_EQ(names_in(report), (All{"n timer 1 us", "n timer 2 us"}));
  EXPECT_EQ(names_in(of_processes({{"a", 1}, {"b", 1}})),
            (All{"n timer 1 us on a", "n timer 1 us on b"}));
  EXPECT_EQ(
      names_in(of_processes({{"a", 1}, {"b", 1}, {"b", 2}})),
      (All{"n timer 1 us (pid 1 on a)", "n timer 1 us (pid 1 on b)", "n timer 1 us (pid 2 on b)"}));
}

// One executed the other, or the pid was used again.
TEST(CallbackNames, TellWhichProcessOfOnePidTheyAreOf) {
  using All = std::vector<std::string>;
  auto report = of_processes({{"a", 1}, {"a", 1}, {"a", 2}});
  report.processes[0].program = 1;
  report.processes[1].program = 2;
  EXPECT_EQ(names_in(report), (All{"n timer 1 us (pid 1, program 1)",
                                   "n timer 1 us (pid 1, program 2)", "n timer 1 us (pid 2)"}));
  report.callbacks[1].logical_id = report.callbacks[2].logical_id = "/n@Timer(2000)";
  EXPECT_EQ(names_in(report),
            (All{"n timer 1 us", "n timer 2 us (pid 1, program 2)", "n timer 2 us (pid 2)"}));
}

// Of one process, one after the other.
TEST(CallbackNames, TellWhichLifeOfACallbackTheyAreOf) {
  using All = std::vector<std::string>;
  auto report = of_processes({{"a", 1}, {"a", 2}});
  report.callbacks.push_back(report.callbacks[0]);
  report.callbacks[2].index = analysis::CallbackIndex{2};
  report.callbacks[2].lifetime = 2;
  EXPECT_EQ(names_in(report), (All{"n timer 1 us (pid 1)", "n timer 1 us (pid 2)",
                                   "n timer 1 us (lifetime 2) (pid 1)"}));
  report.callbacks.erase(report.callbacks.begin() + 1);
  EXPECT_EQ(names_in(report), (All{"n timer 1 us", "n timer 1 us (lifetime 2)"}));
  report.callbacks.erase(report.callbacks.begin());
  EXPECT_EQ(names_in(report), (All{"n timer 1 us (lifetime 2)"})) << "the first one is not shown";
}

TEST(CallbackNames, HaveAPeriodBesideTheNameOfATimer) {
  using All = std::vector<std::string>;
  auto report = of_processes({{"a", 1}, {"a", 2}});
  report.callbacks[0].logical_id = "/n@Timer(tick)";
  report.callbacks[0].period_ns = 100'000'000;
  report.callbacks[1].logical_id = "/n@Timer(once)#2";
  report.callbacks[1].period_ns = std::nullopt;
  EXPECT_EQ(names_in(report), (All{"n timer tick 100 ms", "n timer once #2"}));
  report.callbacks[1] = report.callbacks[0];
  report.callbacks[1].process = analysis::ProcessIndex{1};
  report.callbacks[1].index = analysis::CallbackIndex{1};
  EXPECT_EQ(names_in(report), (All{"n timer tick 100 ms (pid 1)", "n timer tick 100 ms (pid 2)"}));
  report.callbacks[1].period_ns = 50'000'000;
  EXPECT_EQ(names_in(report), (All{"n timer tick (pid 1)", "n timer tick (pid 2)"}));
}

TEST(CallbackNames, OfChainsNameTheirEndsAsFarAsThatTellsThemApart) {
  auto report = of_processes({{"a", 1}});
  const auto add = [&report](std::vector<std::string> hops) {
    for (const auto& hop : hops) {
      auto callback = test::callback(hop, CallbackKind::timer);
      callback.index = analysis::CallbackIndex{static_cast<std::uint32_t>(report.callbacks.size())};
      report.callbacks.push_back(callback);
    }
    analysis::ChainReport chain;
    for (const auto& hop : hops)
      chain.name += (chain.name.empty() ? "" : " -> ") + hop;
    chain.hops = std::move(hops);
    report.chains.push_back(chain);
  };
  const auto named = [&report](std::size_t i) {
    return CallbackNames(report, kSymbols).of(report.chains[i]);
  };
  add({"/x/a@Timer(1)", "/x/b@Subscription(/t)"});
  EXPECT_EQ(named(0), "a → b");
  report.callbacks.push_back(test::callback("/x/b@Service(/set)", CallbackKind::service));
  EXPECT_EQ(named(0), "a timer 1 ns → b ← /t") << "b has another callback";
  report.callbacks.pop_back();
  add({"/x/a@Timer(2)", "/x/b@Subscription(/t)"});
  EXPECT_EQ(named(0), "a timer 1 ns → b ← /t");
  EXPECT_EQ(named(1), "a timer 2 ns → b ← /t");
  add({"/x/a@Timer(2)", "/x/c@Subscription(/u)", "/x/b@Subscription(/t)"});
  EXPECT_EQ(named(2), "a timer 2 ns → b ← /t #2");
  report.chains[0].name = "braking";
  EXPECT_EQ(named(0), "braking");
}

TEST(CallbackNames, SayThatACallbackWasNeverRegistered) {
  EXPECT_EQ(CallbackNames({"?2"}, kSymbols).of_id("?2"), "unknown callback 2");
  EXPECT_EQ(CallbackNames({"?x"}, kSymbols).of_id("?x"), "?x");
}

TEST(CallbackNames, StandInSentences) {
  const CallbackNames names({"/a/plan@Timer(20000000)", "/b@Subscription(/t)#2"}, kSymbols);
  EXPECT_EQ(names.in_words("started /a/plan@Timer(20000000), instance 0"),
            "started plan timer 20 ms, instance 0");
  EXPECT_EQ(names.in_words("(/b@Subscription(/t)#2) and /b@Subscription(/t)"),
            "(b ← /t #2) and /b@Subscription(/t)");
  EXPECT_EQ(names.in_words("no/a/plan@Timer(20000000) \x1b"), "no/a/plan@Timer(20000000) \\x1b");
}

TEST(CallbackNames, LeaveQuotedIdsAsASpecHasThem) {
  const CallbackNames names({"/a/plan@Timer(20000000)"}, kSymbols);
  const std::string sentence = "no entry; did you mean \"/a/plan@Timer(20000000)\"?";
  EXPECT_EQ(names.in_words(sentence), sentence);
}

TEST(CallbackNames, AreSafeToPrint) {
  EXPECT_EQ(name_of("/n\x1b@Timer(1\x07)"), "n\\x1b timer 1\\x07");
  EXPECT_EQ(name_of("\x1b"), "\\x1b");
}

}  // namespace
}  // namespace cie::viewer_export
