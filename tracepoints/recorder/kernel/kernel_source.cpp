#include "kernel/kernel_source.hpp"

#include "kernel/tracefs.hpp"
#include "system/error.hpp"

namespace cie::record {
namespace {

// For a recording that does not use tracefs, and so would not tidy it: what a killed recorder left
// slows the whole machine down.
void tidy_tracefs() noexcept {
  try {
    remove_abandoned_instances(Tracefs());
  } catch (const std::exception&) {  // nothing was left where nothing can be created
  }
}

}  // namespace

std::unique_ptr<KernelSource> open_kernel_source(KernelRoute route, std::uint64_t buffer_size) {
  if (route != KernelRoute::tracefs) {
    try {
      auto source = open_bpf_source(buffer_size);
      tidy_tracefs();
      return source;
    } catch (const KernelUnavailable&) {
      if (route == KernelRoute::bpf) throw;
    }
  }
  return open_tracefs_source(buffer_size);
}

}  // namespace cie::record
