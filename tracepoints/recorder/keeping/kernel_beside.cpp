#include "keeping/kernel_beside.hpp"

#include "keeping/attempt.hpp"
#include "system/error.hpp"

#include <system_error>

namespace cie::record {

namespace fs = std::filesystem;

std::unique_ptr<KernelRecording> start_kernel(const fs::path& directory, Manifest& manifest) {
  const Options& options = manifest.options;
  if (options.kernel == KernelChoice::no) {
    return nullptr;
  }
  try {
    return std::make_unique<KernelRecording>(
        directory, open_kernel_source(options.kernel_route, options.kernel_buffer_size),
        options.flush_interval);
  } catch (const RecordError& error) {
    if (options.kernel == KernelChoice::yes) {
      throw RecordError(std::string("--kernel=yes: ") + error.what());
    }
    manifest.no_kernel_because = error.what();
    std::error_code ignored;
    fs::remove_all(directory, ignored);
    return nullptr;
  }
}

void adopt_clock(KernelRecording* kernel, Manifest& manifest) {
  if (kernel != nullptr) {
    attempt(manifest.problems, [&] { kernel->adopt_clock(manifest.options.directory); });
  }
}

void end_kernel(std::unique_ptr<KernelRecording> kernel, Manifest& manifest) {
  if (kernel) {
    attempt(manifest.problems, [&] { manifest.kernel = kernel->finish(); });
    adopt_clock(kernel.get(), manifest);
  }
}

}  // namespace cie::record
