#include "directory.hpp"

#include "file.hpp"
#include "text.hpp"

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

namespace cie {
namespace {

namespace fs = std::filesystem;

constexpr int kMostLinks = 40;          // that Linux follows
constexpr mode_t kNewDirectory = 0775;  // the umask applies; never for everybody to write to

[[noreturn]] void fail_for(const char* operation, const fs::path& path, int error) {
  throw std::system_error(error, std::generic_category(),
                          std::string("cannot ") + operation + ' ' + in_quotes(path));
}

bool is_of_proc(int descriptor) {
  struct statfs system {};
  return ::fstatfs(descriptor, &system) == 0 && system.f_type == PROC_SUPER_MAGIC;
}

// From part to part, so that each link is looked at before it is followed.
class Walk {
 public:
  Walk(const fs::path& path, bool makes) : path_(path), makes_(makes) { push(path); }

  // Until one part is left, and that is no link.
  void run() {
    while (true) {
      const std::string name = pop();
      const bool is_last = left_.empty();
      if (name.empty() || name == "." || name == "..") {
        if (name == "..") enter(name);
        if (is_last) return end(".");
        continue;
      }
      FileDescriptor next = look_at(name, is_last);
      struct stat status {};
      if (!next.is_open()) return end(name);  // not there yet
      if (::fstat(next.get(), &status) != 0) fail(errno);
      if (S_ISLNK(status.st_mode)) {
        if (is_last && leads_to_open_file(next.get(), name)) {
          is_open_file_ = true;
          return end(name);
        }
        follow(next.get(), status.st_uid, name);
      } else if (is_last) {
        return end(name);
      } else {
        at_ = std::move(next);
        way_ /= name;
      }
    }
  }

  FileDescriptor at_{};
  fs::path way_{};  // to it, without the links that were followed
  std::string name_{};
  bool is_open_file_ = false;

 private:
  [[noreturn]] void fail(int error) const { fail_for("reach", path_, error); }

  void push(const fs::path& path) {
    if (path.empty()) fail(ENOENT);
    if (path.is_absolute() || !at_.is_open()) {
      way_ = path.root_path();
      at_ =
          FileDescriptor(::open(path.is_absolute() ? "/" : ".", O_PATH | O_DIRECTORY | O_CLOEXEC));
      if (!at_.is_open()) fail(errno);
    }
    std::vector<std::string> parts;
    for (const fs::path& part : path.relative_path())
      parts.push_back(part.string());
    left_.insert(left_.end(), parts.rbegin(), parts.rend());
    if (left_.empty()) left_.emplace_back(".");
  }
  std::string pop() {
    std::string name = std::move(left_.back());
    left_.pop_back();
    return name;
  }
  void end(const std::string& name) { name_ = name; }

  void enter(const std::string& name) {
    FileDescriptor next(::openat(at_.get(), name.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
    if (!next.is_open()) fail(errno);
    at_ = std::move(next);
    way_ /= name;
  }

  FileDescriptor look_at(const std::string& name, bool is_last) const {
    constexpr int kFlags = O_PATH | O_NOFOLLOW | O_CLOEXEC;
    FileDescriptor next(::openat(at_.get(), name.c_str(), kFlags));
    if (next.is_open() || (errno == ENOENT && is_last)) return next;
    if (errno != ENOENT || !makes_) fail(errno);
    if (::mkdirat(at_.get(), name.c_str(), kNewDirectory) != 0 && errno != EEXIST) fail(errno);
    next = FileDescriptor(::openat(at_.get(), name.c_str(), kFlags));
    if (!next.is_open()) fail(errno);
    return next;
  }

  bool leads_to_open_file(int link, const std::string& name) const {
    struct stat target {};
    return is_of_proc(link) && ::fstatat(at_.get(), name.c_str(), &target, 0) == 0 &&
           !S_ISREG(target.st_mode) && !S_ISDIR(target.st_mode);
  }

  void follow(int link, uid_t owner, const std::string& name) {
    if (owner != 0 && owner != ::geteuid()) {
      throw UntrustedLink(in_quotes(path_) + " leads over \"" + name +
                          "\", a link of another user (uid " + std::to_string(owner) +
                          "), which is not followed: name the place itself");
    }
    if (++links_ > kMostLinks) fail(ELOOP);
    std::array<char, 4096> target{};
    const auto size = ::readlinkat(link, "", target.data(), target.size());
    if (size < 0) fail(errno);
    push(fs::path(std::string(target.data(), static_cast<std::size_t>(size))));
  }

  fs::path path_;
  bool makes_;
  int links_ = 0;
  std::vector<std::string> left_;  // the last one comes next
};

FileDescriptor open_directory(int at, const std::string& name) {
  return FileDescriptor(::openat(at, name.c_str(), O_PATH | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
}

}  // namespace

Place Place::of(const fs::path& file, bool makes) {
  Walk walk(file, makes);
  walk.run();
  return {.directory = Directory(std::move(walk.at_), std::move(walk.way_)),
          .name = std::move(walk.name_),
          .is_open_file = walk.is_open_file_};
}

Directory Directory::open(const fs::path& path) {
  const Place place = Place::of(path);
  FileDescriptor opened = open_directory(place.directory.get(), place.name);
  if (!opened.is_open()) fail_for("open", path, errno);
  return {std::move(opened), path};
}

Directory Directory::make(const fs::path& path) {
  const Place place = Place::of(path, true);
  Directory made = place.directory.make_below(place.name);
  made.path_ = path;
  return made;
}

std::string Directory::distrust() const {
  struct stat status {};
  if (::fstat(get(), &status) != 0) fail_for("look at", path_, errno);
  if (status.st_uid != 0 && status.st_uid != ::geteuid())
    return "belongs to another user (uid " + std::to_string(status.st_uid) + ")";
  if ((status.st_mode & S_IWOTH) != 0) return "may be written to by everybody";
  return {};
}

fs::path Directory::way() const { return "/proc/self/fd/" + std::to_string(get()); }

Directory Directory::below(const std::string& name) const {
  FileDescriptor opened = open_directory(get(), name);
  if (!opened.is_open()) fail("open", name, errno);
  return {std::move(opened), path_ / name};
}

Directory Directory::make_below(const std::string& name) const {
  const bool is_new = ::mkdirat(get(), name.c_str(), kNewDirectory) == 0;
  if (!is_new && errno != EEXIST) fail("create", name, errno);
  Directory made = below(name);
  made.is_new_ = is_new;
  return made;
}

FileDescriptor Directory::create(const std::string& name, mode_t mode) const {
  FileDescriptor file(
      ::openat(get(), name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode));
  if (!file.is_open()) fail("create", name, errno);
  return file;
}

void Directory::put(const std::string& name, std::string_view text, mode_t mode) const {
  const std::string draft = unguessable_name(name);
  FileDescriptor file = create(draft, mode);
  int error = 0;
  try {
    write_all(file, text);
    if (!file.close() || ::renameat(get(), draft.c_str(), get(), name.c_str()) != 0) error = errno;
  } catch (const std::system_error& failure) {
    error = failure.code().value();
  }
  if (error == 0) return;
  ::unlinkat(get(), draft.c_str(), 0);
  fail("write", name, error);
}

std::optional<std::string> Directory::read(const std::string& name, std::size_t most) const {
  const FileDescriptor file(
      ::openat(get(), name.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  struct stat status {};
  if (!file.is_open() && errno == ENOENT) return std::nullopt;
  if (!file.is_open() || ::fstat(file.get(), &status) != 0) fail("read", name, errno);
  if (!S_ISREG(status.st_mode)) fail("read", name, EINVAL);
  try {
    return read_all(file, most);
  } catch (const std::system_error& failure) {
    fail("read", name, failure.code().value());
  }
}

bool Directory::remove(const std::string& name) const {
  if (::unlinkat(get(), name.c_str(), 0) == 0) return true;
  if (errno != ENOENT) fail("remove", name, errno);
  return false;
}

bool Directory::has(const std::string& name) const {
  struct stat status {};
  return ::fstatat(get(), name.c_str(), &status, AT_SYMLINK_NOFOLLOW) == 0;
}

void Directory::fail(const char* operation, const std::string& name, int error) const {
  fail_for(operation, path_ / name, error);
}

std::string unguessable_name(std::string_view stem) {
  constexpr std::size_t kKept = 200;  // the longest name has 255 bytes
  std::uint64_t number = 0;
  if (::getrandom(&number, sizeof number, 0) != sizeof number)
    throw std::system_error(errno, std::generic_category(), "getrandom");
  std::array<char, 18> digits{};
  std::snprintf(digits.data(), digits.size(), ".%016llx", static_cast<unsigned long long>(number));
  return '.' + std::string(stem.substr(0, kKept)) + digits.data();
}

}  // namespace cie
