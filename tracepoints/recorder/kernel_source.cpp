#include "kernel_source.hpp"

#include "error.hpp"
#include "tracefs.hpp"

namespace cie::record {
namespace {

// Whatever this recording uses: what a killed recorder left slows the whole machine down.
void tidy_tracefs() noexcept {
  try {
    remove_abandoned_instances(Tracefs());
  } catch (const std::exception&) {  // nothing was left where nothing can be created
  }
}

}  // namespace

std::unique_ptr<KernelSource> open_kernel_source(KernelRoute route, std::uint64_t buffer_size) {
  tidy_tracefs();
  if (route != KernelRoute::tracefs) {
    try {
      return open_bpf_source(buffer_size);
    } catch (const KernelUnavailable&) {
      if (route == KernelRoute::bpf) throw;
    }
  }
  return open_tracefs_source(buffer_size);
}

}  // namespace cie::record
