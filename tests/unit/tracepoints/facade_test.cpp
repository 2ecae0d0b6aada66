// The facade without any session: what it counts and identifies is the same with LTTng and without.
#include <cie/tracepoints/sched_attr.hpp>
#include <cie/tracepoints/schema.hpp>
#include <cie/tracepoints/trace.hpp>

#include "provider/process_info.hpp"
#include "support/sanitizers.hpp"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <fstream>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

namespace cie::trace {
namespace {

using ::testing::ElementsAre;

CallbackInfo timer(GroupId group, std::string id) {
  return {.group = group, .kind = CallbackKind::timer, .logical_id = std::move(id)};
}

TEST(Facade, NumbersStartsFromZeroWithoutGaps) {
  const Node node("/a");
  const Group group(node.id(), GroupType::mutually_exclusive);
  Callback callback(timer(group.id(), "/a@Timer(1)"));
  EXPECT_EQ(callback.next_seq(), 0U);
  for (std::uint64_t seq = 0; seq < 3; ++seq) {
    EXPECT_EQ(callback.start({}), seq);
    callback.end(seq, CallbackStatus::ok);
    EXPECT_EQ(callback.next_seq(), seq + 1);
  }
}

TEST(Facade, NumbersStartsOfAReentrantCallbackUniquelyAcrossThreads) {
  constexpr int kThreads = 4;
  constexpr int kInstances = 10'000;
  const Node node("/a");
  const Group group(node.id(), GroupType::reentrant);
  Callback callback(timer(group.id(), "/a@Timer(2)"));
  std::vector<std::vector<std::uint64_t>> numbers(kThreads);
  {
    std::vector<std::jthread> threads;
    for (auto& own : numbers) {
      threads.emplace_back([&callback, &own] {
        for (int i = 0; i < kInstances; ++i) {
          own.push_back(callback.start({}));
          callback.end(own.back(), CallbackStatus::ok);
        }
      });
    }
  }
  std::set<std::uint64_t> all;
  for (const auto& own : numbers) {
    all.insert(own.begin(), own.end());
    EXPECT_TRUE(std::ranges::is_sorted(own));
  }
  EXPECT_EQ(all.size(), std::size_t{kThreads} * kInstances);
  EXPECT_EQ(*all.rbegin(), std::uint64_t{kThreads} * kInstances - 1);
  EXPECT_EQ(callback.next_seq(), std::uint64_t{kThreads} * kInstances);
}

TEST(Facade, StampsMessagesWithRisingTimes) {
  const Node node("/a");
  Publisher publisher(node.id(), "/topic", 1);
  std::int64_t last = publisher.next_source_timestamp();
  for (int i = 0; i < 1000; ++i) {
    const std::int64_t stamp = publisher.publish();
    EXPECT_GT(stamp, last);
    last = stamp;
  }
}

TEST(Facade, NeverReusesAnId) {
  std::set<std::uint32_t> ids;
  for (int i = 0; i < 10; ++i) {
    const Node node("/n");
    const Group group(node.id(), GroupType::mutually_exclusive);
    const Callback callback(timer(group.id(), "/n@Timer(1)"));
    EXPECT_TRUE(ids.insert(to_number(callback.id())).second);
  }
  std::vector<std::jthread> threads;
  std::vector<std::uint32_t> concurrent(8);
  for (std::uint32_t& id : concurrent) {
    threads.emplace_back([&id] { id = to_number(Callback(timer(kNoGroup, "x")).id()); });
  }
  threads.clear();
  for (const std::uint32_t id : concurrent) {
    EXPECT_TRUE(ids.insert(id).second);
  }
}

TEST(UniqueLogicalId, NumbersEqualIdsInCreationOrder) {
  EXPECT_EQ(unique_logical_id("/n@Timer(5)"), "/n@Timer(5)");
  EXPECT_EQ(unique_logical_id("/n@Timer(5)"), "/n@Timer(5)#2");
  EXPECT_EQ(unique_logical_id("/n@Timer(5)"), "/n@Timer(5)#3");
  EXPECT_EQ(unique_logical_id("/m@Timer(5)"), "/m@Timer(5)");
}

TEST(UniqueLogicalId, SkipsANumberedIdThatSomebodyChoseAsName) {
  EXPECT_EQ(unique_logical_id("/k"), "/k");
  EXPECT_EQ(unique_logical_id("/k#2"), "/k#2");
  EXPECT_EQ(unique_logical_id("/k"), "/k#3");
  EXPECT_EQ(unique_logical_id("/k#2"), "/k#2#2");
}

// A component that is loaded again gets the ids that its spec names.
TEST(UniqueLogicalId, IsFreeAgainWhenItsCallbackHasGone) {
  for (int lifetime = 0; lifetime < 2; ++lifetime) {
    const Callback first(timer(kNoGroup, unique_logical_id("/again")));
    const Callback second(timer(kNoGroup, unique_logical_id("/again")));
    EXPECT_EQ(unique_logical_id("/again"), lifetime == 0 ? "/again#3" : "/again#4");
  }
  EXPECT_EQ(unique_logical_id("/again"), "/again");
}

TEST(ReadBack, SaysWhatTheKernelWasTold) {
  std::jthread([] {
    cpu_set_t first_cpu;
    CPU_ZERO(&first_cpu);
    const auto before = read_back(0);
    ASSERT_TRUE(before);
    CPU_SET(before->cpus.front(), &first_cpu);
    ASSERT_EQ(sched_setaffinity(0, sizeof first_cpu, &first_cpu), 0);
    const sched_param no_priority{};
    ASSERT_EQ(sched_setscheduler(0, SCHED_BATCH, &no_priority), 0);
    const int nicer = before->nice + 3;
    ASSERT_EQ(nice(3), nicer);

    const auto after = read_back(0);
    ASSERT_TRUE(after);
    EXPECT_EQ(after->policy, SCHED_BATCH);
    EXPECT_EQ(after->nice, nicer);
    EXPECT_EQ(after->priority, 0U);
    EXPECT_EQ(after->runtime_ns, 0U);
    EXPECT_THAT(after->cpus, ElementsAre(before->cpus.front()));
  }).join();
}

TEST(ReadBack, KeepsResetOnForkOutOfThePolicy) {
  std::jthread([] {
    const sched_param no_priority{};
    ASSERT_EQ(sched_setscheduler(0, SCHED_BATCH | SCHED_RESET_ON_FORK, &no_priority), 0);
    const auto parameters = read_back(0);
    ASSERT_TRUE(parameters);
    EXPECT_EQ(parameters->policy, SCHED_BATCH);
    EXPECT_EQ(parameters->flags & 1U, 1U);  // SCHED_FLAG_RESET_ON_FORK
  }).join();
}

TEST(ReadBack, IsEmptyForAThreadThatIsGone) {
  std::uint32_t tid = 0;
  std::jthread([&tid] {
    tid = Thread(ThreadRole::worker, kNoCallback, kNoGroup, "gone").tid();
  }).join();
  // A thread is joined a moment before the kernel has forgotten it.
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (read_back(tid) && std::chrono::steady_clock::now() < deadline)
    std::this_thread::yield();
  EXPECT_FALSE(read_back(tid));
}

// As who gets the tid of a thread that is gone.
TEST(ReadBack, IsEmptyForAThreadOfAnotherProcess) {
  const pid_t other = ::fork();
  if (other == 0) {
    ::pause();
    ::_exit(0);
  }
  ASSERT_GT(other, 0);
  SchedAttr attributes;
  EXPECT_EQ(get_sched_attr(static_cast<std::uint32_t>(other), attributes), 0)
      << "the kernel knows it";
  EXPECT_FALSE(read_back(static_cast<std::uint32_t>(other)));
  ::kill(other, SIGKILL);
  ::waitpid(other, nullptr, 0);
}

// The next thread of the system gets that tid, unless another one comes before. False: not permitted.
bool give_next(std::uint32_t tid) {
  std::ofstream file("/proc/sys/kernel/ns_last_pid");
  file << tid - 1 << std::flush;
  return file.good();
}

// A thread of this process that gets the tid of one that is gone; false: nobody can have it.
bool run_with(std::uint32_t tid, const std::function<void()>& work) {
  for (int attempt = 0; attempt < 1000; ++attempt) {
    if (!give_next(tid)) return false;
    bool is_it = false;
    std::jthread([&] {
      is_it = static_cast<std::uint32_t>(gettid()) == tid;
      if (is_it) work();
    }).join();
    if (is_it) return true;
  }
  return false;
}

TEST(Facade, ReadsNoOtherThreadOfItsProcessBackThatGotTheTid) {
  std::optional<Thread> gone;
  std::jthread([&gone] {
    gone.emplace(ThreadRole::worker, kNoCallback, kNoGroup, "gone");
    EXPECT_TRUE(gone->emit_sched(SchedMoment::initial, 0));
  }).join();
  std::this_thread::sleep_for(std::chrono::milliseconds(30));  // the kernel tells starts by 10 ms
  const bool is_reused = run_with(gone->tid(), [&gone] {
    EXPECT_TRUE(read_back(gone->tid())) << "the process has such a thread";
    EXPECT_FALSE(gone->emit_sched(SchedMoment::audit, 0));
    Thread own(ThreadRole::worker, kNoCallback, kNoGroup, "own");
    EXPECT_TRUE(own.emit_sched(SchedMoment::initial, 0));
  });
  if (!is_reused) GTEST_SKIP() << "it takes CAP_CHECKPOINT_RESTORE to have a tid again";
}

TEST(Facade, KnowsAThreadByItsOwnTid) {
  Thread own(ThreadRole::worker, kNoCallback, kNoGroup, "own");
  EXPECT_EQ(own.tid(), static_cast<std::uint32_t>(gettid()));
  const auto parameters = own.emit_sched(SchedMoment::initial, 0);
  ASSERT_TRUE(parameters);
  EXPECT_FALSE(parameters->cpus.empty());
}

TEST(RunLifetime, MayBeginAgainAfterItEnded) {
  for (int i = 0; i < 3; ++i) {
    trace::Run run(ExecutorKind::isolated, "");
    const Node node("/n");
    run.set_status(i);
  }
  trace::Run outer(ExecutorKind::isolated, "");
  const trace::Run inner(ExecutorKind::single_threaded, "");
}

// Two readings of the clocks that it is calculated from differ by tens of nanoseconds.
TEST(RunLifetime, EveryRunOfAProcessSaysThatItBeganAtTheSameTime) {
  const auto began = read_process_info().process_start_ns;
  EXPECT_GT(began, 0);
  for (int i = 0; i < 100; ++i)
    EXPECT_EQ(read_process_info().process_start_ns, began);
}

TEST(RunLifetime, SurvivesForkInParentAndChild) {
#ifdef CIE_THREAD_SANITIZER
  GTEST_SKIP() << "not possible here: ThreadSanitizer supports no new threads after fork()";
#endif
#ifdef CIE_ADDRESS_SANITIZER
  GTEST_SKIP() << "not possible here: AddressSanitizer's allocator stays locked in the child when "
                  "another thread was in it at fork()";
#endif
  const trace::Run run(ExecutorKind::isolated, "");
  const Node node("/n");
  const pid_t child = fork();
  if (child == 0) {
    {
      const trace::Run own(ExecutorKind::isolated, "");  // with a background thread of its own
      const Node own_node("/child");
    }
    _exit(0);
  }
  int status = -1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
}

TEST(Schema, HasALabelForEveryNumberAndNoneBeyond) {
  EXPECT_EQ(label(RunMoment::announce), "announce");
  EXPECT_EQ(label(CallbackKind::waitable), "waitable");
  EXPECT_EQ(label(ReleaseKind::none), "none");
  EXPECT_EQ(label(static_cast<CallbackStatus>(2)), "");
}

}  // namespace
}  // namespace cie::trace
