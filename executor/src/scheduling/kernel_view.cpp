#include <cie/scheduling/kernel_view.hpp>

#include "base/text.hpp"

#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <unistd.h>

namespace cie::scheduling {
namespace {

constexpr const char* kCaller = "thread-self";

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream stream{text};
  return {std::istream_iterator<std::string>(stream), {}};
}

}  // namespace

std::optional<std::string> KernelView::line(const std::filesystem::path& file) {
  std::ifstream stream{file};
  std::string text;
  if (!std::getline(stream, text)) return std::nullopt;
  return text;
}

std::optional<std::int64_t> KernelView::number(const std::filesystem::path& file) {
  return number_of(file);
}

std::optional<std::int64_t> KernelView::kernel_setting(std::string_view name) const {
  return number(path("/proc/sys/kernel") / name);
}

bool KernelView::has_capability(unsigned bit) const {
  return files_.has_capability(bit, kCaller).value_or(true);
}

bool KernelView::is_in_first_user_namespace() const {
  const auto map = line(path("/proc/self/uid_map"));
  return !map || words_of(*map) == std::vector<std::string>{"0", "0", "4294967295"};
}

std::uint64_t KernelView::threads_of_user() const {
  std::uint64_t threads = 0;
  std::error_code error;
  std::filesystem::directory_iterator entry(path("/proc"), error);
  for (const std::filesystem::directory_iterator end; !error && entry != end;
       entry.increment(error)) {
    const auto process = entry->path().filename().string();
    if (process.find_first_not_of("0123456789") != std::string::npos) continue;
    const auto users = words_of(files_.status("Uid", process).value_or(""));  // the real one first
    if (users.empty() || users.front() != std::to_string(getuid())) continue;
    threads +=
        parse_number<std::uint64_t>(files_.status("Threads", process).value_or("")).value_or(0);
  }
  return threads;
}

std::optional<std::string> KernelView::allowed_cpus() const {
  return files_.status("Cpus_allowed_list", kCaller);
}

std::optional<ControlGroup> KernelView::group(std::string_view controller,
                                              std::uint32_t tid) const {
  auto group =
      files_.control_group(controller, tid == 0 ? kCaller : fmt::format("self/task/{}", tid));
  if (group) {
    group->mount = files_.path(group->mount);
    group->folder = files_.path(group->folder);
  }
  return group;
}

}  // namespace cie::scheduling
