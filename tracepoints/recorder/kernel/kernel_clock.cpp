#include "kernel/kernel_clock.hpp"

#include "base/clock.hpp"
#include "base/machine.hpp"

#include <fstream>
#include <iterator>
#include <string>
#include <system_error>

namespace cie::record {
namespace {

namespace fs = std::filesystem;

std::uint64_t clock_ns(clockid_t clock) { return static_cast<std::uint64_t>(now_ns(clock)); }

std::string read_all(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace

std::uint64_t monotonic_ns() { return clock_ns(CLOCK_MONOTONIC); }

TraceClock measured_clock() {
  return {.uuid = boot_id(), .offset_ns = clock_ns(CLOCK_REALTIME) - clock_ns(CLOCK_MONOTONIC)};
}

bool find_clock(const fs::path& recording, const fs::path& kernel, TraceClock& clock) {
  std::error_code ignored;  // directories come and go while LTTng works
  for (auto entry = fs::recursive_directory_iterator(recording, ignored);
       entry != fs::recursive_directory_iterator(); entry.increment(ignored)) {
    if (ignored) return false;
    const fs::path& file = entry->path();
    if (file.filename() != "metadata" || file.parent_path() == kernel) continue;
    if (read_clock(read_all(file), clock)) return true;
  }
  return false;
}

void write_kernel_metadata(const Directory& directory, const TraceUuid& uuid,
                           const TraceClock& clock, std::string_view route) {
  directory.put("metadata", kernel_metadata(uuid, clock, route));
}

}  // namespace cie::record
