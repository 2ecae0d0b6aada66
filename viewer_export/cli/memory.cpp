#include "memory.hpp"

#include "base/sanitizers.hpp"

#include <algorithm>
#include <cstdlib>

#include <jemalloc/jemalloc.h>
#include <sys/resource.h>
#include <unistd.h>

// Read by jemalloc when the program starts. Memory is given at its first use, here in huge pages: one
// page of 4 KiB costs 1 to 20 us on a virtual machine, as much as ten events or two hundred. One
// arena serves all threads, and what was freed, large or small, stays for what comes next: what
// reads a trace goes before the report is made. Caches of a thread hold no large blocks, and a large
// one serves no request of less than an eighth of it: 8 MB less with 10 000 callbacks. Small blocks
// come from eight pages at a time: most slabs would be one page, and each is asked of the arena. A
// thread keeps what it freed of them for itself: what is freed together is asked for again together.
extern "C" {
extern const char* malloc_conf;
const char* malloc_conf =
    "thp:always,metadata_thp:always,narenas:1,oversize_threshold:0,dirty_decay_ms:-1,"
    "muzzy_decay_ms:-1,lg_tcache_max:12,lg_extent_max_active_fit:3,slab_sizes:1-4096:8"
#if JEMALLOC_VERSION_MAJOR > 5 || JEMALLOC_VERSION_MINOR > 2  // others say that they do not know it
    ",tcache_gc_incr_bytes:1073741824"
#endif
    ;
}

namespace cie::cli {
namespace {

#if !defined(CIE_ADDRESS_SANITIZER) && !defined(CIE_THREAD_SANITIZER)
// The heap has address space for a report of 10 000 callbacks, or a quarter of what the process may
// ask for if that is less, in one piece: where it grows step by step the parts of huge pages that
// lie between two steps are small pages.
void reserve_heap(rlim_t limit) noexcept {
  constexpr rlim_t kMost = rlim_t{256} << 20U;
  // NOLINTNEXTLINE(cppcoreguidelines-no-malloc)
  void* volatile reserve = std::malloc(std::min(kMost, limit / 4));
  std::free(reserve);  // NOLINT(cppcoreguidelines-no-malloc)
}
#endif

}  // namespace

void prepare_memory() noexcept {
  rlimit limit{};
  if (getrlimit(RLIMIT_DATA, &limit) != 0) return;
#if !defined(CIE_ADDRESS_SANITIZER) && !defined(CIE_THREAD_SANITIZER)
  const auto pages = sysconf(_SC_PHYS_PAGES);
  const auto page = sysconf(_SC_PAGESIZE);
  if (pages > 0 && page > 0) {
    const auto half = static_cast<rlim_t>(pages) / 2 * static_cast<rlim_t>(page);
    limit.rlim_cur = std::min(limit.rlim_cur, half);  // no limit is the largest number
    setrlimit(RLIMIT_DATA, &limit);
  }
  reserve_heap(limit.rlim_cur);
#endif
}

}  // namespace cie::cli
