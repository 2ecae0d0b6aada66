// What a configurator asks of the kernel, and whom it tells: on a machine that is written down here.
#include <cie/scheduling/thread_configurator.hpp>

#include "described_machine.hpp"

#include <cerrno>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::scheduling {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

using SpecPtr = std::shared_ptr<const SchedulingSpec>;

SpecPtr spec_of(const std::string& entries) {
  return std::make_shared<SchedulingSpec>(
      SchedulingSpec::parse("callback_groups:\n" + entries, "spec.yaml"));
}

std::string entry(const std::string& callback, const std::string& parameters) {
  return "  - {id: /n@Timer(" + callback + "), " + parameters + "}\n";
}

// Threads a and b, each of the callback of its name, and a configurator.
class Configurator : public DescribedMachine {
 protected:
  // As ThreadConfigurator::configure does it for the thread of a callback.
  struct Thread {
    Thread(Configurator& test, const std::string& callback)
        : tid(test.new_thread()),
          trace(ThreadRole::callback, kNoCallback, kNoGroup, callback, tid),
          configured(test.configurator().configure(
              trace, {.name = callback, .callbacks = {"/n@Timer(" + callback + ")"}})) {}
    std::uint32_t tid;
    trace::Thread trace;
    ThreadConfigurator::Configured configured;
  };

  Configurator() {
    options.on_scheduling_problem = [this](const SchedulingProblem& problem) {
      told.push_back(problem.text());
    };
  }

  ThreadConfigurator& configurator() {
    if (configurator_ == nullptr)
      configurator_ = std::make_unique<ThreadConfigurator>(options, calls, kernel());
    return *configurator_;
  }
  // Two threads under this spec; nothing of that counts as asked or told.
  void start(const std::string& entries) {
    options.spec = spec_of(entries);
    a = std::make_unique<Thread>(*this, "a");
    b = std::make_unique<Thread>(*this, "b");
    calls.requests.clear();
    calls.emitted.clear();
    told.clear();
  }
  trace::SchedReadBack& state(const Thread& thread) { return calls.threads.at(thread.tid); }
  Policy policy(const Thread& thread) { return static_cast<Policy>(state(thread).policy); }
  static std::string of(const Thread& thread, const std::string& what) {
    return std::to_string(thread.tid) + " " + what;
  }
  // The kernel refuses this thread every policy but that which it has.
  void refuse(const Thread& thread, Policy wanted) {
    calls.refusal = [tid = thread.tid, wanted](std::uint32_t of, const SchedAttr& attributes) {
      return of == tid && static_cast<Policy>(attributes.policy) == wanted ? EPERM : 0;
    };
  }

  ExecutorOptions options;
  std::vector<std::string> told;

 private:
  std::unique_ptr<ThreadConfigurator> configurator_;

 protected:
  std::unique_ptr<Thread> a;
  std::unique_ptr<Thread> b;
};

// --- configuring -------------------------------------------------------------------------------

TEST_F(Configurator, AsksWhatTheEntrySaysAndReadsItBack) {
  options.spec = spec_of(entry("a", "policy: SCHED_FIFO, priority: 60, affinity: [1]"));
  const Thread thread{*this, "a"};
  EXPECT_THAT(calls.requests, ElementsAre(of(thread, "CPUs 1"), of(thread, "SCHED_FIFO")));
  EXPECT_THAT(calls.emitted, ElementsAre(of(thread, "applied")));
  EXPECT_EQ(state(thread).priority, 60U);
  EXPECT_THAT(thread.configured.problems, IsEmpty());
}

TEST_F(Configurator, AsksNothingForAThreadThatTheSpecDoesNotName) {
  options.spec = spec_of(entry("a", "policy: SCHED_BATCH"));
  const Thread thread{*this, "b"};
  EXPECT_THAT(calls.requests, IsEmpty());
  EXPECT_THAT(calls.emitted, ElementsAre(of(thread, "applied")));
}

TEST_F(Configurator, TellsARefusalWithItsLineAndReason) {
  options.spec = spec_of(entry("a", "policy: SCHED_FIFO, priority: 60"));
  calls.refusal = [](std::uint32_t, const SchedAttr&) { return EPERM; };
  const Thread thread{*this, "a"};
  ASSERT_THAT(thread.configured.problems, SizeIs(1));
  EXPECT_EQ(thread.configured.problems[0].error, EPERM);
  EXPECT_EQ(thread.configured.problems[0].line, 2);
  EXPECT_THAT(told,
              ElementsAre(AllOf(HasSubstr("spec.yaml:2"), HasSubstr("cannot set SCHED_FIFO 60"),
                                HasSubstr("CAP_SYS_NICE"))));
  EXPECT_THAT(calls.emitted, ElementsAre(of(thread, "applied " + std::to_string(EPERM))));
  EXPECT_THAT(configurator().problems(), SizeIs(1));
}

TEST_F(Configurator, TellsWhatIsReadBackOtherwise) {
  options.spec = spec_of(entry("a", "policy: SCHED_OTHER, nice: 5"));
  calls.is_deaf = true;
  const Thread thread{*this, "a"};
  ASSERT_THAT(thread.configured.problems, SizeIs(1));
  EXPECT_EQ(thread.configured.problems[0].error, 0);
  EXPECT_THAT(told, ElementsAre(HasSubstr("read back after setting: nice is 0 instead of 5")));
}

TEST_F(Configurator, TellsEntriesOfOneGroupThatDiffer) {
  options.spec = spec_of(entry("a", "policy: SCHED_BATCH") + entry("b", "policy: SCHED_IDLE") +
                         entry("c", "policy: SCHED_BATCH"));
  const auto found = configurator().conflicts(
      {.name = "group", .callbacks = {"/n@Timer(a)", "/n@Timer(b)", "/n@Timer(c)"}});
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].entry, "/n@Timer(b)");
  EXPECT_THAT(found[0].reason, HasSubstr("line 2"));
}

// --- reload ------------------------------------------------------------------------------------

TEST_F(Configurator, ReloadChangesOnlyWhatIsAskedOtherwise) {
  start(entry("a", "policy: SCHED_BATCH") + entry("b", "policy: SCHED_BATCH"));
  configurator().reload(
      spec_of(entry("a", "policy: SCHED_BATCH") + entry("b", "policy: SCHED_IDLE")));
  EXPECT_THAT(calls.requests, ElementsAre(of(*b, "SCHED_IDLE")));
  EXPECT_THAT(calls.emitted, ElementsAre(of(*b, "applied")));
  EXPECT_THAT(told, IsEmpty());
}

TEST_F(Configurator, ReloadGivesBackWhatIsNoLongerAskedFor) {
  start(entry("a", "policy: SCHED_FIFO, priority: 9, affinity: [2]"));
  configurator().reload(nullptr);
  EXPECT_EQ(policy(*a), Policy::other);
  EXPECT_THAT(state(*a).cpus, ElementsAre(0, 1, 2, 3)) << "as it began";
}

TEST_F(Configurator, ReloadAsksAgainWhereSomebodyElseChangedTheThread) {
  const std::string same = entry("a", "policy: SCHED_BATCH");
  start(same);
  state(*a).policy = static_cast<std::int32_t>(Policy::idle);
  configurator().reload(spec_of(same));
  EXPECT_EQ(policy(*a), Policy::batch);
}

// The kernel admits deadline threads by their sum.
TEST_F(Configurator, ReloadLetsThreadsLeaveDeadlineBeforeOthersCome) {
  constexpr const char* kDeadline =
      "policy: SCHED_DEADLINE, runtime: 1000000, deadline: 5000000, period: 5000000";
  start(entry("b", kDeadline));
  configurator().reload(spec_of(entry("a", kDeadline) + entry("b", "policy: SCHED_OTHER")));
  EXPECT_THAT(calls.requests, ElementsAre(of(*b, "SCHED_OTHER"), of(*a, "SCHED_DEADLINE")));
}

TEST_F(Configurator, ReloadWithAConflictIsRefusedBeforeAnythingIsAsked) {
  start(entry("a", "policy: SCHED_BATCH"));
  const std::uint32_t tid = new_thread();
  trace::Thread group{ThreadRole::callback, kNoCallback, kNoGroup, "group", tid};
  const auto both = configurator().configure(
      group, {.name = "group", .callbacks = {"/n@Timer(c)", "/n@Timer(d)"}});
  calls.requests.clear();
  EXPECT_THROW(configurator().reload(spec_of(entry("a", "policy: SCHED_IDLE") +
                                             entry("c", "policy: SCHED_BATCH") +
                                             entry("d", "policy: SCHED_IDLE"))),
               SchedulingRefused);
  EXPECT_THAT(calls.requests, IsEmpty());
  EXPECT_EQ(policy(*a), Policy::batch);
}

TEST_F(Configurator, ReloadThatIsRefusedPutsEverythingBack) {
  start(entry("a", "policy: SCHED_BATCH, nice: 3, affinity: [1]"));
  refuse(*b, Policy::fifo);
  try {
    configurator().reload(
        spec_of(entry("a", "policy: SCHED_IDLE") + entry("b", "policy: SCHED_FIFO, priority: 1")));
    FAIL() << "nothing was refused";
  } catch (const SchedulingRefused& refused) {
    ASSERT_THAT(refused.problems(), SizeIs(1));
    EXPECT_EQ(refused.problems()[0].entry, "/n@Timer(b)");
    EXPECT_EQ(refused.problems()[0].line, 3);
  }
  EXPECT_EQ(policy(*a), Policy::batch);
  EXPECT_EQ(state(*a).nice, 3);
  EXPECT_THAT(state(*a).cpus, ElementsAre(1));
  EXPECT_EQ(policy(*b), Policy::other);
  // The former spec is in force: for audits, for threads that come, for the next reload.
  told.clear();
  configurator().audit();
  EXPECT_THAT(told, IsEmpty());
  const Thread late{*this, "a"};
  EXPECT_EQ(policy(late), Policy::batch);
}

TEST_F(Configurator, ReloadSaysWhatCannotGoBack) {
  start(entry("a", "policy: SCHED_OTHER, nice: -5"));
  // Without privilege nobody leaves SCHED_IDLE.
  calls.refusal = [this](std::uint32_t tid, const SchedAttr& attributes) {
    if (calls.threads.at(tid).policy == static_cast<std::int32_t>(Policy::idle)) return EPERM;
    return static_cast<Policy>(attributes.policy) == Policy::fifo ? EPERM : 0;
  };
  EXPECT_THROW(configurator().reload(spec_of(entry("a", "policy: SCHED_IDLE") +
                                             entry("b", "policy: SCHED_FIFO, priority: 1"))),
               SchedulingRefused);
  EXPECT_THAT(told, ElementsAre(HasSubstr("cannot set SCHED_FIFO 1"),
                                HasSubstr("cannot go back to SCHED_OTHER nice -5")));
}

TEST_F(Configurator, ReloadUnderWarnGoesAsFarAsItCan) {
  options.on_error = OnError::warn;
  start("  []\n");
  refuse(*a, Policy::fifo);
  configurator().reload(
      spec_of(entry("a", "policy: SCHED_FIFO, priority: 1") + entry("b", "policy: SCHED_BATCH")));
  EXPECT_THAT(told, ElementsAre(HasSubstr("cannot set SCHED_FIFO 1")));
  EXPECT_EQ(policy(*a), Policy::other);
  EXPECT_EQ(policy(*b), Policy::batch);
  const Thread late{*this, "b"};
  EXPECT_EQ(policy(late), Policy::batch) << "the new spec is in force";
}

TEST_F(Configurator, ReloadLeavesOutThreadsThatAreGone) {
  start(entry("a", "policy: SCHED_BATCH"));
  calls.threads.erase(b->tid);
  configurator().reload(spec_of(entry("b", "policy: SCHED_IDLE")));
  EXPECT_THAT(calls.requests, ElementsAre(of(*a, "SCHED_OTHER")));
}

// --- audit -------------------------------------------------------------------------------------

TEST_F(Configurator, AuditTellsWhatSomebodyElseChangedOnce) {
  start(entry("a", "policy: SCHED_BATCH"));
  configurator().audit();
  EXPECT_THAT(told, IsEmpty());
  state(*a).policy = static_cast<std::int32_t>(Policy::idle);
  configurator().audit();
  configurator().audit();
  EXPECT_THAT(told, ElementsAre(AllOf(HasSubstr("changed from outside"),
                                      HasSubstr("SCHED_IDLE instead of SCHED_BATCH"))));
  EXPECT_TRUE(configurator().problems().back().is_from_outside);
  EXPECT_EQ(policy(*a), Policy::idle) << "it only tells";
  EXPECT_THAT(calls.emitted, ElementsAre(of(*a, "audit"), of(*b, "audit"), of(*a, "audit"),
                                         of(*b, "audit"), of(*a, "audit"), of(*b, "audit")));
}

TEST_F(Configurator, AuditTellsAnewAfterSomebodyPutItRight) {
  start(entry("a", "policy: SCHED_BATCH"));
  for (const Policy now : {Policy::idle, Policy::batch, Policy::idle}) {
    state(*a).policy = static_cast<std::int32_t>(now);
    configurator().audit();
  }
  EXPECT_THAT(told, SizeIs(2));
}

TEST_F(Configurator, AuditAppliesAgainWhereTheOptionsSaySo) {
  options.on_change = OnChange::apply_again;
  start(entry("a", "policy: SCHED_BATCH"));
  state(*a).policy = static_cast<std::int32_t>(Policy::idle);
  configurator().audit();
  EXPECT_EQ(policy(*a), Policy::batch);
  EXPECT_THAT(told, ElementsAre(HasSubstr("it is applied again")));
  EXPECT_THAT(calls.emitted, ElementsAre(of(*a, "audit"), of(*a, "applied"), of(*b, "audit")));
}

TEST_F(Configurator, AuditLeavesOutThreadsThatEnded) {
  start("  []\n");
  b.reset();
  calls.threads.erase(a->tid);
  auto worker = std::make_shared<trace::Thread>(ThreadRole::worker, kNoCallback, kNoGroup, "worker",
                                                new_thread());
  configurator().configure(worker, {.name = "worker"});
  worker.reset();  // one that ends without a word
  calls.emitted.clear();
  configurator().audit();
  EXPECT_THAT(calls.emitted, ElementsAre(of(*a, "audit")));
  EXPECT_THAT(told, IsEmpty());
}

// --- misspelt ids ------------------------------------------------------------------------------

TEST_F(Configurator, TellsMisspeltIdsOnceForEachSpec) {
  start(entry("aa", "policy: SCHED_BATCH"));
  const KnownIds known{.nodes = {"/n"}, .callbacks = {"/n@Timer(a)"}};
  configurator().tell_misspelt(known);
  configurator().tell_misspelt(known);
  EXPECT_THAT(told, ElementsAre(HasSubstr("did you mean \"/n@Timer(a)\"?")));
  configurator().reload(spec_of(entry("aa", "policy: SCHED_BATCH")));
  configurator().tell_misspelt(known);
  EXPECT_THAT(told, SizeIs(2));
}

}  // namespace
}  // namespace cie::scheduling
