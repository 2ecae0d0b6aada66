// Directories in which others may have prepared something: links, files that are there already, or
// the directory itself.
#pragma once

#include "file_descriptor.hpp"

#include <cstddef>
#include <filesystem>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include <sys/types.h>

namespace cie {

// A link of another user stands on the way: it would lead where that one wants. Links of this user
// and of root are followed.
class UntrustedLink : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A directory that was opened. What is below it is reached from it, and not by its path, which may
// lead elsewhere later. Names are of one part. Functions throw std::system_error whose what() names
// the operation and the file.
class Directory {
 public:
  // Throws UntrustedLink, too.
  static Directory open(const std::filesystem::path& path);
  // The same; makes what is not there, and the directories above it.
  static Directory make(const std::filesystem::path& path);

  // Why what is written into it would not be this user's alone: "belongs to another user (uid 65534)",
  // "may be written to by everybody". Empty: neither.
  std::string distrust() const;
  // make() made it; it was not there.
  bool is_new() const noexcept { return is_new_; }
  // As it was named; for messages.
  const std::filesystem::path& path() const noexcept { return path_; }
  // A path that leads to it whatever became of its own; for functions that take no descriptor.
  std::filesystem::path way() const;
  int get() const noexcept { return descriptor_.get(); }

  // One below it that is there, and no link.
  Directory below(const std::string& name) const;
  // The same; makes it unless it is there.
  Directory make_below(const std::string& name) const;

  // A new file to write to. Follows no link and opens nothing that is there.
  FileDescriptor create(const std::string& name, mode_t mode = 0666) const;
  // A file that has this text, and is whole when it has this name; one that was there is replaced.
  void put(const std::string& name, std::string_view text, mode_t mode = 0666) const;
  // Of a file that is no link; empty: there is none. Of more than `most` bytes the first.
  std::optional<std::string> read(const std::string& name,
                                  std::size_t most = std::numeric_limits<std::size_t>::max()) const;
  // False: it is not there.
  bool remove(const std::string& name) const;
  bool has(const std::string& name) const;

 private:
  friend struct Place;
  Directory(FileDescriptor descriptor, std::filesystem::path path)
      : descriptor_(std::move(descriptor)), path_(std::move(path)) {}
  [[noreturn]] void fail(const char* operation, const std::string& name, int error) const;

  FileDescriptor descriptor_;
  std::filesystem::path path_;
  bool is_new_ = false;
};

// Where a file is, or would be, when the links that lead to it have been followed.
struct Place {
  Directory directory;
  std::string name;
  // It is a link of /proc to an open file that has no other name: a pipe, a terminal. It can be
  // opened, following that link, and nothing else.
  bool is_open_file = false;

  // Throws UntrustedLink and std::system_error. `makes`: directories that are not there.
  static Place of(const std::filesystem::path& file, bool makes = false);
};

// A name for what nobody is to guess: "." + `stem` + "." + 16 digits.
std::string unguessable_name(std::string_view stem);

}  // namespace cie
