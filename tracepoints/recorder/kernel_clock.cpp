#include "kernel_clock.hpp"

#include "error.hpp"

#include <cerrno>
#include <ctime>
#include <fstream>
#include <iterator>
#include <string>
#include <system_error>

namespace cie::record {
namespace {

namespace fs = std::filesystem;

std::uint64_t clock_ns(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return static_cast<std::uint64_t>(time.tv_sec) * 1'000'000'000 +
         static_cast<std::uint64_t>(time.tv_nsec);
}

std::string read_all(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace

std::uint64_t monotonic_ns() { return clock_ns(CLOCK_MONOTONIC); }

TraceClock measured_clock() {
  TraceClock clock{.uuid = read_all("/proc/sys/kernel/random/boot_id"),
                   .offset_ns = clock_ns(CLOCK_REALTIME) - clock_ns(CLOCK_MONOTONIC)};
  while (!clock.uuid.empty() && clock.uuid.back() == '\n')
    clock.uuid.pop_back();
  return clock;
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

void write_kernel_metadata(const fs::path& directory, const TraceUuid& uuid,
                           const TraceClock& clock) {
  const fs::path file = directory / "metadata";
  const fs::path draft = directory / ".metadata.part";
  std::ofstream stream(draft, std::ios::binary);
  stream << kernel_metadata(uuid, clock);
  stream.close();
  if (!stream) throw system_error("cannot write " + in_quotes(file), errno);
  fs::rename(draft, file);
}

}  // namespace cie::record
