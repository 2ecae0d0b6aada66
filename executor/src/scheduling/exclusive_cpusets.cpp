#include <cie/scheduling/exclusive_cpusets.hpp>

#include "base/cpu_list.hpp"
#include "base/file_descriptor.hpp"
#include "refusal.hpp"

#include <cerrno>
#include <fstream>
#include <optional>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

namespace cie::scheduling {
namespace {

// errno, or 0. Control groups refuse in write(), so nothing may be buffered.
int write_file(const std::filesystem::path& file, const std::string& text) noexcept {
  constexpr mode_t kMode = 0644;  // control groups let nobody create a file
  const FileDescriptor opened{open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, kMode)};
  if (!opened.is_open()) return errno;
  return write(opened.get(), text.data(), text.size()) < 0 ? errno : 0;
}

std::optional<std::string> failed(const std::filesystem::path& file, const std::string& text) {
  const int error = write_file(file, text);
  if (error == 0) return std::nullopt;
  return refused(error, "writing \"" + text + "\" to " + file.string() +
                            (error == EINVAL || error == EBUSY
                                 ? ": another exclusive cpuset has these CPUs, or the one above "
                                   "has them not"
                                 : ": it takes CAP_SYS_ADMIN or the file's owner"));
}

// The first cpuset at or above `folder` that balances load over all its CPUs: below it nothing is a
// scheduling domain of its own.
std::optional<std::filesystem::path> balancing(const ControlGroup& group) {
  for (auto folder = group.folder;; folder = folder.parent_path()) {
    const auto file = folder / "cpuset.sched_load_balance";
    if (KernelView::number(file) == 1) return file;
    const bool is_top =
        folder == group.mount || !folder.has_relative_path() || folder.parent_path() == folder;
    if (is_top) return std::nullopt;
  }
}

std::string make_separate(const ControlGroup& parent, const std::filesystem::path& folder,
                          const std::string& cpus) {
  const std::string memory = KernelView::line(parent.folder / "cpuset.mems").value_or("0");
  for (const auto& [file, text] : {std::pair<const char*, std::string>{"cpuset.cpus", cpus},
                                   {"cpuset.mems", memory},
                                   {"cpuset.cpu_exclusive", "1"}}) {
    if (const auto why = failed(folder / file, text)) return *why;
  }
  return {};
}

std::string make_unified(const ControlGroup& parent, const std::filesystem::path& folder,
                         const std::string& cpus) {
  // Threaded, because single threads of the process move there.
  if (const auto why = failed(folder / "cgroup.type", "threaded")) return *why;
  if (const auto why = failed(parent.folder / "cgroup.subtree_control", "+cpuset")) return *why;
  if (const auto why = failed(folder / "cpuset.cpus", cpus)) return *why;
  // Linux 6.7: without it, the cpuset above must be a partition itself.
  if (exists(folder / "cpuset.cpus.exclusive")) write_file(folder / "cpuset.cpus.exclusive", cpus);
  const auto partition = folder / "cpuset.cpus.partition";
  if (const auto why = failed(partition, "root")) return *why;
  const std::string now = KernelView::line(partition).value_or("");
  if (now == "root") return {};
  return "the kernel makes no partition of it, \"" + now + "\" (let " + parent.folder.string() +
         " be one: write the CPUs to its cpuset.cpus.exclusive, and root to its "
         "cpuset.cpus.partition)";
}

const char* members_file(const ControlGroup& group) noexcept {
  return group.is_unified ? "cgroup.threads" : "tasks";
}

}  // namespace

std::string ExclusiveCpusets::make(const Cpuset& cpuset, const std::string& cpus) {
  if (!cpuset.parent.is_unified) {
    if (const auto file = balancing(cpuset.parent)) {
      return "it would be no scheduling domain of its own, because " + file->string() +
             " is 1 (write 0 to it, which ends load balancing between all CPUs of that cpuset, for "
             "every thread in it)";
    }
  }
  std::error_code error;
  create_directory(cpuset.folder, error);
  if (error) {
    return refused(error.value(), "creating " + cpuset.folder.string() +
                                      ": it takes CAP_SYS_ADMIN, or a control group that was "
                                      "delegated to this user");
  }
  std::string why = cpuset.parent.is_unified ? make_unified(cpuset.parent, cpuset.folder, cpus)
                                             : make_separate(cpuset.parent, cpuset.folder, cpus);
  if (!why.empty()) remove(cpuset);
  return why;
}

// A cpuset that cannot be removed stays empty, and is the owner's to remove: nothing runs in it.
void ExclusiveCpusets::remove(const Cpuset& cpuset) noexcept { rmdir(cpuset.folder.c_str()); }

SchedRequest ExclusiveCpusets::join(std::uint32_t tid, const std::vector<std::uint32_t>& cpus) {
  const std::string list = cpu_list(cpus);
  const auto refuse = [&list](int error, std::string reason) {
    return SchedRequest{
        .error = error, .what = "an exclusive cpuset of CPUs " + list, .reason = std::move(reason)};
  };
  const std::lock_guard lock{mutex_};
  auto found = cpusets_.find(list);
  auto now = kernel_.group("cpuset", tid);
  if (found != cpusets_.end() && now && now->folder == found->second.folder) return {};
  if (leave_locked(tid)) now = kernel_.group("cpuset", tid);
  if (found == cpusets_.end()) {
    if (!now) {
      return refuse(ENOENT,
                    "the thread is in no cpuset control group: mount one, or remove the "
                    "affinity");
    }
    Cpuset cpuset{.parent = *now,
                  .folder = now->folder / fmt::format("cie-{}-cpus-{}", getpid(), list)};
    if (const std::string why = make(cpuset, list); !why.empty()) return refuse(EPERM, why);
    found = cpusets_.emplace(list, std::move(cpuset)).first;
  }
  const auto members = found->second.folder / members_file(found->second.parent);
  if (const int error = write_file(members, std::to_string(tid)); error != 0) {
    return refuse(error, refused(error, "moving the thread to " + members.string()));
  }
  return {};
}

void ExclusiveCpusets::leave(std::uint32_t tid) {
  const std::lock_guard lock{mutex_};
  leave_locked(tid);
}

bool ExclusiveCpusets::leave_locked(std::uint32_t tid) {
  if (cpusets_.empty()) return false;
  const auto now = kernel_.group("cpuset", tid);
  for (const auto& [list, cpuset] : cpusets_) {
    if (!now || now->folder != cpuset.folder) continue;
    write_file(cpuset.parent.folder / members_file(cpuset.parent), std::to_string(tid));
    return true;
  }
  return false;
}

// Whoever is inside is ours, or was created by one of ours.
ExclusiveCpusets::~ExclusiveCpusets() {
  for (const auto& [list, cpuset] : cpusets_) {
    const char* const members = members_file(cpuset.parent);
    std::ifstream inside{cpuset.folder / members};
    for (std::string tid; std::getline(inside, tid);)
      write_file(cpuset.parent.folder / members, tid);
    remove(cpuset);
  }
}

}  // namespace cie::scheduling
