// The recorder's one loop: a command, or what is attached to, until it is over.
#include "target/target.hpp"

#include <chrono>
#include <csignal>
#include <optional>
#include <string>

#include <gtest/gtest.h>

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
