// The recorder's one loop: a command, or what is attached to, until it is over.
#include "target/target.hpp"

#include "support/temporary_directory.hpp"

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <thread>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

namespace cie::record {
namespace {

using std::chrono::milliseconds;
using Event = Target::Event;

Options shell(const std::string& script) {
  Options options;
  options.command = {"sh", "-c", script};
  return options;
}

// How many ticks it took.
int run_to_the_end(Target& target) {
  int ticks = 0;
  while (target.next())
    ++ticks;
  return ticks;
}

TEST(Target, OfACommandIsOverWhenItEnds) {
  Target target(shell("exit 3"));
  target.start();
  run_to_the_end(target);
  EXPECT_EQ(target.exit()->code, 3);
}

TEST(Target, PassesACommandTheSignalsThatEndPrograms) {
  Target target(shell("exec sleep 60"));
  target.start();
  std::raise(SIGTERM);
  EXPECT_EQ(target.next(), Event::tick) << "a command decides itself what it makes of it";
  run_to_the_end(target);
  EXPECT_EQ(target.exit()->signal, SIGTERM);
}

// A recorder in a process group of its own, or in one with its command; how many SIGINTs that got. `send` signals the
// recorder or its group.
int interrupts_of_command(void (*send)(pid_t recorder), bool has_own_group) {
  const test::TemporaryDirectory directory;
  const std::string ready = (directory.path() / "ready").string();
  const std::string log = (directory.path() / "log").string();
  const pid_t recorder = fork();
  if (recorder == 0) {
    setpgid(0, 0);
    alarm(60);
    const std::string script = "trap 'echo got >> " + log + "' INT; touch " + ready +
                               "; for i in 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15; do sleep 0.1; done";
    Options options;
    options.command = {"sh", "-c", script};
    if (has_own_group) options.command.insert(options.command.begin(), "setsid");
    Target target(options);
    target.start();
    run_to_the_end(target);
    _exit(0);
  }
  while (!std::filesystem::exists(ready))
    std::this_thread::sleep_for(milliseconds(5));
  send(recorder);
  waitpid(recorder, nullptr, 0);
  std::ifstream lines(log);
  int count = 0;
  for (std::string line; std::getline(lines, line);)
    ++count;
  return count;
}

TEST(Target, GivesACommandOneSignalHoweverItIsSent) {
  const auto to_recorder = [](pid_t recorder) { kill(recorder, SIGINT); };
  const auto to_group = [](pid_t recorder) { killpg(recorder, SIGINT); };
  const auto to_both = [](pid_t recorder) {  // as timeout(1) does
    kill(recorder, SIGINT);
    killpg(recorder, SIGINT);
  };
  EXPECT_EQ(interrupts_of_command(to_recorder, false), 1);
  EXPECT_EQ(interrupts_of_command(to_group, false), 1);
  EXPECT_EQ(interrupts_of_command(to_both, false), 1);
  EXPECT_EQ(interrupts_of_command(to_recorder, true), 1);
  EXPECT_EQ(interrupts_of_command(to_group, true), 1) << "it has left the group";
}

// Ctrl-C and SIGTERM mean nothing to it, nor to this test: what is blocked is received all the same.
TEST(Target, EndsACommandThatIgnoresSignals) {
  Target target(shell("exec sleep 60"));
  std::signal(SIGTERM, SIG_IGN);  // which a program inherits
  target.start();
  std::signal(SIGTERM, SIG_DFL);
  std::string news;
  for (int times = 1; times <= 3; ++times) {
    EXPECT_FALSE(target.exit()) << times;
    std::raise(SIGTERM);
    const auto end = std::chrono::steady_clock::now() + Escalation::kSame + milliseconds(50);
    while (std::chrono::steady_clock::now() < end && target.next())
      news += target.take_news().value_or("");
  }
  EXPECT_EQ(target.exit()->signal, SIGKILL);
  EXPECT_NE(news.find("sent SIGTERM to \"sh\" (pid " + std::to_string(target.pid()) + ")"),
            std::string::npos)
      << news;
  EXPECT_NE(news.find("killed \"sh\""), std::string::npos) << news;
}

class Asked : public ::testing::Test {
 protected:
  using Step = Escalation::Step;
  // Milliseconds from a start.
  static Escalation::Clock::time_point at(int time) {
    return Escalation::Clock::time_point() + std::chrono::hours(1) + milliseconds(time);
  }
  Escalation escalation_;
};

TEST_F(Asked, OnceACommandIsWaitedForWithoutLimit) {
  EXPECT_EQ(escalation_.pass(at(0)), Step::none);
  EXPECT_EQ(escalation_.ask(at(0)), Step::none);
  EXPECT_EQ(escalation_.pass(at(1999)), Step::none);
  EXPECT_EQ(escalation_.pass(at(2000)), Step::say_so);
  EXPECT_EQ(escalation_.pass(at(9'000'000)), Step::none) << "said once";
}

TEST_F(Asked, AgainACommandIsTerminatedAndThenKilled) {
  escalation_.ask(at(0));
  EXPECT_EQ(escalation_.ask(at(3000)), Step::terminate);
  EXPECT_EQ(escalation_.pass(at(7999)), Step::none);
  EXPECT_EQ(escalation_.pass(at(8000)), Step::kill);
  EXPECT_EQ(escalation_.pass(at(20'000)), Step::none);
}

TEST_F(Asked, AThirdTimeACommandIsKilledAtOnce) {
  escalation_.ask(at(0));
  escalation_.ask(at(1000));
  EXPECT_EQ(escalation_.ask(at(2000)), Step::kill);
  EXPECT_EQ(escalation_.ask(at(4000)), Step::none);
}

TEST_F(Asked, ByNobodyACommandThatWasTerminatedIsKilledAllTheSame) {
  escalation_.terminated(at(0));
  EXPECT_EQ(escalation_.pass(at(4999)), Step::none);
  EXPECT_EQ(escalation_.pass(at(5000)), Step::kill);
}

TEST(Target, IsEndedByWhoKeepsIt) {
  Target target(shell("exec sleep 60"));
  target.start();
  target.end();
  run_to_the_end(target);
  EXPECT_EQ(target.exit()->signal, SIGTERM);
}

TEST_F(Asked, WithinASecondIsTheSame) {
  escalation_.ask(at(0));
  EXPECT_EQ(escalation_.ask(at(999)), Step::none);
  EXPECT_EQ(escalation_.ask(at(1001)), Step::terminate) << "a second after the first";
  EXPECT_EQ(escalation_.ask(at(1500)), Step::none);
}

TEST(Target, OfWhatIsAttachedToIsOverWithASignal) {
  Target target{Options()};
  target.start();
  EXPECT_EQ(target.next(), Event::tick);
  std::raise(SIGINT);
  EXPECT_EQ(target.next(), std::nullopt);
  EXPECT_EQ(target.next(), std::nullopt);
  EXPECT_FALSE(target.exit());
}

TEST(Target, OfWhatIsAttachedToIsOverWhenTheTimeIsUp) {
  Options options;
  options.duration = milliseconds(150);
  Target target(options);
  target.start();
  target.note_registered();
  EXPECT_EQ(run_to_the_end(target), 2) << "one whole tick, and what is left";
  EXPECT_GE(target.age(), milliseconds(150));
}

TEST(Target, OfWhatIsAttachedToIsTimedFromTheFirstApplication) {
  Options options;
  options.duration = milliseconds(150);
  options.registration_timeout = milliseconds(100);
  Target nobody_comes(options);
  nobody_comes.start();
  run_to_the_end(nobody_comes);
  EXPECT_GE(nobody_comes.age(), milliseconds(250)) << "patience first";
}

TEST(Target, IsNotOverForARequest) {
  Target target{Options()};
  target.start();
  std::raise(SIGUSR1);
  EXPECT_EQ(target.next(), Event::request);
  EXPECT_EQ(target.next(), Event::tick);
}

TEST(Target, IsInterruptedByWhoKeepsIt) {
  Target attached{Options()};
  attached.start();
  attached.interrupt(SIGTERM);
  EXPECT_EQ(attached.next(), std::nullopt);
}

}  // namespace
}  // namespace cie::record
