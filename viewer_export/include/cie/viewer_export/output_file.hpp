// Where a command's result goes: a file that appears whole or not at all, or standard output.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <ostream>
#include <stdexcept>
#include <string>

namespace cie::viewer_export {

// Writing failed. what() names the operation, the file and the cause.
class WriteError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Whoever read the result wants no more of it, as `head` does.
class ClosedPipe : public WriteError {
 public:
  using WriteError::WriteError;
};

// Called with the name of the temporary file when it appears, and with an empty path when it is
// gone, so that a signal handler can remove it. Where the file system can keep a file without a
// name it has one only for the moment of taking its place.
using TemporaryListener = std::function<void(const std::filesystem::path&)>;

// A result being written. Until commit() a regular target keeps its old content; destruction
// without commit() leaves nothing behind. "-" is standard output; devices and pipes are written
// directly. Links of this user and of root are followed; those of others, and FIFOs of others, are
// refused: they could lead anywhere. Not thread-safe.
class OutputFile {
 public:
  // Throws WriteError when the target cannot be written.
  explicit OutputFile(const std::filesystem::path& target, const TemporaryListener& listener = {});
  ~OutputFile();
  OutputFile(OutputFile&&) noexcept;
  OutputFile& operator=(OutputFile&&) noexcept;

  // Buffered. Its operations throw WriteError when a write fails (disk full), ClosedPipe when
  // nobody reads.
  std::ostream& stream() noexcept;
  // Whether bytes go to a terminal.
  bool is_terminal() const noexcept;
  // Writes what is buffered and puts the file in its place. Throws WriteError. Call it once.
  void commit();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Calls write(stream) and commits. On a terminal control characters of the data are made visible; a file
// or a pipe gets the data as they are. `is_csv`: a line break between quotation marks is no end of a line.
void write_data(OutputFile& output, const std::function<void(std::ostream&)>& write,
                bool is_csv = false);

}  // namespace cie::viewer_export
