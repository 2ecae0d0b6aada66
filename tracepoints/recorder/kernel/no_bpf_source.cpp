#include "kernel/kernel_source.hpp"
#include "system/error.hpp"

namespace cie::record {

std::unique_ptr<KernelSource> open_bpf_source(std::uint64_t /*buffer_size*/) {
  throw KernelUnavailable(
      "cie-record was built without BPF: build it where clang and libbpf-dev are installed");
}

}  // namespace cie::record
