#include <cie/tracepoints/machine_files.hpp>

#include "text.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <sstream>
#include <system_error>

namespace cie {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> words(const std::string& text) {
  std::istringstream stream(text);
  return {std::istream_iterator<std::string>(stream), {}};
}

bool lists(const std::string& comma_separated, std::string_view wanted) {
  std::istringstream stream{comma_separated};
  for (std::string item; std::getline(stream, item, ',');) {
    if (item == wanted) return true;
  }
  return false;
}

// The group's path below the mount point, which may show a part of the hierarchy only.
fs::path below(const std::string& group, const std::string& mounted_root) {
  std::string_view rest = group;
  if (mounted_root != "/" && rest.starts_with(mounted_root)) {
    rest.remove_prefix(mounted_root.size());
  }
  while (rest.starts_with('/'))
    rest.remove_prefix(1);
  return rest;
}

fs::path in_proc(std::string_view task, std::string_view file) {
  return fs::path("/proc") / task / file;
}

}  // namespace

std::optional<std::string> text_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return std::nullopt;
  std::string content{std::istreambuf_iterator<char>(stream), {}};
  if (stream.bad()) return std::nullopt;
  if (content.ends_with('\n')) content.pop_back();
  return content;
}

std::optional<std::int64_t> number_of(const fs::path& file) {
  const auto content = text_of(file);
  return content ? parse_number<std::int64_t>(*content) : std::nullopt;
}

fs::path MachineFiles::path(const fs::path& file) const { return root_ / file.relative_path(); }

bool MachineFiles::has(const fs::path& file) const {
  std::error_code ignored;
  return fs::exists(path(file), ignored);
}

std::optional<std::string> MachineFiles::text(const fs::path& file) const {
  return text_of(path(file));
}

std::optional<std::int64_t> MachineFiles::number(const fs::path& file) const {
  return number_of(path(file));
}

std::optional<std::string> MachineFiles::status(std::string_view name,
                                                std::string_view task) const {
  std::ifstream stream{path(in_proc(task, "status"))};
  for (std::string text; std::getline(stream, text);) {
    if (!text.starts_with(name) || text.substr(name.size(), 1) != ":") continue;
    const auto begin = text.find_first_not_of(" \t", name.size() + 1);
    return begin == std::string::npos ? std::string{} : text.substr(begin);
  }
  return std::nullopt;
}

std::optional<bool> MachineFiles::has_capability(unsigned number, std::string_view task) const {
  const auto effective = status("CapEff", task);
  const auto set = effective ? parse_number<std::uint64_t>(*effective, 16) : std::nullopt;
  if (!set) return std::nullopt;
  return (*set >> number & 1U) != 0;
}

std::optional<ControlGroup> MachineFiles::control_group(std::string_view controller,
                                                        std::string_view task) const {
  // "4:cpu,cpuacct:/group", and "0::/group" for the unified hierarchy.
  std::optional<std::string> separate;
  std::optional<std::string> unified;
  std::ifstream groups{path(in_proc(task, "cgroup"))};
  for (std::string text; std::getline(groups, text);) {
    const auto first = text.find(':');
    const auto second = text.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = text.substr(first + 1, second - first - 1);
    if (controllers.empty()) unified = text.substr(second + 1);
    if (lists(controllers, controller)) separate = text.substr(second + 1);
  }
  // "36 35 0:30 ROOT MOUNT_POINT OPTIONS … - TYPE SOURCE SUPER_OPTIONS"
  std::ifstream mounts{path("/proc/self/mountinfo")};
  for (std::string text; std::getline(mounts, text);) {
    const auto dash = text.find(" - ");
    if (dash == std::string::npos) continue;
    const auto place = words(text.substr(0, dash));
    const auto type = words(text.substr(dash + 3));
    if (place.size() < 5 || type.size() < 3) continue;
    const bool is_unified = type[0] == "cgroup2";
    const auto& group = is_unified ? unified : separate;
    if (!group || (!is_unified && (type[0] != "cgroup" || !lists(type[2], controller)))) continue;
    const fs::path mount = place[4];
    const auto folder = mount / below(*group, place[3]);
    if (is_unified) {
      const auto controllers = words(this->text(folder / "cgroup.controllers").value_or(""));
      if (std::ranges::find(controllers, controller) == controllers.end()) continue;
    }
    return ControlGroup{.mount = mount, .folder = folder, .is_unified = is_unified};
  }
  return std::nullopt;
}

std::optional<std::uint64_t> MachineFiles::limit(std::string_view name) const {
  std::ifstream stream{path("/proc/self/limits")};
  for (std::string text; std::getline(stream, text);) {
    if (!text.starts_with(name) || text.substr(name.size(), 1) != " ") continue;
    const auto columns = words(text.substr(name.size()));
    if (columns.empty()) return std::nullopt;
    const auto& soft = columns.front();
    return soft == "unlimited" ? kUnlimited : parse_number<std::uint64_t>(soft);
  }
  return std::nullopt;
}

std::vector<std::uint32_t> MachineFiles::online_cpus() const {
  std::vector<std::uint32_t> cpus;
  std::istringstream ranges(text("/sys/devices/system/cpu/online").value_or("0"));  // 0-3,5
  for (std::string range; std::getline(ranges, range, ',');) {
    const auto dash = std::min(range.find('-'), range.size());
    const auto first = parse_number<std::uint32_t>(std::string_view(range).substr(0, dash));
    const auto last = dash == range.size()
                          ? first
                          : parse_number<std::uint32_t>(std::string_view(range).substr(dash + 1));
    constexpr std::uint32_t kMostCpus = 1U << 16U;
    if (!first || !last || *last >= kMostCpus) continue;
    for (std::uint32_t cpu = *first; cpu <= *last; ++cpu)
      cpus.push_back(cpu);
  }
  return cpus;
}

}  // namespace cie
