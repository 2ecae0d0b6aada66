#include "machine.hpp"

#include "clock.hpp"

#include <array>
#include <fstream>
#include <sstream>

#include <sys/stat.h>
#include <unistd.h>

namespace cie {

std::string first_line(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  return line;
}

std::string host_name() {
  std::array<char, 256> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

std::string boot_id() { return first_line("/proc/sys/kernel/random/boot_id"); }

std::optional<std::uint64_t> stat_field(const std::string& process, int place) {
  const std::string text = first_line("/proc/" + process + "/stat");
  const std::size_t name_end = text.rfind(')');  // the name may hold anything
  if (name_end == std::string::npos) {
    return std::nullopt;
  }
  std::istringstream fields(text.substr(name_end + 1));
  std::string field;
  for (int at = 3; at <= place; ++at) {
    fields >> field;
  }
  std::uint64_t number = 0;
  std::istringstream digits(field);
  if (!fields || !(digits >> number)) {
    return std::nullopt;
  }
  return number;
}

// The kernel counts ticks since the machine booted, suspend included.
std::optional<std::int64_t> start_ns(const std::string& process) {
  constexpr int kStartTime = 22;
  const auto ticks = stat_field(process, kStartTime);
  if (!ticks) return std::nullopt;
  const auto since_boot =
      static_cast<std::int64_t>(*ticks) * (1'000'000'000 / sysconf(_SC_CLK_TCK));
  return since_boot - (now_ns(CLOCK_BOOTTIME) - now_ns(CLOCK_MONOTONIC));
}

std::optional<std::int64_t> monotonic_offset_ns(const std::string& process) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const std::string folder = "/proc/" + process;
  struct stat own {};
  struct stat of_children {};
  const bool is_told = stat((folder + "/ns/time").c_str(), &own) == 0 &&
                       stat((folder + "/ns/time_for_children").c_str(), &of_children) == 0;
  // The file has the offsets of the namespace that its children will be in.
  if (!is_told || own.st_ino != of_children.st_ino) return std::nullopt;
  std::ifstream offsets(folder + "/timens_offsets");
  std::string clock;
  std::int64_t seconds = 0;
  std::int64_t nanoseconds = 0;
  while (offsets >> clock >> seconds >> nanoseconds) {
    if (clock == "monotonic") return seconds * kSecond + nanoseconds;
  }
  return std::nullopt;
}

}  // namespace cie
