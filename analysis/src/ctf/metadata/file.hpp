// A regular file that is read in pieces. It may shrink or vanish meanwhile: then it ends earlier.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace cie::analysis::ctf {

// Few at a time are open between reads, so that a trace may have more files than a process may open.
class File {
 public:
  explicit File(std::string path);

  bool is_readable() const noexcept { return error_.empty(); }
  const std::string& error() const noexcept { return error_; }
  const std::string& path() const noexcept { return path_; }
  std::uint64_t size() const noexcept { return size_; }  // when it was first looked at

  // Bytes that the file system keeps, which are fewer where the file has holes.
  std::uint64_t stored() const noexcept { return stored_; }
  // Where bytes are kept again at or after `offset`; the file's size if nowhere. Holes read as
  // zeros. A file system that knows no holes has none.
  std::uint64_t data_from(std::uint64_t offset) const noexcept;
  // How many bytes of a part are in holes.
  std::uint64_t hole_bytes(std::uint64_t offset, std::uint64_t length) const noexcept;

  // Fills `to` from `offset` on; returns how many bytes there were.
  std::size_t read(std::uint64_t offset, std::span<std::uint8_t> to) const noexcept;

 private:
  class Descriptor;
  // Calls `use(descriptor)`, which is negative if the file cannot be opened any more.
  template <typename Use>
  auto with_descriptor(Use use) const noexcept;

  std::string path_;
  std::string error_;
  std::shared_ptr<const Descriptor> kept_;  // null: opened for each read
  std::uint64_t size_ = 0;
  std::uint64_t stored_ = 0;
};

// What may be streams of a trace: the regular files of its directory but its metadata and hidden
// ones, by name. What could be listed before an error is there as well.
std::vector<std::filesystem::path> stream_files(const std::filesystem::path& directory,
                                                std::error_code& error);

}  // namespace cie::analysis::ctf
