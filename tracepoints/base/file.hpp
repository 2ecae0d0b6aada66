// Files: streams of C that close with their owner, and what others give to read.
#pragma once

#include "file_descriptor.hpp"

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <string_view>

namespace cie {

struct CloseFile {
  void operator()(std::FILE* file) const noexcept { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

// Of popen(): its owner waits for the program's end.
struct ClosePipe {
  void operator()(std::FILE* pipe) const noexcept { ::pclose(pipe); }
};
using Pipe = std::unique_ptr<std::FILE, ClosePipe>;

// For reading a file that is anybody's. A FIFO or a device would make its reader wait, so there is
// none: it is refused at once. What the user gave this process on purpose is read all the same: its
// standard input and other descriptors of its own (/dev/stdin, /dev/fd/63 of a shell's <(...)).
// Throws std::system_error whose what() is the cause alone: "No such file or directory".
FileDescriptor open_to_read(const std::filesystem::path& file);

// Its bytes; of more than `most` the first. Throws as open_to_read() does.
std::string read_file(const std::filesystem::path& file,
                      std::size_t most = std::numeric_limits<std::size_t>::max());

// What a descriptor has to give; of more than `most` the first. Throws std::system_error.
std::string read_all(const FileDescriptor& file,
                     std::size_t most = std::numeric_limits<std::size_t>::max());

// Throws std::system_error.
void write_all(const FileDescriptor& file, std::string_view bytes);

}  // namespace cie
