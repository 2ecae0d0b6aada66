// Preloaded: a wall clock that goes back by an hour half a second after the first look at it.
#define _GNU_SOURCE
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

int clock_gettime(clockid_t id, struct timespec* now) {
  static time_t first;
  const long result = syscall(SYS_clock_gettime, id, now);
  if (id == CLOCK_REALTIME && result == 0) {
    struct timespec since;
    syscall(SYS_clock_gettime, CLOCK_MONOTONIC, &since);
    const time_t tenths = since.tv_sec * 10 + since.tv_nsec / 100000000;
    if (first == 0) first = tenths;
    if (tenths - first >= 5) now->tv_sec -= 3600;
  }
  return (int)result;
}
