// S3 where threads wait for a mutex of the one that is judged, whose own priority is 19 (FIFO 80).
#include "windows.hpp"

#include <cstdint>
#include <string>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

using analysis::Verdict;

std::string boosted_run(const std::string& lines) {
  return "callback fusion\n-100 initial fusion\n-90 applied fusion policy=fifo priority=80\n" +
         lines + "\n100 start fusion\n102 end fusion";
}

Verdict judged(const std::string& lines) { return Verified(boosted_run(lines))["S3"]; }

Verdict judged(const std::string& lines, std::int64_t from, std::int64_t to) {
  return in_window(boosted_run(lines), from, to)["S3"];
}

// LTTng tells the priority of the first waiter; when none is left, the one that the thread has still.
TEST(PriorityInheritance, EndsWhereTheThreadRunsWithItsOwn) {
  const std::string inherited =
      "3 boost fusion prio=9 old=19\n4 switch 0 idle fusion next_prio=9\n"
      "5 boost fusion prio=9 old=9\n";
  const auto own = inherited + "6 switch 0 fusion idle prio=19\n";
  EXPECT_EQ(judged(own), Verdict::pass);
  EXPECT_EQ(judged(own + "7 switch 0 idle fusion next_prio=9"), Verdict::fail);
  EXPECT_EQ(judged(own + "7 switch 0 idle fusion next_prio=29"), Verdict::fail);
  EXPECT_EQ(judged(inherited + "6 switch 0 fusion idle prio=29"), Verdict::fail)
      << "nobody inherits a lower priority";
}

// Who waits for it is told, and what it inherits so is that priority.
TEST(PriorityInheritance, IsOfThePriorityThatWasTold) {
  const auto judged_with_audit = [](const std::string& lines) {
    return judged("3 boost fusion prio=9 old=19\n" + lines +
                  "\n50 audit fusion policy=fifo priority=80\n");
  };
  EXPECT_EQ(judged_with_audit("4 switch 0 idle fusion next_prio=9"), Verdict::pass);
  for (const std::string other : {"14", "5"}) {
    EXPECT_EQ(judged_with_audit("4 switch 0 idle fusion next_prio=" + other), Verdict::fail)
        << other;
  }
  const std::string again = "4 boost fusion prio=5 old=9\n5 switch 0 idle fusion next_prio=5\n";
  EXPECT_EQ(judged_with_audit(again), Verdict::pass);
  EXPECT_EQ(judged_with_audit(again + "6 boost fusion prio=14 old=5\n"
                                      "7 switch 0 fusion idle prio=14"),
            Verdict::pass);
}

// Where it ended before the window it excuses nothing within: the switch that shows it counts, too.
TEST(PriorityInheritance, MayEndOutsideTheWindow) {
  const std::string begun = "3 boost fusion prio=9 old=19\n4 switch 0 idle fusion next_prio=9\n";
  const std::string own = "6 switch 0 fusion idle prio=19\n";
  const std::string raised =
      "40 switch 0 idle fusion next_prio=9\n43 switch 0 fusion idle prio=9\n"
      "50 audit fusion policy=fifo priority=80\n";
  const std::string applied = "7 applied fusion policy=fifo priority=80\n";
  const std::string own_again =
      "8 switch 0 idle fusion next_prio=19\n9 switch 0 fusion idle prio=19\n";
  for (const auto& before : {begun + "5 boost fusion prio=9 old=9\n" + own, begun + own,
                             begun + own + applied + own_again}) {
    EXPECT_EQ(judged(before + raised), Verdict::fail) << before;
    EXPECT_EQ(judged(before + raised, 30, 110), Verdict::fail) << before;
  }
  EXPECT_EQ(judged(begun + raised, 30, 110), Verdict::pass) << "it goes on";
  const std::string later =
      "60 switch 0 idle fusion next_prio=19\n61 switch 0 fusion idle prio=19\n"
      "70 boost fusion prio=19 old=9\n";
  EXPECT_EQ(judged(raised + later), Verdict::fail);
  EXPECT_EQ(judged(raised + later, 30, 55), Verdict::fail) << "it was at its own meanwhile";
}

// Events of two CPUs have no order within a nanosecond.
TEST(PriorityInheritance, ExcusesTheNanosecondThatTellsOfIt) {
  EXPECT_EQ(judged("3 switch 0 idle fusion next_prio=19\n4 boost fusion prio=9 old=19\n"
                   "4 switch 0 fusion idle prio=19\n5 switch 0 idle fusion next_prio=9\n"
                   "6 boost fusion prio=19 old=9\n6 switch 0 fusion idle prio=9"),
            Verdict::pass);
}

// Once it is back at its own priority, what is inherited later tells nothing of before.
TEST(PriorityInheritance, ToldFromItsBeginExplainsNothingBefore) {
  const std::string raised = "3 switch 0 idle fusion next_prio=9\n";
  const std::string own = "4 switch 0 fusion idle prio=19\n";
  const std::string told = "5 boost fusion prio=9 old=19\n6 boost fusion prio=19 old=9\n";
  const std::string taken_back = "6 boost fusion prio=19 old=9\n";
  EXPECT_EQ(judged(raised + told), Verdict::fail);
  EXPECT_EQ(judged(raised + own + told), Verdict::fail);
  EXPECT_EQ(judged(raised + own + taken_back), Verdict::fail);
  EXPECT_EQ(judged(raised + taken_back), Verdict::pass);
}

TEST(PriorityInheritance, MayBeToldBehindTheSwitchOfItsNanosecond) {
  EXPECT_EQ(judged("3 switch 0 idle fusion next_prio=9\n3 boost fusion prio=9 old=19\n"
                   "4 boost fusion prio=19 old=9\n5 switch 0 fusion idle prio=19"),
            Verdict::pass);
}

// 18 (FIFO 81) is applied after an event that tells not who waits, so that 9 may be inherited ever since.
TEST(PriorityInheritance, ThatMayGoOnShowsNothingOfWhatWasApplied) {
  const std::string told = "3 boost fusion prio=9 old=19\n4 boost fusion prio=19 old=9\n";
  const std::string own = "5 switch 0 idle fusion next_prio=19\n6 switch 0 fusion idle prio=19\n";
  const std::string changed =
      "7 audit fusion policy=fifo priority=80 change=1\n"
      "8 applied fusion policy=fifo priority=81 change=1\n";
  const std::string raised = "9 switch 0 idle fusion next_prio=9\n";
  const std::string audit = "20 audit fusion policy=fifo priority=81 change=1\n";
  const auto without_audit = "8 applied fusion policy=fifo priority=81\n" + raised;
  EXPECT_EQ(judged(told + without_audit), Verdict::inconclusive);
  EXPECT_EQ(judged(told + own + without_audit), Verdict::inconclusive);
  EXPECT_EQ(judged(told + own + without_audit + "10 switch 0 fusion idle prio=18"), Verdict::pass);
  EXPECT_EQ(judged(told + own + without_audit + "10 boost fusion prio=18 old=9"), Verdict::pass);
  EXPECT_EQ(judged(told + own + changed + raised + audit), Verdict::pass) << "by read-back";
  EXPECT_EQ(judged(told + own + without_audit + "10 switch 0 fusion idle prio=18\n" +
                   "11 switch 0 idle fusion next_prio=9"),
            Verdict::fail)
      << "it ran at its own: nobody waited";
}

// No more urgent waiter, or the last one is gone: LTTng's event is the same.
TEST(PriorityInheritance, MayHaveEndedWhereTheEventTellsOfNoChange) {
  const std::string lines = "2 switch 0 idle fusion next_prio=19\n3 boost fusion prio=9 old=19\n";
  const std::string raised = "5 switch 0 fusion idle prio=9\n";
  EXPECT_EQ(judged(lines + raised), Verdict::pass);
  EXPECT_EQ(judged(lines + "4 boost fusion prio=9 old=9\n" + raised), Verdict::inconclusive);
}

}  // namespace
}  // namespace cie::test
