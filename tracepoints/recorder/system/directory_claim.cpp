#include "system/directory_claim.hpp"

#include "base/text.hpp"
#include "system/error.hpp"

#include <algorithm>
#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace cie::record {
namespace {

namespace fs = std::filesystem;

// `open` with what it throws in words of the recorder.
template <typename Open>
Directory own(const fs::path& path, const Open& open) {
  try {
    Directory directory = open(path);
    const std::string why = directory.distrust();
    if (why.empty()) return directory;
    throw UsageError(in_quotes(path) + ' ' + why +
                     ", who could put links in the way of what is recorded: choose another DIR, "
                     "which this program makes, or one that is yours alone");
  } catch (const UntrustedLink& link) {
    throw UsageError(link.what());
  } catch (const std::system_error& error) {
    throw RecordError(error.what());
  }
}

bool has_nothing_but_claim(const Directory& directory) {
  std::error_code error;
  const fs::directory_iterator entries(directory.way(), error);
  return !error && std::all_of(fs::begin(entries), fs::end(entries), [](const auto& entry) {
    return entry.path().filename() == DirectoryClaim::kFileName;
  });
}

UsageError taken(const fs::path& directory) {
  return UsageError(in_quotes(directory) +
                    " exists already: a recording never overwrites; choose another -o DIR");
}

Directory directory_for(const fs::path& path) {
  std::error_code ignored;
  if (fs::exists(path, ignored) && !fs::is_directory(path, ignored)) throw taken(path);
  return make_own(path);
}

}  // namespace

Directory open_own(const fs::path& directory) { return own(directory, Directory::open); }

Directory make_own(const fs::path& directory) { return own(directory, Directory::make); }

DirectoryClaim::DirectoryClaim(const fs::path& directory) : directory_(directory_for(directory)) {
  if (!has_nothing_but_claim(directory_)) throw taken(directory);
  if (faccessat(directory_.get(), ".", W_OK | X_OK, 0) != 0) {
    throw system_error("cannot write to " + in_quotes(directory), errno);
  }
  // Whoever creates this file has the directory, whoever created that: another recorder may have
  // come in between.
  try {
    directory_.create(kFileName, 0600);
  } catch (const std::system_error& error) {
    if (error.code() != std::errc::file_exists)
      throw system_error("cannot write to " + in_quotes(directory), error.code().value());
    throw UsageError(in_quotes(directory) +
                     " is another recorder's, or was that of one that was killed: choose another "
                     "-o DIR, or remove it");
  }
  is_held_ = true;
  if (has_nothing_but_claim(directory_)) return;
  release();  // somebody's recording was there, and over, before this claim
  throw taken(directory);
}

bool DirectoryClaim::is_in_place() const noexcept {
  struct stat there {};
  struct stat claimed {};
  return is_held_ && stat(directory_.path().c_str(), &there) == 0 &&
         fstat(directory_.get(), &claimed) == 0 && there.st_dev == claimed.st_dev &&
         there.st_ino == claimed.st_ino;
}

void DirectoryClaim::release() noexcept {
  const bool is_there = is_in_place();
  if (!std::exchange(is_held_, false) || !is_there) return;
  // It is empty, and hides nothing if it stays.
  static_cast<void>(!unlinkat(directory_.get(), kFileName, 0));
}

void DirectoryClaim::withdraw() noexcept {
  const bool is_there = is_in_place();
  release();
  if (!is_there || !directory_.is_new()) return;
  std::error_code ignored;  // the reason for the removal is what the user is told
  fs::remove_all(directory_.path(), ignored);
}

}  // namespace cie::record
