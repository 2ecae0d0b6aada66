#include <cie/scheduling/kernel_view.hpp>

#include <charconv>
#include <fstream>
#include <limits>
#include <sstream>
#include <vector>

#include <fmt/format.h>

namespace cie::scheduling {
namespace {

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream stream{text};
  std::vector<std::string> words;
  for (std::string word; stream >> word;)
    words.push_back(word);
  return words;
}

bool lists(const std::string& comma_separated, std::string_view wanted) {
  std::istringstream stream{comma_separated};
  for (std::string item; std::getline(stream, item, ',');) {
    if (item == wanted) return true;
  }
  return false;
}

// The group's path below the mount point, which may show a part of the hierarchy only.
std::filesystem::path below(const std::string& group, const std::string& mounted_root) {
  std::string_view rest = group;
  if (mounted_root != "/" && rest.starts_with(mounted_root)) {
    rest.remove_prefix(mounted_root.size());
  }
  while (rest.starts_with('/'))
    rest.remove_prefix(1);
  return rest;
}

}  // namespace

std::filesystem::path KernelView::path(std::string_view absolute) const {
  return root_ / absolute.substr(absolute.starts_with('/') ? 1 : 0);
}

std::optional<std::string> KernelView::line(const std::filesystem::path& file) {
  std::ifstream stream{file};
  std::string text;
  if (!std::getline(stream, text)) return std::nullopt;
  return text;
}

std::optional<std::int64_t> KernelView::number(const std::filesystem::path& file) {
  std::ifstream stream{file};
  std::int64_t value = 0;
  if (!(stream >> value)) return std::nullopt;
  return value;
}

std::optional<std::int64_t> KernelView::kernel_setting(std::string_view name) const {
  return number(path("/proc/sys/kernel") / name);
}

std::optional<std::string> KernelView::status_field(std::string_view name) const {
  std::ifstream stream{path("/proc/thread-self/status")};
  for (std::string text; std::getline(stream, text);) {
    if (!text.starts_with(name) || text.substr(name.size(), 1) != ":") continue;
    const auto begin = text.find_first_not_of(" \t", name.size() + 1);
    return begin == std::string::npos ? std::string{} : text.substr(begin);
  }
  return std::nullopt;
}

bool KernelView::has_capability(unsigned bit) const {
  const auto text = status_field("CapEff");
  if (!text) return true;
  std::uint64_t set = 0;
  const auto parsed = std::from_chars(text->data(), text->data() + text->size(), set, 16);
  return parsed.ec != std::errc{} || ((set >> bit) & 1U) != 0;
}

bool KernelView::is_in_first_user_namespace() const {
  const auto map = line(path("/proc/self/uid_map"));
  return !map || words_of(*map) == std::vector<std::string>{"0", "0", "4294967295"};
}

std::optional<std::string> KernelView::allowed_cpus() const {
  return status_field("Cpus_allowed_list");
}

std::optional<std::uint64_t> KernelView::limit(std::string_view name) const {
  std::ifstream stream{path("/proc/self/limits")};
  for (std::string text; std::getline(stream, text);) {
    if (!text.starts_with(name)) continue;
    const auto columns = words_of(text.substr(name.size()));
    if (columns.empty()) return std::nullopt;
    if (columns.front() == "unlimited") return std::numeric_limits<std::uint64_t>::max();
    std::uint64_t value = 0;
    const auto& soft = columns.front();
    const auto parsed = std::from_chars(soft.data(), soft.data() + soft.size(), value);
    return parsed.ec == std::errc{} ? std::optional(value) : std::nullopt;
  }
  return std::nullopt;
}

std::optional<ControlGroup> KernelView::group(std::string_view controller,
                                              std::uint32_t tid) const {
  // "4:cpu,cpuacct:/group", and "0::/group" for the unified hierarchy.
  std::optional<std::string> separate;
  std::optional<std::string> unified;
  std::ifstream groups{
      path(tid == 0 ? "/proc/thread-self/cgroup" : fmt::format("/proc/self/task/{}/cgroup", tid))};
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
    const auto place = words_of(text.substr(0, dash));
    const auto type = words_of(text.substr(dash + 3));
    if (place.size() < 5 || type.size() < 3) continue;
    const bool is_unified = type[0] == "cgroup2";
    const auto& group = is_unified ? unified : separate;
    if (!group || (!is_unified && (type[0] != "cgroup" || !lists(type[2], controller)))) continue;
    const auto mount = path(place[4]);
    const auto folder = mount / below(*group, place[3]);
    if (is_unified) {
      const auto controllers = line(folder / "cgroup.controllers");
      bool is_there = false;
      for (const auto& each : words_of(controllers.value_or("")))
        is_there = is_there || each == controller;
      if (!is_there) continue;
    }
    return ControlGroup{.mount = mount, .folder = folder, .is_unified = is_unified};
  }
  return std::nullopt;
}

}  // namespace cie::scheduling
