// Streams of C; closed with their owner.
#pragma once

#include <cstdio>
#include <memory>

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

}  // namespace cie
