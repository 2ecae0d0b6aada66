#include "session_states.hpp"

#include <chrono>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace cie::live {
namespace {

using namespace std::chrono_literals;
using analysis::LiveSession;

constexpr SessionStates::Clock::time_point kFollowed{1h};

LiveSession session(const std::string& host, const std::string& name) {
  return {.url = "net://relay/host/" + host + '/' + name, .host = host, .name = name};
}

const LiveSession kFirstSession = session("robot", "first");
const LiveSession kSecondSession = session("robot", "second");

analysis::ProcessReport process(std::uint32_t trace, bool has_ended) {
  analysis::ProcessReport report;
  report.host = "robot";
  report.has_ended = has_ended;
  report.traces = {trace};
  return report;
}

std::map<std::string, SourceState> states_of(const std::vector<HostView>& hosts) {
  std::map<std::string, SourceState> states;
  for (const auto& host : hosts)
    states[host.session] = host.state;
  return states;
}

// Two sessions of one machine that are read, of one trace each.
class TwoSessions : public testing::Test {
 protected:
  TwoSessions() {
    states_.found({kFirstSession, kSecondSession}, kFollowed);
    for (const std::size_t i : {0U, 1U}) {
      states_.connected(i);
      states_.followed(i, true, kFollowed);
      states_.read(i, {static_cast<std::uint32_t>(i)});
    }
  }
  std::vector<HostView> hosts(std::vector<analysis::ProcessReport> processes,
                              SessionStates::Clock::time_point now = kFollowed + 2s) {
    analysis::Report report;
    report.processes = std::move(processes);
    return states_.hosts(report, now);
  }
  SessionStates states_;
};

TEST_F(TwoSessions, OneThatEndsIsShownBesideTheOther) {
  states_.ended(0, kFollowed + 1s);
  EXPECT_EQ(states_of(hosts({})),
            (std::map<std::string, SourceState>{{"first", SourceState::ended},
                                                {"second", SourceState::streaming}}));
  EXPECT_FALSE(states_.is_over());
  states_.ended(1, kFollowed + 2s);
  EXPECT_TRUE(states_.is_over());
}

TEST_F(TwoSessions, OneThatEndedIsNotShownWhenItsMachineBeginsAnother) {
  states_.ended(0, kFollowed + 1s);
  const auto third = session("robot", "third");
  states_.found({kSecondSession, third}, kFollowed + 2s);
  EXPECT_EQ(states_of(hosts({})),
            (std::map<std::string, SourceState>{{"second", SourceState::streaming},
                                                {"third", SourceState::waiting}}));
}

TEST_F(TwoSessions, IsCutOffWhereItsOwnProcessesHaveNotEnded) {
  states_.ended(0, kFollowed + 1s);
  EXPECT_EQ(hosts({process(0, true), process(1, false)}).front().message, "");
  EXPECT_EQ(hosts({process(0, false), process(1, false)}).front().message,
            "its processes had not ended: cut off, or switched off");
  EXPECT_EQ(hosts({process(0, true), process(1, false)}).front().message, "") << "it is not kept";
}

TEST_F(TwoSessions, OfWhatNeverTellsOfItsEndNothingIsSaid) {
  states_.ended(0, kFollowed + 1s);
  auto of_ros2 = process(0, false);
  of_ros2.tracetools = "4.1.1";
  EXPECT_EQ(hosts({of_ros2}).front().message, "");
}

TEST_F(TwoSessions, AreSilentAfterThreeSeconds) {
  EXPECT_EQ(hosts({}, kFollowed + 3s).front().state, SourceState::streaming);
  const auto later = hosts({}, kFollowed + 3001ms).front();
  EXPECT_EQ(later.state, SourceState::silent);
  EXPECT_EQ(later.silent_ns, 3'001'000'000);
}

// One session, whose relay daemon went away and is back without it.
class Lost : public testing::Test {
 protected:
  void lose(bool is_followed = true) {
    states_.found({kFirstSession}, kFollowed);
    states_.connected(0);
    if (is_followed) states_.followed(0, false, kFollowed);
    for (const auto at : {1s, 2s, 3s})
      states_.lost(0, "no relay daemon answers", kFollowed + at);
    states_.found({}, kBack);
  }
  static constexpr auto kBack = kFollowed + 4s;
  SessionStates states_;
};

TEST_F(Lost, IsWaitedForUntilItsRecorderMayHaveFoundTheRelayDaemon) {
  lose();
  states_.found({}, kBack + SessionStates::kGrace - 1ms);
  EXPECT_FALSE(states_.is_over());
  EXPECT_EQ(states_.why_lost(), "the relay daemon does not have it any more");
  states_.found({}, kBack + SessionStates::kGrace);
  EXPECT_TRUE(states_.is_over());
  EXPECT_FALSE(states_.why_lost());
}

TEST_F(Lost, IsOverWhenItsMachineHasANewOne) {
  lose();
  states_.found({kSecondSession}, kBack + 2s);
  EXPECT_TRUE(states_.is_over(0));
  EXPECT_FALSE(states_.is_over()) << "the new one is followed";
  EXPECT_EQ(states_of(states_.hosts({}, kBack + 3s)),
            (std::map<std::string, SourceState>{{"second", SourceState::waiting}}));
}

TEST_F(Lost, IsWaitedForThoughAnotherMachineIsBack) {
  lose();
  states_.found({session("desk", "other")}, kBack + 2s);
  EXPECT_FALSE(states_.is_over(0));
}

TEST_F(Lost, IsNotWaitedForWhereItNeverCouldBeFollowed) {
  lose(false);
  EXPECT_TRUE(states_.is_over());
}

TEST_F(Lost, IsTriedAgainWhenItIsThereAgain) {
  lose();
  EXPECT_FALSE(states_.is_there(0));
  states_.found({kFirstSession}, kBack + 1s);
  EXPECT_TRUE(states_.is_there(0));
  states_.connected(0);
  EXPECT_FALSE(states_.why_lost());
  EXPECT_EQ(states_.hosts({}, kBack + 2s).front().silent_ns, 6'000'000'000) << "no event came yet";
}

TEST_F(TwoSessions, AreLostWhereNoneIsReadAnyMore) {
  states_.lost(0, "has a reader", kFollowed + 1s);
  EXPECT_FALSE(states_.why_lost()) << "the second one is read";
  states_.ended(1, kFollowed + 2s);
  EXPECT_EQ(states_.why_lost(), "has a reader");
}

}  // namespace
}  // namespace cie::live
