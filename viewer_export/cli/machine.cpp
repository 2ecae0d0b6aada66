#include "machine.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <system_error>

namespace cie::cli {
namespace {

namespace fs = std::filesystem;

template <typename Number>
std::optional<Number> parse(std::string_view text, int base = 10) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::vector<std::string> words(const std::string& text) {
  std::istringstream stream(text);
  return {std::istream_iterator<std::string>(stream), {}};
}

std::vector<std::string> lines(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> result;
  for (std::string line; std::getline(stream, line);)
    result.push_back(line);
  return result;
}

}  // namespace

fs::path Machine::at(const std::string& path) const {
  return root_ / fs::path(path).relative_path();
}

std::optional<std::string> Machine::text(const std::string& path) const {
  std::ifstream file(at(path), std::ios::binary);
  if (!file) return std::nullopt;
  std::string content{std::istreambuf_iterator<char>(file), {}};
  if (file.bad()) return std::nullopt;
  if (content.ends_with('\n')) content.pop_back();
  return content;
}

std::optional<std::int64_t> Machine::number(const std::string& path) const {
  const auto content = text(path);
  return content ? parse<std::int64_t>(*content) : std::nullopt;
}

bool Machine::has(const std::string& path) const {
  std::error_code ignored;
  return fs::exists(at(path), ignored);
}

std::vector<std::string> Machine::names(const std::string& folder) const {
  std::error_code error;
  std::vector<std::string> result;
  for (fs::directory_iterator entry(at(folder), error), end; !error && entry != end;
       entry.increment(error)) {
    result.push_back(entry->path().filename().string());
  }
  std::ranges::sort(result);
  return result;
}

std::string Machine::status(const std::string& name) const {
  for (const auto& line : lines(text("/proc/self/status").value_or("")))
    if (line.starts_with(name + ":")) return line.substr(name.size() + 1);
  return {};
}

bool Machine::is_root() const {
  const auto ids = words(status("Uid"));  // real, effective, saved, of the file system
  return ids.size() > 1 && ids[1] == "0";
}

bool Machine::has_capability(unsigned number) const {
  const auto effective = words(status("CapEff"));
  const auto mask = effective.empty() ? std::nullopt : parse<std::uint64_t>(effective[0], 16);
  return mask && (*mask >> number & 1U) != 0;
}

std::optional<std::uint64_t> Machine::limit(const std::string& name) const {
  for (const auto& line : lines(text("/proc/self/limits").value_or(""))) {
    if (!line.starts_with(name + " ")) continue;
    const auto values = words(line.substr(name.size()));
    return values.empty() ? std::nullopt : parse<std::uint64_t>(values[0]);
  }
  return std::nullopt;
}

bool Machine::is_in_group(const std::string& name) const {
  const auto own = words(status("Groups"));
  for (const auto& line : lines(text("/etc/group").value_or(""))) {
    std::istringstream fields(line);
    std::string group;
    std::string password;
    std::string id;
    std::getline(fields, group, ':');
    std::getline(fields, password, ':');
    std::getline(fields, id, ':');
    if (group == name) return std::ranges::find(own, id) != own.end();
  }
  return false;
}

std::vector<unsigned> Machine::online_cpus() const {
  std::vector<unsigned> cpus;
  std::istringstream ranges(text("/sys/devices/system/cpu/online").value_or("0"));  // 0-3,5
  for (std::string range; std::getline(ranges, range, ',');) {
    const auto dash = std::min(range.find('-'), range.size());
    const auto first = parse<unsigned>(std::string_view(range).substr(0, dash));
    const auto last =
        dash == range.size() ? first : parse<unsigned>(std::string_view(range).substr(dash + 1));
    constexpr unsigned kMostCpus = 1U << 16U;
    if (!first || !last || *last >= kMostCpus) continue;
    for (unsigned cpu = *first; cpu <= *last; ++cpu)
      cpus.push_back(cpu);
  }
  return cpus;
}

bool Machine::has_program(const std::string& name) const {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (has(folder.append(1, '/').append(name))) return true;
  return false;
}

std::vector<std::string> Machine::listening_sockets() const {
  constexpr std::string_view kListening = "00010000";
  constexpr std::size_t kFlags = 3;
  constexpr std::size_t kPath = 7;
  std::vector<std::string> paths;
  for (const auto& line : lines(text("/proc/net/unix").value_or(""))) {
    const auto fields = words(line);
    if (fields.size() > kPath && fields[kFlags] == kListening) paths.push_back(fields[kPath]);
  }
  return paths;
}

std::optional<std::uint64_t> Machine::free_bytes(const std::string& folder) const {
  std::error_code error;
  const auto space = fs::space(at(folder), error);
  if (error) return std::nullopt;
  return space.available;
}

}  // namespace cie::cli
