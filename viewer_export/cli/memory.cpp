#include "memory.hpp"

#include "base/sanitizers.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include <malloc.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

namespace cie::cli {
namespace {

#ifdef M_MMAP_THRESHOLD
constexpr std::size_t kMebibyte = std::size_t{1} << 20U;

void set(int parameter, std::size_t value) noexcept { mallopt(parameter, static_cast<int>(value)); }

// The heap grows by this much at once, and for good; by a quarter of what the process may ask for if
// that is less. That takes address space alone: memory is given at its first use, here in huge pages,
// of which the first block is a part. One page of 4 KiB costs 1 to 20 us on a virtual machine, as
// much as ten events or two hundred. A report of 10 000 callbacks takes half of it.
void reserve_heap(rlim_t limit) noexcept {
  constexpr auto kMost = 256 * kMebibyte;
  constexpr auto kHugePage = 2 * kMebibyte;
  constexpr std::size_t kMaxMappings = 65536;  // glibc's own choice
  const auto size = static_cast<std::size_t>(std::min<rlim_t>(kMost, limit / 4));
  set(M_TRIM_THRESHOLD, size + 4 * kMebibyte);
  set(M_MMAP_MAX, 0);
  auto* const reserve = std::malloc(size);  // NOLINT(cppcoreguidelines-no-malloc)
  if (reserve != nullptr) {
    const auto begin = reinterpret_cast<std::uintptr_t>(reserve);
    const auto offset = (kHugePage - begin % kHugePage) % kHugePage;
    const bool has_huge_pages = offset < size && madvise(static_cast<char*>(reserve) + offset,
                                                         size - offset, MADV_HUGEPAGE) == 0;
    std::free(reserve);  // NOLINT(cppcoreguidelines-no-malloc)
    // What lies before the first huge page stays unused.
    [[maybe_unused]] static void* volatile unused = nullptr;
    if (has_huge_pages) unused = std::malloc(offset);  // NOLINT(cppcoreguidelines-no-malloc)
  }
  set(M_MMAP_MAX, kMaxMappings);
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
#endif
#ifdef M_MMAP_THRESHOLD
  constexpr auto kLarge = kMebibyte / 8;  // glibc's own choice, until something larger was freed
  set(M_MMAP_THRESHOLD, kLarge);
  set(M_TOP_PAD, kMebibyte);  // what it has in reserve when it grows
  // Small blocks that were freed are joined at once: to walk over all of them now and then, when
  // something large is wanted, takes longer.
  set(M_MXFAST, 0);
  // Another thread's heap would have no huge pages, and grow page by page.
  set(M_ARENA_MAX, 1);
  reserve_heap(limit.rlim_cur);
#endif
}

}  // namespace cie::cli
