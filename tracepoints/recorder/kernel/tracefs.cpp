#include "kernel/tracefs.hpp"

#include "base/text.hpp"
#include "system/processes.hpp"

#include <array>
#include <cerrno>
#include <memory>

#include <dirent.h>
#include <fcntl.h>
#include <linux/magic.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/vfs.h>
#include <unistd.h>

namespace cie::record {
namespace {

constexpr const char* kInstances = "instances";
constexpr const char* kPrefix = "cie-record-";

// The mounted tracefs, if this user may create instances in it.
FileDescriptor open_mounted() {
  for (const char* place : {"/sys/kernel/tracing", "/sys/kernel/debug/tracing"}) {
    struct statfs system {};
    if (statfs(place, &system) != 0 || system.f_type != TRACEFS_MAGIC) continue;
    FileDescriptor root(::open(place, O_PATH | O_DIRECTORY | O_CLOEXEC));
    if (root.is_open() && faccessat(root.get(), kInstances, W_OK | X_OK, AT_EACCESS) == 0) {
      return root;
    }
  }
  return {};
}

// glibc has these system calls and their constants since 2.36, and its header and the kernel's, <linux/mount.h>, exclude
// each other.
FileDescriptor mount_detached() {
  constexpr unsigned kCloseOnExec = 1;  // FSOPEN_CLOEXEC, FSMOUNT_CLOEXEC
  constexpr unsigned kCreate = 6;       // FSCONFIG_CMD_CREATE
  const auto descriptor = [](long result) { return FileDescriptor(static_cast<int>(result)); };
  const auto context = descriptor(syscall(SYS_fsopen, "tracefs", kCloseOnExec));
  if (!context.is_open() ||
      syscall(SYS_fsconfig, context.get(), kCreate, nullptr, nullptr, 0) != 0) {
    return {};
  }
  return descriptor(syscall(SYS_fsmount, context.get(), kCloseOnExec, 0U));
}

}  // namespace

Tracefs::Tracefs() : root_(open_mounted()) {
  if (root_.is_open()) return;
  root_ = mount_detached();
  if (root_.is_open()) return;
  const int error = errno;
  if (error == EPERM || error == EACCES) {
    throw KernelUnavailable(
        "the kernel's tracing is for root only (or who may write to a mounted tracefs): record as "
        "root");
  }
  if (error == ENODEV || error == ENOSYS) {
    throw KernelUnavailable("this kernel has no tracefs: it needs CONFIG_EVENT_TRACING");
  }
  throw KernelUnavailable(system_error("cannot mount tracefs", error).what());
}

bool Tracefs::has(const std::string& path) const {
  return faccessat(root_.get(), path.c_str(), F_OK, AT_EACCESS) == 0;
}

FileDescriptor Tracefs::open(const std::string& path, int flags) const {
  FileDescriptor file(openat(root_.get(), path.c_str(), flags | O_CLOEXEC));
  if (!file.is_open()) {
    throw system_error("cannot open tracefs " + in_quotes(path), errno);
  }
  return file;
}

std::string Tracefs::read(const std::string& path) const {
  const FileDescriptor file = open(path, O_RDONLY);
  std::string text;
  std::array<char, 4096> part{};
  while (true) {
    const ssize_t size = ::read(file.get(), part.data(), part.size());
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) throw system_error("cannot read tracefs " + in_quotes(path), errno);
    if (size == 0) return text;
    text.append(part.data(), static_cast<std::size_t>(size));
  }
}

void Tracefs::write(const std::string& path, const std::string& text) const {
  const FileDescriptor file = open(path, O_WRONLY);
  if (::write(file.get(), text.data(), text.size()) != static_cast<ssize_t>(text.size())) {
    throw system_error("cannot write " + in_quotes(text) + " to tracefs " + in_quotes(path), errno);
  }
}

std::vector<std::string> Tracefs::list(const std::string& path) const {
  std::vector<std::string> names;
  const int descriptor = openat(root_.get(), path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const std::unique_ptr<DIR, int (*)(DIR*)> directory(
      descriptor < 0 ? nullptr : fdopendir(descriptor), closedir);
  while (const dirent* entry = directory ? readdir(directory.get()) : nullptr) {
    const std::string name = entry->d_name;
    if (name != "." && name != "..") names.push_back(name);
  }
  return names;
}

void Tracefs::make_directory(const std::string& path) const {
  if (mkdirat(root_.get(), path.c_str(), 0700) != 0) {
    throw system_error("cannot create tracefs " + in_quotes(path), errno);
  }
}

bool Tracefs::remove_directory(const std::string& path) const noexcept {
  return unlinkat(root_.get(), path.c_str(), AT_REMOVEDIR) == 0;
}

TraceInstance::TraceInstance(const Tracefs& tracefs)
    : tracefs_(tracefs),
      path_(std::string(kInstances) + '/' + kPrefix + to_text(identity_of(getpid()))) {
  remove_abandoned_instances(tracefs);
  try {
    tracefs_.make_directory(path_);
  } catch (const RecordError& error) {
    throw KernelUnavailable(error.what());
  }
}

TraceInstance::~TraceInstance() { tracefs_.remove_directory(path_); }

void TraceInstance::write(const std::string& file, const std::string& text) const {
  tracefs_.write(path(file), text);
}

int remove_abandoned_instances(const Tracefs& tracefs) {
  int removed = 0;
  for (const std::string& name : tracefs.list(kInstances)) {
    if (!name.starts_with(kPrefix)) continue;
    const auto owner = parse_identity(name.substr(std::string(kPrefix).size()));
    if (!owner) continue;
    const ProcessIdentity current = identity_of(owner->pid);
    if (current.pid_namespace == owner->pid_namespace && current != *owner &&
        tracefs.remove_directory(std::string(kInstances) + '/' + name)) {
      ++removed;
    }
  }
  return removed;
}

}  // namespace cie::record
