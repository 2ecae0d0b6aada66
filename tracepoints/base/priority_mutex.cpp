#include <cie/tracepoints/priority_mutex.hpp>

#include <cerrno>
#include <ctime>

#include <pthread.h>

namespace cie {

PriorityMutex::PriorityMutex() noexcept {
  pthread_mutexattr_t attributes{};
  pthread_mutexattr_init(&attributes);
  pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
  if (pthread_mutex_init(&mutex_, &attributes) != 0) {  // kernel without PI futexes
    pthread_mutex_init(&mutex_, nullptr);
  }
  pthread_mutexattr_destroy(&attributes);
}

PriorityMutex::~PriorityMutex() { pthread_mutex_destroy(&mutex_); }

void PriorityMutex::lock() noexcept { pthread_mutex_lock(&mutex_); }

bool PriorityMutex::try_lock() noexcept { return pthread_mutex_trylock(&mutex_) == 0; }

// CLOCK_MONOTONIC: the other clock may be set while this waits. Linux before 5.14 has that for
// ordinary mutexes only (EINVAL): there it looks from time to time.
bool PriorityMutex::try_lock_for(std::chrono::nanoseconds duration) noexcept {
  constexpr long kSecond = 1'000'000'000;
  constexpr timespec kPause{0, 1'000'000};
  timespec deadline{};
  clock_gettime(CLOCK_MONOTONIC, &deadline);
  const auto nanoseconds = deadline.tv_nsec + duration.count() % kSecond;
  deadline.tv_sec += duration.count() / kSecond + nanoseconds / kSecond;
  deadline.tv_nsec = nanoseconds % kSecond;
  int error = pthread_mutex_clocklock(&mutex_, CLOCK_MONOTONIC, &deadline);
  while (error == EINVAL || error == EBUSY) {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    if (now.tv_sec > deadline.tv_sec ||
        (now.tv_sec == deadline.tv_sec && now.tv_nsec >= deadline.tv_nsec)) {
      return try_lock();
    }
    error = pthread_mutex_trylock(&mutex_);
    if (error == EBUSY) nanosleep(&kPause, nullptr);
  }
  return error == 0;
}

void PriorityMutex::unlock() noexcept { pthread_mutex_unlock(&mutex_); }

}  // namespace cie
