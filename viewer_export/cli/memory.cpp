#include "memory.hpp"

#include "base/sanitizers.hpp"

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

// The heap grows by this much at once, and for good. That takes address space alone: memory is given
// at its first use, here in huge pages. One page of 4 KiB costs 1 to 3 us on a virtual machine, as
// much as ten events. A report of 10 000 callbacks takes half of it.
void reserve_heap() noexcept {
  constexpr auto kReserve = 256 * kMebibyte;
  constexpr auto kHugePage = 2 * kMebibyte;
  constexpr std::size_t kMaxMappings = 65536;  // glibc's own choice
  set(M_TRIM_THRESHOLD, kReserve + 4 * kMebibyte);
  set(M_MMAP_MAX, 0);
  auto* const reserve = std::malloc(kReserve);  // NOLINT(cppcoreguidelines-no-malloc)
  set(M_MMAP_MAX, kMaxMappings);
  if (reserve == nullptr) return;
  const auto begin = reinterpret_cast<std::uintptr_t>(reserve);
  const auto offset = (kHugePage - begin % kHugePage) % kHugePage;
  madvise(static_cast<char*>(reserve) + offset, kReserve - offset, MADV_HUGEPAGE);
  std::free(reserve);  // NOLINT(cppcoreguidelines-no-malloc)
}
#endif

}  // namespace

void prepare_memory() noexcept {
#ifdef M_MMAP_THRESHOLD
  constexpr auto kLarge = kMebibyte / 8;  // glibc's own choice, until something larger was freed
  set(M_MMAP_THRESHOLD, kLarge);
  set(M_TOP_PAD, kMebibyte);  // what it has in reserve when it grows
  // Small blocks that were freed are joined at once: to walk over all of them now and then, when
  // something large is wanted, takes longer.
  set(M_MXFAST, 0);
  // Another thread's heap would have no huge pages, and grow page by page.
  set(M_ARENA_MAX, 1);
  reserve_heap();
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
