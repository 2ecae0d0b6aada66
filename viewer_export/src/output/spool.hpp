// Temporary bytes on disk, without a name: they vanish with the process, however it ends.
#pragma once

#include "base/file_descriptor.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <ostream>
#include <span>
#include <string>
#include <string_view>

namespace cie::viewer_export {

// Where temporary data goes: `directory`; empty: $TMPDIR or /tmp.
std::filesystem::path temporary_place(const std::filesystem::path& directory);
// The same for messages: `temporary data in "/tmp" (TMPDIR chooses another directory)`.
std::string temporary_data(const std::filesystem::path& directory);

class Spool {
 public:
  // In `directory`; empty: $TMPDIR or /tmp. Opens on the first append.
  explicit Spool(std::filesystem::path directory) : directory_(std::move(directory)) {}

  // Throws WriteError.
  void append(std::string_view bytes);
  std::uint64_t size() const noexcept { return size_; }
  // Fills `bytes` from `offset`; both lie within what was appended. Throws WriteError.
  void read(std::uint64_t offset, std::span<char> bytes) const;
  void copy_to(std::ostream& out) const;

 private:
  void open();

  std::filesystem::path directory_;
  std::string object_;  // for messages
  FileDescriptor file_;
  std::uint64_t size_ = 0;
};

}  // namespace cie::viewer_export
