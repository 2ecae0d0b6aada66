// cie-record with a real session daemon: what cannot be recorded, and how it says so.
#include "recording.hpp"

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <unistd.h>

namespace cie::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

class FailingRecord : public Record {
 protected:
  // LTTng's daemon of that name that the process started.
  pid_t daemon_of(pid_t parent, const std::string& name) {
    const Finished found = sandbox_.run({"pgrep", "-x", name, "-P", std::to_string(parent)});
    if (found.out.empty()) throw std::runtime_error("no " + name + " runs");
    return static_cast<pid_t>(std::stoi(found.out));
  }
};

TEST_P(FailingRecord, SaysThatTheSessionDaemonWentAwayAtTheEnd) {
  const Finished result = sandbox_.run({"env", "LD_PRELOAD=" CIE_LOST_DAEMON, CIE_RECORD, "-o",
                                        "rec", "--", CIE_TRACED_APP, "--instances", "10"});
  EXPECT_EQ(result.status, 4);
  EXPECT_THAT(result.err, HasSubstr("went away while it finished the session"));
}

TEST_P(FailingRecord, SaysWhenTheSessionDaemonDiedAndWhatWasWrittenCanBeRead) {
  Running recorder = sandbox_.start(recording(
      "rec", {"--until-signal", "--ready", path("pid").string()}, {"--flush-interval", "100"}));
  const pid_t application = wait_until_ready("pid");
  wait_until_recorded("rec");
  const pid_t daemon = daemon_of(recorder.pid(), "lttng-sessiond");
  kill(daemon_of(daemon, "lttng-consumerd"), SIGKILL);
  kill(daemon, SIGKILL);
  const std::string message = "the session daemon ended: nothing more is recorded";
  EXPECT_TRUE(eventually([&] { return recorder.err().find(message) != std::string::npos; }));
  kill(application, SIGTERM);
  const Finished result = recorder.wait();
  EXPECT_EQ(result.status, 4);
  EXPECT_THAT(result.err, HasSubstr("the session daemon ended during the recording"));
  EXPECT_EQ(manifest("rec")["problems"].size(), 1U);

  const TextTrace trace = read_trace(path("rec"));
  EXPECT_TRUE(trace.is_readable);
  expect_all_state(trace, "start");
  EXPECT_GE(starts_of(trace, 0).size(), 10U);
}

TEST_P(FailingRecord, SaysAtOnceWhenTheConsumerDaemonDied) {
  Running recorder = sandbox_.start(recording(
      "rec", {"--until-signal", "--ready", path("pid").string()}, {"--flush-interval", "100"}));
  const pid_t application = wait_until_ready("pid");
  wait_until_recorded("rec");
  kill(daemon_of(daemon_of(recorder.pid(), "lttng-sessiond"), "lttng-consumerd"), SIGKILL);
  const std::string message =
      "the consumer daemon ended: nothing more is recorded; end the command";
  EXPECT_TRUE(eventually([&] { return recorder.err().find(message) != std::string::npos; }));
  kill(application, SIGTERM);
  const Finished result = recorder.wait();
  EXPECT_EQ(result.status, 4);
  EXPECT_THAT(manifest("rec")["problems"][0].get<std::string>(),
              HasSubstr("the consumer daemon ended during the recording"));
}

TEST_P(FailingRecord, RefusesWhatItCannotDoInOneSentence) {
  struct Case {
    std::vector<std::string> arguments;
    int status;
    std::string message;
  };
  const std::vector<Case> cases{
      {{"--attch"}, 2, "--attch"},
      {{}, 2, "nothing to record"},
      {{"--attach", "--", "true"}, 2, "takes no command"},
      {{"--duration", "1", "--", "true"}, 2, "--attach"},
      {{"--snapshot", "--", "true"}, 2, "--snapshot"},
      {{"--live", "tcp://localhost:0", "--", "true"}, 2, "--to"},
      {{"-o", "rec", "--to", "127.0.0.1:1", "--", "true"},
       4,
       "no relay daemon answers at 127.0.0.1:1"},
      {{"-o", "rec", "--to", "no host", "--", "true"}, 2, "HOST:PORT"},
      {{"--subbuf-size", "5000", "--", "true"}, 2, "power of two"},
      {{"-o", "rec", "--", "/no/such/program"}, 4, "cannot run \"/no/such/program\""},
      {{"-o", "/proc/rec", "--", "true"}, 4, "cannot create \"/proc/rec\""},
  };
  for (const Case& entry : cases) {
    std::vector<std::string> command{CIE_RECORD};
    command.insert(command.end(), entry.arguments.begin(), entry.arguments.end());
    const Finished result = sandbox_.run(command);
    EXPECT_EQ(result.status, entry.status) << result.err;
    EXPECT_THAT(result.err, HasSubstr(entry.message));
    const bool is_usage = entry.status == 2;
    EXPECT_EQ(std::ranges::count(result.err, '\n'), is_usage ? 2 : 1) << result.err;
    EXPECT_EQ(result.err.ends_with("\nTry: cie record --help\n"), is_usage) << result.err;
  }
  EXPECT_FALSE(fs::exists(path("rec"))) << "a command that cannot run leaves nothing behind";
}

TEST_P(FailingRecord, NeverOverwrites) {
  ASSERT_EQ(sandbox_.run(recording("rec", {"--instances", "5"})).status, 0);
  const std::string before = read_file(path("rec/manifest.json"));
  const Finished result = sandbox_.run(recording("rec", {"--instances", "5"}));
  EXPECT_EQ(result.status, 2);
  EXPECT_THAT(result.err, HasSubstr("exists already"));
  EXPECT_EQ(read_file(path("rec/manifest.json")), before);
}

TEST_P(FailingRecord, GoesOnWhenItsMessagesCannotBeWritten) {
  std::vector<std::string> command{"sh", "-c", "exec \"$@\" 2>/dev/full", "sh"};
  std::ranges::copy(recording("rec", {"--instances", "5"}), std::back_inserter(command));
  EXPECT_EQ(sandbox_.run(command).status, 0);
  EXPECT_TRUE(manifest("rec")["problems"].empty());
}

TEST_P(FailingRecord, FailsWhenNothingRegistered) {
  const Finished result = sandbox_.run(
      {CIE_RECORD, "-o", "rec", "--registration-timeout", "0.1", "--", "sleep", "1.5"});
  EXPECT_EQ(result.status, 4);
  EXPECT_THAT(result.err, HasSubstr("no traced application has registered yet"));
  EXPECT_THAT(result.err, HasSubstr("nothing was recorded"));
}

// Between two looks of the recorder's, before it would ask where everybody is.
TEST_P(FailingRecord, MissesNobodyWhoCameAndWent) {
  const Finished result =
      sandbox_.run({CIE_RECORD, "-o", "rec", "--registration-timeout", "3", "--", "sh", "-c",
                    "\"$@\"; sleep 4", "sh", CIE_TRACED_APP, "--instances", "5"});
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.err, Not(HasSubstr("has registered yet")));
  EXPECT_EQ(manifest("rec")["processes"].size(), 1U);
}

TEST_P(FailingRecord, SaysThatTheKernelRefusesADeadlineThreadOthers) {
  const auto under_deadline = [&](const std::string& out, const std::vector<std::string>& options) {
    std::vector<std::string> command{CIE_RECORD, "-o", out,   "--registration-timeout",
                                     "0.1",      "--", "chrt"};
    std::ranges::copy(options, std::back_inserter(command));
    for (const auto* word :
         {"-d", "-T", "1000000", "-D", "10000000", "-P", "10000000", "0", "sleep", "1.5"})
      command.emplace_back(word);
    return sandbox_.run(command);
  };
  const Finished result = under_deadline("rec", {});
  if (result.err.find("failed to set") != std::string::npos) {
    GTEST_SKIP() << "not possible here: needs SCHED_DEADLINE: " << result.err;
  }
  EXPECT_THAT(result.err, HasSubstr("runs under SCHED_DEADLINE"));
  EXPECT_THAT(under_deadline("other", {"-R"}).err,
              HasSubstr("no traced application has registered yet"));
}

TEST_P(FailingRecord, SaysWhenTheDiskWasFull) {
  if (geteuid() != 0) {
    GTEST_SKIP() << "not possible here: needs root to mount a small file system";
  }
  fs::create_directory(path("small"));
  ASSERT_EQ(mount("none", path("small").c_str(), "tmpfs", 0, "size=256k,mode=777"), 0);
  const Finished result =
      sandbox_.run(recording("small/rec", {"--burst", "200000", "--instances", "0"}));
  umount2(path("small").c_str(), MNT_DETACH);
  EXPECT_EQ(result.status, 4) << result.err;
  EXPECT_THAT(result.err, HasSubstr("THE RECORDING FAILED"));
}

// The chunks before are as they were.
TEST_P(FailingRecord, SaysWhenTheDiskWasFullWhileItRecordedInChunks) {
  if (geteuid() != 0) {
    GTEST_SKIP() << "not possible here: needs root to mount a small file system";
  }
  fs::create_directory(path("small"));
  ASSERT_EQ(mount("none", path("small").c_str(), "tmpfs", 0, "size=8m,mode=777"), 0);
  Running recorder = sandbox_.start({CIE_RECORD, "-o", "small/rec", "--kernel=no", "--rotate", "1",
                                     "--", CIE_TRACED_APP, "--until-signal", "--period-us", "100",
                                     "--ready", path("pid")});
  const fs::path chunk = path("small/rec/chunk-000001");
  EXPECT_TRUE(eventually([&] { return fs::exists(chunk); }));
  EXPECT_TRUE(eventually([&] { return fs::space(path("small")).free == 0; }));
  usleep(2'500'000);  // another chunk is due
  kill(static_cast<pid_t>(std::stoi(read_file(path("pid")))), SIGTERM);
  const Finished result = recorder.wait();
  const json sealed = json::parse(read_file(chunk / "manifest.json"));
  EXPECT_TRUE(sealed["problems"].empty());
  for (const auto& file : sealed["files"])
    EXPECT_EQ(fs::file_size(chunk / file["path"].get<std::string>()), file["size"]);
  umount2(path("small").c_str(), MNT_DETACH);
  EXPECT_EQ(result.status, 4) << result.err;
  EXPECT_THAT(result.err, HasSubstr("THE RECORDING FAILED; what there is stands in "));
  EXPECT_THAT(result.err, HasSubstr("\n  the disk was full: "));
}

INSTANTIATE_TEST_SUITE_P(As, FailingRecord, ::testing::Values(User::current, User::ordinary),
                         name_of_user);

}  // namespace
}  // namespace cie::test
