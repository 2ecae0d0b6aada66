#include "system/directory_claim.hpp"

#include "base/file_descriptor.hpp"
#include "base/text.hpp"
#include "system/error.hpp"

#include <algorithm>
#include <cerrno>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace cie::record {
namespace {

namespace fs = std::filesystem;

bool has_nothing_but_claim(const fs::path& directory) {
  std::error_code error;
  const fs::directory_iterator entries(directory, error);
  return !error && std::all_of(fs::begin(entries), fs::end(entries), [](const auto& entry) {
    return entry.path().filename() == DirectoryClaim::kFileName;
  });
}

}  // namespace

DirectoryClaim::DirectoryClaim(const fs::path& directory) : directory_(directory) {
  std::error_code error;
  fs::create_directories(directory.parent_path(), error);
  is_created_ = !error && mkdir(directory.c_str(), 0777) == 0;
  const int failure = error ? error.value() : errno;
  if (!is_created_ && failure != EEXIST) {
    throw system_error("cannot create " + in_quotes(directory), failure);
  }
  const auto taken = [&directory] {
    return UsageError(in_quotes(directory) +
                      " exists already: a recording never overwrites; choose another -o DIR");
  };
  if (!fs::is_directory(directory, error) || !has_nothing_but_claim(directory)) throw taken();
  if (access(directory.c_str(), W_OK | X_OK) != 0) {
    throw system_error("cannot write to " + in_quotes(directory), errno);
  }
  // Whoever creates this file has the directory, whoever created that: another recorder may have
  // come in between.
  const FileDescriptor claim(open((directory / DirectoryClaim::kFileName).c_str(),
                                  O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600));
  if (!claim.is_open()) {
    if (errno != EEXIST) throw system_error("cannot write to " + in_quotes(directory), errno);
    throw UsageError(in_quotes(directory) +
                     " is another recorder's, or was that of one that was killed: choose another "
                     "-o DIR, or remove it");
  }
  struct stat status {};
  if (stat(directory.c_str(), &status) != 0)
    throw system_error("cannot write to " + in_quotes(directory), errno);
  identity_ = {.device = status.st_dev, .inode = status.st_ino};
  is_held_ = true;
  if (has_nothing_but_claim(directory)) return;
  release();  // somebody's recording was there, and over, before this claim
  throw taken();
}

bool DirectoryClaim::is_in_place() const noexcept {
  struct stat status {};
  return is_held_ && stat(directory_.c_str(), &status) == 0 &&
         identity_ == Identity{.device = status.st_dev, .inode = status.st_ino};
}

void DirectoryClaim::release() noexcept {
  if (!is_held_) return;
  if (!is_in_place()) {
    is_held_ = false;
    return;
  }
  std::error_code ignored;  // it is empty, and hides nothing
  fs::remove(directory_ / DirectoryClaim::kFileName, ignored);
  is_held_ = false;
}

void DirectoryClaim::withdraw() noexcept {
  const bool was_held = is_held_;
  release();
  if (!was_held || !is_created_) return;
  std::error_code ignored;  // the reason for the removal is what the user is told
  fs::remove_all(directory_, ignored);
}

}  // namespace cie::record
