#include "memory.hpp"

#include <cerrno>
#include <limits>

#include <alloca.h>
#include <malloc.h>
#include <pthread.h>
#include <sys/mman.h>
#include <unistd.h>

namespace cie::scheduling {
namespace {

constexpr std::size_t kReserve = 32UL * 1024;  // for what runs while the stack is touched

// How much of the calling thread's stack lies below this call.
std::size_t room() noexcept {
  pthread_attr_t attributes{};
  if (pthread_getattr_np(pthread_self(), &attributes) != 0) return 0;
  void* lowest = nullptr;
  std::size_t size = 0;
  std::size_t guard = 0;
  pthread_attr_getstack(&attributes, &lowest, &size);
  pthread_attr_getguardsize(&attributes, &guard);
  pthread_attr_destroy(&attributes);
  const auto here = static_cast<const char*>(__builtin_frame_address(0));
  const auto free = static_cast<std::size_t>(here - static_cast<const char*>(lowest));
  return free > guard + kReserve ? free - guard - kReserve : 0;
}

[[gnu::noinline]] void touch(std::size_t bytes) noexcept {
  auto* const stack = static_cast<volatile char*>(alloca(bytes));
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  for (std::size_t offset = 0; offset < bytes; offset += page)
    stack[offset] = 0;
}

}  // namespace

int lock_memory(LockMemory wish) noexcept {
  int flags = MCL_CURRENT | MCL_FUTURE;
  if (wish == LockMemory::no) return 0;
  if (wish == LockMemory::on_fault) flags |= MCL_ONFAULT;
  if (mlockall(flags) != 0) return errno;
  // What is freed stays the heap's: neither is a large message mapped anew each time, nor the end of
  // the heap given back, to fault in again.
  mallopt(M_MMAP_MAX, 0);
  mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
  return 0;
}

bool prefault_stack(std::size_t bytes) noexcept {
  if (bytes == 0) return true;
  if (bytes > room()) return false;
  touch(bytes);
  return true;
}

}  // namespace cie::scheduling
