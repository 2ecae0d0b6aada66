#include "keeping/kernel_beside.hpp"

#include "keeping/attempt.hpp"
#include "keeping/manifest.hpp"
#include "system/error.hpp"

#include <exception>
#include <system_error>
#include <utility>

namespace cie::record {

namespace fs = std::filesystem;

std::unique_ptr<KernelRecording> start_kernel(const std::string& name, Tracing& tracing) {
  const Options& options = tracing.options();
  if (options.kernel == KernelChoice::no) {
    return nullptr;
  }
  try {
    auto source = open_kernel_source(options.kernel_route, options.kernel_buffer_size);
    return std::make_unique<KernelRecording>(tracing.directory().make_below(name),
                                             std::move(source), options.flush_interval);
  } catch (const std::exception& error) {
    if (options.kernel == KernelChoice::yes) {
      throw RecordError(std::string("--kernel=yes: ") + error.what());
    }
    tracing.manifest.kernel_reason = error.what();
    std::error_code ignored;
    fs::remove_all(tracing.directory().way() / name, ignored);
    return nullptr;
  }
}

void adopt_clock(KernelRecording* kernel, Tracing& tracing) {
  if (kernel != nullptr) {
    attempt(tracing.manifest.kernel.problems,
            [&] { kernel->adopt_clock(tracing.options().directory); });
  }
}

void end_kernel(std::unique_ptr<KernelRecording> kernel, Tracing& tracing) {
  if (kernel) {
    attempt(tracing.manifest.kernel.problems,
            [&] { note_kernel(kernel->finish(), tracing.manifest); });
    adopt_clock(kernel.get(), tracing);
  }
}

}  // namespace cie::record
