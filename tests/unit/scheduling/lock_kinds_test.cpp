// Which locks the threads of callbacks and those that deliver take.
#include <cie/scheduling/events_loop.hpp>
#include <cie/scheduling/pool_loop.hpp>
#include <cie/scheduling/serial_loop.hpp>

#include "loop_support.hpp"
#include "support/sanitizers.hpp"

#include <atomic>
#include <memory>
#include <thread>

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <pthread.h>

// Sanitizers have functions of these names of their own.
#if !defined(CIE_THREAD_SANITIZER) && !defined(CIE_ADDRESS_SANITIZER)

namespace {

thread_local bool is_watched = false;
std::atomic<int> locks{0};  // that watched threads took
std::atomic<int> without_inheritance{0};

}  // namespace

// In place of libc's, for all that this program loads.
extern "C" int pthread_mutex_lock(pthread_mutex_t* mutex) {
  constexpr int kInheritsPriority = 32;  // PTHREAD_MUTEX_PRIO_INHERIT_NP of glibc's own headers
  static const auto next =
      reinterpret_cast<decltype(&pthread_mutex_lock)>(dlsym(RTLD_NEXT, "pthread_mutex_lock"));
  if (is_watched) {
    ++locks;
    if ((mutex->__data.__kind & kInheritsPriority) == 0) ++without_inheritance;
  }
  return next(mutex);
}

namespace cie::scheduling {
namespace {

struct Watched {
  Watched() { is_watched = true; }
  Watched(const Watched&) = delete;
  Watched& operator=(const Watched&) = delete;
  ~Watched() { is_watched = false; }
};

template <typename LoopType>
class LocksOfLoop : public testing::Test {};
using WatchedLoops = testing::Types<SerialLoop, EventsLoop, PoolLoop>;
TYPED_TEST_SUITE(LocksOfLoop, WatchedLoops);

// Callbacks come, run and go while the loop's thread and one that makes them ready are watched.
TYPED_TEST(LocksOfLoop, AllHavePriorityInheritance) {
  NoFailures failures;
  TypeParam loop{failures};
  locks = 0;
  without_inheritance = 0;
  std::atomic<int> runs{0};
  const auto made = [&runs] {
    return std::make_shared<Counted>(group(GroupType::mutually_exclusive), [&runs] { ++runs; });
  };
  const auto stays = made();
  std::thread runner{[&loop] {
    const Watched watched;
    loop.run(kNever);
  }};
  loop.add(stays);
  for (int i = 1; i <= 10; ++i) {
    const auto passes = made();
    loop.add(passes);
    {
      const Watched watched;
      stays->release();
      passes->release();
    }
    wait_for(runs, 2 * i);
    loop.remove({passes});
  }
  loop.stop();
  runner.join();
  EXPECT_GT(locks, 0) << "the locks of this program are not seen";
  EXPECT_EQ(without_inheritance, 0);
  loop.remove({stays});
}

}  // namespace
}  // namespace cie::scheduling

#endif
