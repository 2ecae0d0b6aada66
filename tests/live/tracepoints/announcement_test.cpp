// What a session sees of a process that runs already, and of one that forks: driven by the `lttng`
// command, as a user without cie-record would.
#include "live/record/sandbox.hpp"
#include "live/record/trace_text.hpp"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

namespace cie::test {
namespace {

namespace fs = std::filesystem;

const std::set<std::string> kStateEvents{"run_begin",      "node_init",   "group_init",
                                         "callback_init",  "thread_init", "thread_sched",
                                         "publisher_init", "clock_sync"};

class Announcement : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!sandbox_.skip_reason().empty()) GTEST_SKIP() << sandbox_.skip_reason();
    daemon_.emplace_back(sandbox_.start({"lttng-sessiond", "--no-kernel"}));
    ASSERT_TRUE(eventually([this] { return sandbox_.run({"lttng", "list"}).status == 0; }));
  }

  void TearDown() override {
    if (!daemon_.empty()) {
      daemon_.front().signal(SIGTERM);
      daemon_.front().wait();
    }
  }

  fs::path path(const std::string& name) const { return sandbox_.directory() / name; }

  void lttng(std::vector<std::string> words) {
    words.insert(words.begin(), "lttng");
    const Finished result = sandbox_.run(words);
    ASSERT_EQ(result.status, 0) << result.out << result.err;
  }

  // Hot events and state events in a channel each, as tracepoints/docs/recording.md advises.
  void create(const std::string& session, const std::vector<std::string>& options = {}) {
    std::vector<std::string> words{"create", session, "--output", path(session)};
    words.insert(words.end(), options.begin(), options.end());
    lttng(words);
    lttng({"enable-channel", "-u", "-s", session, "state", "--subbuf-size=64k"});
    lttng({"enable-channel", "-u", "-s", session, "hot", "--subbuf-size=4k", "--num-subbuf=2"});
    for (const char* channel : {"state", "hot"}) {
      lttng({"add-context", "-u", "-s", session, "-c", channel, "-t", "vpid", "-t", "vtid"});
    }
  }

  void enable_events(const std::string& session) {
    std::string state;
    for (const std::string& name : kStateEvents) {
      state += (state.empty() ? "cie:" : ",cie:") + name;
    }
    lttng({"enable-event", "-u", "-s", session, "-c", "state", state});
    lttng({"enable-event", "-u", "-s", session, "-c", "hot",
           "cie:callback_*,cie:publish,cie:sample_lost"});
  }

  void start_application(const std::vector<std::string>& prefix = {}) {
    std::vector<std::string> command = prefix;
    command.insert(command.end(),
                   {CIE_TRACED_APP, "--until-signal", "--ready", path("pid"), "--lost", "3"});
    application_.emplace_back(sandbox_.start(command));
    ASSERT_TRUE(eventually([this] { return fs::exists(path("pid")); }));
  }

  void stop_application() {
    application_.front().signal(SIGTERM);
    application_.front().wait();
  }

  // How often the application's threads of a name have gone to sleep.
  std::int64_t sleeps(const std::string& name) const {
    return sleeps_of(static_cast<pid_t>(std::stoi(read_file(path("pid")))), name);
  }

  // The contract: complete within a second, on a machine with time for it. The thread that
  // announces looks around at least every second, and tells what is new before it sleeps again.
  void wait_until_announced() const {
    const std::int64_t before = sleeps("cie-announce");
    usleep(1'000'000);
    ASSERT_TRUE(eventually([&] { return sleeps("cie-announce") >= before + 2; }));
  }

  static void expect_announced(const TextTrace& trace) {
    ASSERT_FALSE(trace.events.empty());
    std::set<std::string> missing = kStateEvents;
    for (const TextEvent& event : trace.events) {
      missing.erase(event.name);
    }
    ASSERT_EQ(missing, std::set<std::string>{});
    EXPECT_EQ(trace.all("run_begin").front().label("moment"), "announce");
  }

  Sandbox sandbox_{User::current};
  std::vector<Running> daemon_;       // at most one
  std::vector<Running> application_;  // at most one
};

TEST_F(Announcement, FollowsEverySessionStartAlsoWhileAnotherIsActive) {
  start_application();
  for (const char* session : {"first", "second", "third"}) {
    create(session);
    enable_events(session);
    lttng({"start", session});
    wait_until_announced();
  }
  lttng({"destroy", "--all"});
  stop_application();
  for (const char* session : {"first", "second", "third"}) {
    SCOPED_TRACE(session);
    expect_announced(read_trace(path(session)));
  }
}

// The samples were lost before the session.
TEST_F(Announcement, TellsWhatWasLostBefore) {
  start_application();
  create("late");
  enable_events("late");
  lttng({"start", "late"});
  wait_until_announced();
  lttng({"destroy", "late"});
  stop_application();
  const TextTrace trace = read_trace(path("late"));
  const auto lost = trace.all("sample_lost");
  ASSERT_EQ(lost.size(), 1U) << "of the subscription; the timer lost none";
  EXPECT_EQ(lost.front().integer("count"), 0);
  EXPECT_EQ(lost.front().integer("total"), 3);
}

TEST_F(Announcement, FollowsEventsEnabledInARunningSession) {
  start_application();
  create("late");
  lttng({"start", "late"});
  wait_until_announced();
  enable_events("late");
  wait_until_announced();
  lttng({"destroy", "late"});
  stop_application();
  expect_announced(read_trace(path("late")));
}

TEST_F(Announcement, SurvivesInASnapshotLongAfterTheHotEventsOfThatTimeAreGone) {
  start_application();
  create("flight", {"--snapshot"});
  enable_events("flight");
  lttng({"start", "flight"});
  wait_until_announced();
  // An instance sleeps once: so many turn the 8 KiB of "hot" of every CPU over many times.
  const std::int64_t enough = 1000 * sysconf(_SC_NPROCESSORS_ONLN);
  const std::int64_t before = sleeps("live_traced_app");
  ASSERT_TRUE(eventually([&] { return sleeps("live_traced_app") > before + enough; }));
  lttng({"snapshot", "record", "-s", "flight"});
  lttng({"destroy", "flight"});
  stop_application();
  const TextTrace trace = read_trace(path("flight"));
  expect_announced(trace);
  // Of the two callbacks' starts since the announcement most are overwritten.
  const std::vector<TextEvent> starts = trace.all("callback_start");
  ASSERT_FALSE(starts.empty());
  const std::int64_t instances =
      starts.back().integer("seq") - trace.all("callback_init").front().integer("next_seq");
  EXPECT_LT(static_cast<std::int64_t>(starts.size()), instances);
}

TEST_F(Announcement, IsRepeatedOnRequestInEveryChunkOfARotatedSession) {
  start_application();
  create("rotated");
  enable_events("rotated");
  lttng({"start", "rotated"});
  wait_until_announced();
  lttng({"rotate", "rotated"});
  lttng({"regenerate", "statedump", "-s", "rotated"});
  wait_until_announced();
  lttng({"rotate", "rotated"});
  lttng({"destroy", "rotated"});
  stop_application();
  // Chunk 2, of what came after the second rotation, was not asked for.
  int chunks = 0;
  for (const fs::directory_entry& chunk : fs::directory_iterator(path("rotated") / "archives")) {
    SCOPED_TRACE(chunk.path());
    const TextTrace trace = read_trace(chunk.path());
    EXPECT_FALSE(trace.all("callback_start").empty());
    if (!chunk.path().string().ends_with("-2")) {
      ++chunks;
      expect_announced(trace);
    }
  }
  EXPECT_EQ(chunks, 2);
}

TEST_F(Announcement, ComesFromAnOrdinaryThreadThatBlocksAllSignals) {
  if (geteuid() == 0) {
    start_application({"chrt", "--fifo", "50"});  // what the thread must not inherit
  } else {
    start_application();
  }
  const fs::path tasks =
      fs::path("/proc") / std::to_string(std::stoi(read_file(path("pid")))) / "task";
  fs::path thread;
  ASSERT_TRUE(eventually([&] {
    for (const fs::directory_entry& task : fs::directory_iterator(tasks)) {
      if (read_file(task.path() / "comm") == "cie-announce\n") {
        thread = task.path();
      }
    }
    return !thread.empty();
  }));
  std::istringstream stat(read_file(thread / "stat"));
  std::vector<std::string> fields;
  for (std::string field; stat >> field;) {
    fields.push_back(field);
  }
  EXPECT_EQ(fields.at(18), "10") << "nice";
  EXPECT_EQ(fields.at(40), "0") << "SCHED_OTHER";
  const std::string status = read_file(thread / "status");
  const std::size_t blocked = status.find("SigBlk:\t") + 8;
  // All but SIGKILL (9), SIGSTOP (19) and the C library's own 32 and 33.
  EXPECT_EQ(status.substr(blocked, 16), "fffffffe7ffbfeff");
  stop_application();
}

TEST_F(Announcement, IsNotMadeByAChildThatOnlyInheritedTheObjects) {
  create("forked");
  lttng({"enable-event", "-u", "-s", "forked", "-c", "state", "cie:*"});
  lttng({"start", "forked"});
  setenv("LTTNG_UST_REGISTER_TIMEOUT", "-1", 1);
  const Finished result =
      sandbox_.run({"timeout", "20", CIE_TRACED_APP, "--fork", "--instances", "3"});
  lttng({"destroy", "forked"});
  EXPECT_EQ(result.status, 0);
  const TextTrace trace = read_trace(path("forked"));
  for (const char* event : {"callback_start", "callback_end"})
    EXPECT_EQ(trace.all(event).size(), 3U + 3U)
        << event;  // of both callbacks, and none in the child
  for (const char* event : {"thread_wakeup", "publish", "callback_release"})
    EXPECT_EQ(trace.all(event).size(), 3U) << event;
  EXPECT_EQ(trace.all("callback_fini").size(), 2U);
  EXPECT_EQ(trace.all("run_end").size(), 1U);
  EXPECT_EQ(trace.events.back().name, "run_end");
  EXPECT_EQ(trace.events.at(trace.events.size() - 2).name, "clock_sync")
      << "that CLOCK_REALTIME was not set since the last one";
}

}  // namespace
}  // namespace cie::test
