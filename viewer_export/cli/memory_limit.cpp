#include "memory_limit.hpp"

#include "base/sanitizers.hpp"

#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

namespace cie::cli {

void limit_memory() noexcept {
#ifdef M_MMAP_THRESHOLD
  constexpr int kLarge = 128 * 1024;  // glibc's own choice, until something larger was freed
  mallopt(M_MMAP_THRESHOLD, kLarge);
  // What a heap has in reserve: beyond that, glibc extends those of threads page by page.
  constexpr int kMebibyte = 1024 * 1024;
  mallopt(M_TOP_PAD, kMebibyte);
  mallopt(M_TRIM_THRESHOLD, 4 * kMebibyte);
  // Small blocks that were freed are joined at once: to walk over all of them now and then, when
  // something large is wanted, takes longer.
  mallopt(M_MXFAST, 0);
#endif
#if !defined(CIE_ADDRESS_SANITIZER) && !defined(CIE_THREAD_SANITIZER)
  const auto pages = sysconf(_SC_PHYS_PAGES);
  const auto page = sysconf(_SC_PAGESIZE);
  if (pages <= 0 || page <= 0) return;
  const auto bytes = static_cast<rlim_t>(pages) / 2 * static_cast<rlim_t>(page);
  rlimit limit{};
  if (getrlimit(RLIMIT_DATA, &limit) != 0) return;
  if (limit.rlim_cur == RLIM_INFINITY || limit.rlim_cur > bytes) {
    limit.rlim_cur = bytes;
    setrlimit(RLIMIT_DATA, &limit);
  }
#endif
}

}  // namespace cie::cli
