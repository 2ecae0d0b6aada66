#include "system/temporary_directory.hpp"

#include "base/text.hpp"
#include "system/error.hpp"
#include "system/processes.hpp"

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <string_view>
#include <system_error>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace cie::record {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLock = "recorder.lock";
constexpr const char* kDraft = "recorder.lock.new";
constexpr const char* kDaemon = "daemon";
// It got SIGTERM when its recorder was killed.
constexpr std::chrono::seconds kDaemonPatience{3};
constexpr std::size_t kRandomCharacters = 6;  // of mkdtemp()

// Of this user's, and no link to somewhere else.
bool is_ours(const fs::path& directory) {
  struct stat status {};
  return lstat(directory.c_str(), &status) == 0 && S_ISDIR(status.st_mode) &&
         status.st_uid == geteuid();
}

// Whoever made the directory is gone if nobody holds its lock. It appears under its name when it is
// held, so one without is being made, or another program's.
bool is_abandoned(const fs::path& directory) {
  const FileDescriptor lock(
      open((directory / kLock).c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  return lock.is_open() && flock(lock.get(), LOCK_EX | LOCK_NB) == 0;
}

// One that hangs would stay for good.
void end_daemon(const fs::path& directory) noexcept {
  std::string text;
  std::getline(std::ifstream(directory / kDaemon), text);
  const auto daemon = parse_identity(text);
  if (daemon && identity_of(daemon->pid) == *daemon) end_process(daemon->pid, kDaemonPatience);
}

void sweep(const fs::path& where, const std::string& prefix) {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(where, error)) {
    const std::string name = entry.path().filename().string();
    const bool is_one =
        name.starts_with(prefix) && name.size() == prefix.size() + kRandomCharacters;
    std::error_code ignored;  // the next one may succeed
    if (is_one && is_ours(entry.path()) && is_abandoned(entry.path())) {
      end_daemon(entry.path());
      fs::remove_all(entry.path(), ignored);
    }
  }
}

FileDescriptor hold(const fs::path& directory) {
  FileDescriptor lock(
      open((directory / kDraft).c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600));
  if (!lock.is_open() || flock(lock.get(), LOCK_EX | LOCK_NB) != 0 ||
      rename((directory / kDraft).c_str(), (directory / kLock).c_str()) != 0) {
    throw system_error("cannot write " + in_quotes(directory / kLock), errno);
  }
  return lock;
}

}  // namespace

TemporaryDirectory::TemporaryDirectory(const fs::path& where, const std::string& prefix) {
  sweep(where, prefix);
  std::string name = (where / (prefix + std::string(kRandomCharacters, 'X'))).string();
  if (mkdtemp(name.data()) == nullptr) {
    throw system_error("cannot create a directory like " + in_quotes(name), errno);
  }
  path_ = name;
  try {
    lock_ = hold(path_);
  } catch (...) {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
    throw;
  }
}

void TemporaryDirectory::note_daemon(pid_t pid) const {
  const fs::path file = path_ / kDaemon;
  if (!(std::ofstream(file) << to_text(identity_of(pid)) << std::flush)) {
    throw system_error("cannot write " + in_quotes(file), errno);
  }
}

TemporaryDirectory::~TemporaryDirectory() {
  std::error_code ignored;  // left-over sockets are not worth a failure
  fs::remove_all(path_, ignored);
}

}  // namespace cie::record
