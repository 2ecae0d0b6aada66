// What the files of a machine say that decides whether it can run, trace and record callbacks well.
// Everything is a file, so that another machine's, or a test's, can be read in place of this one's.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace cie::cli {

class Machine {
 public:
  // `root`: the folder that stands for "/".
  explicit Machine(std::filesystem::path root) : root_(std::move(root)) {}

  // The file's text without its last line end; empty if it cannot be read.
  std::optional<std::string> text(const std::string& path) const;
  std::optional<std::int64_t> number(const std::string& path) const;
  bool has(const std::string& path) const;
  // Whether a program of that name is in one of the folders that PATH of this process names.
  bool has_program(const std::string& name) const;
  // Names in a folder, sorted; none if there is no such folder.
  std::vector<std::string> names(const std::string& folder) const;

  // Of this process: what /proc/self tells.
  bool is_root() const;
  bool has_capability(unsigned number) const;
  // The soft limit of that name; empty if unlimited or unknown.
  std::optional<std::uint64_t> limit(const std::string& name) const;
  // Whether it belongs to the group of that name.
  bool is_in_group(const std::string& name) const;

  std::vector<unsigned> online_cpus() const;
  // Paths of UNIX sockets that somebody listens on.
  std::vector<std::string> listening_sockets() const;
  // Bytes that can still be written below the folder.
  std::optional<std::uint64_t> free_bytes(const std::string& folder) const;

 private:
  std::filesystem::path at(const std::string& path) const;
  // The rest of the line of /proc/self/status that begins with `name` and a colon.
  std::string status(const std::string& name) const;

  std::filesystem::path root_;
};

}  // namespace cie::cli
