#include <cie/tracepoints/utf8.hpp>
#include <cie/viewer_export/output_file.hpp>

#include "base/directory.hpp"
#include "base/file_descriptor.hpp"
#include "held_signals.hpp"
#include "write_all.hpp"
#include "write_behind.hpp"

#include <array>
#include <cerrno>
#include <cstddef>
#include <functional>
#include <optional>
#include <ostream>
#include <streambuf>
#include <string>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace cie::viewer_export {
namespace {

namespace fs = std::filesystem;

// Carries bytes to a descriptor; throws instead of setting flags, so that the cause survives.
class DescriptorBuffer final : public std::streambuf {
 public:
  DescriptorBuffer(int descriptor, std::string object)
      : descriptor_(descriptor), object_(std::move(object)) {
    setp(buffer_.data(), buffer_.data() + buffer_.size());
  }

 protected:
  int_type overflow(int_type c) override {
    drain();
    if (!traits_type::eq_int_type(c, traits_type::eof())) {
      *pptr() = traits_type::to_char_type(c);
      pbump(1);
    }
    return traits_type::not_eof(c);
  }
  std::streamsize xsputn(const char* data, std::streamsize size) override {
    if (size <= epptr() - pptr()) {
      return std::streambuf::xsputn(data, size);
    }
    drain();
    write({data, static_cast<std::size_t>(size)});
    return size;
  }
  int sync() override {
    drain();
    return 0;
  }

 private:
  void drain() {
    const std::string_view pending{pbase(), static_cast<std::size_t>(pptr() - pbase())};
    setp(buffer_.data(), buffer_.data() + buffer_.size());  // a failed block is not tried again
    write(pending);
  }
  void write(std::string_view bytes) {
    write_all(descriptor_, bytes, object_);
    behind_.wrote(bytes.size());
  }

  int descriptor_;
  std::string object_;
  WriteBehind behind_{descriptor_};
  std::array<char, 65536> buffer_{};
};

// Where the file is that a rename must replace: where a chain of symbolic links ends, whether it is there or not.
Place place_of(const fs::path& target, const std::string& object) {
  try {
    return Place::of(target);
  } catch (const UntrustedLink& link) {
    throw WriteError("cannot write " + object + ": " + link.what());
  } catch (const std::system_error& error) {
    throw_write_error("cannot create " + object, error.code().value());
  }
}

constexpr int kMostAttempts = 100;

// Passes on whole lines, made printable.
class PrintableLines final : public std::streambuf {
 public:
  PrintableLines(std::ostream& out, bool is_csv) : out_(out), is_csv_(is_csv) {}
  void finish() {
    out_ << printable(line_);
    line_.clear();
  }

 protected:
  int_type overflow(int_type c) override {
    const char letter = traits_type::to_char_type(c);
    if (is_csv_ && letter == '"') is_quoted_ = !is_quoted_;
    if (letter == '\n' && !is_quoted_) {
      finish();
      out_ << '\n';
    } else {
      line_ += letter;
    }
    return traits_type::not_eof(c);
  }

 private:
  std::ostream& out_;
  bool is_csv_;
  bool is_quoted_ = false;
  std::string line_;
};

}  // namespace

struct OutputFile::State {
  std::string object;          // for messages: "standard output" or the file's name
  std::optional<Place> place;  // empty: written directly
  std::string temporary;       // beside it; empty: the temporary file has no name
  FileDescriptor owned;
  int descriptor = -1;
  TemporaryListener listener;
  std::unique_ptr<DescriptorBuffer> buffer;
  std::unique_ptr<std::ostream> stream;

  ~State() { discard(); }

  int directory() const { return place->directory.get(); }

  void tell_listener() const {
    if (!listener) return;
    listener(temporary.empty() ? fs::path() : place->directory.path() / temporary);
  }

  // A device or a pipe. What somebody else made to be written into is refused, terminals are given.
  void open_direct(const Place& at) {
    const int follow = at.is_open_file ? 0 : O_NOFOLLOW;
    struct stat status {};
    const bool is_named_pipe =
        !at.is_open_file &&
        ::fstatat(at.directory.get(), at.name.c_str(), &status, AT_SYMLINK_NOFOLLOW) == 0 &&
        (S_ISFIFO(status.st_mode) || S_ISSOCK(status.st_mode));
    if (is_named_pipe && status.st_uid != 0 && status.st_uid != ::geteuid()) {
      throw WriteError("cannot write " + object + ": it is a FIFO of another user (uid " +
                       std::to_string(status.st_uid) + ")");
    }
    owned = FileDescriptor{
        ::openat(at.directory.get(), at.name.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY | follow)};
    if (!owned.is_open()) {
      throw_write_error("cannot open " + object, errno);
    }
    descriptor = owned.get();
  }

  void open_temporary() {
    constexpr mode_t kMode = 0666;  // the umask applies
    const HeldSignals held;         // until the listener knows what to remove
    owned = FileDescriptor{::openat(directory(), ".", O_TMPFILE | O_WRONLY | O_CLOEXEC, kMode)};
    for (int k = 0; !owned.is_open() && k < kMostAttempts; ++k) {
      // A file system that knows no nameless files.
      const auto name = unguessable_name(place->name);
      owned = FileDescriptor{::openat(directory(), name.c_str(),
                                      O_CREAT | O_EXCL | O_NOFOLLOW | O_WRONLY | O_CLOEXEC, kMode)};
      if (owned.is_open()) {
        temporary = name;
      } else if (errno != EEXIST) {
        break;
      }
    }
    if (!owned.is_open()) {
      throw_write_error("cannot create " + object, errno);
    }
    descriptor = owned.get();
    if (!temporary.empty()) {
      tell_listener();
    }
    struct stat replaced {};
    if (::fstatat(directory(), place->name.c_str(), &replaced, AT_SYMLINK_NOFOLLOW) == 0 &&
        replaced.st_uid == ::geteuid()) {
      ::fchmod(descriptor, replaced.st_mode & 0777U);  // best effort
    }
  }

  // A nameless file cannot replace another in one step: it is linked beside it, then renamed.
  void give_name() {
    const std::string self = "/proc/self/fd/" + std::to_string(descriptor);
    for (int k = 0; k < kMostAttempts; ++k) {
      const auto name = unguessable_name(place->name);
      if (::linkat(AT_FDCWD, self.c_str(), directory(), name.c_str(), AT_SYMLINK_FOLLOW) == 0) {
        temporary = name;
        tell_listener();
        return;
      }
      if (errno != EEXIST) {
        break;
      }
    }
    throw_write_error("cannot create " + object, errno);
  }

  void put_in_place() {
    const HeldSignals held;
    if (temporary.empty()) {
      give_name();
    }
    if (::renameat(directory(), temporary.c_str(), directory(), place->name.c_str()) != 0) {
      throw_write_error("cannot replace " + object, errno);
    }
    temporary.clear();
    tell_listener();
  }

  void discard() noexcept {
    if (!temporary.empty()) {
      ::unlinkat(directory(), temporary.c_str(), 0);
      temporary.clear();
      try {
        tell_listener();
      } catch (...) {  // a destructor has nobody to tell
      }
    }
  }
};

OutputFile::OutputFile(const fs::path& target, const TemporaryListener& listener)
    : state_(std::make_unique<State>()) {
  state_->listener = listener;
  struct stat status {};
  if (target == "-") {
    state_->object = "standard output";
    state_->descriptor = STDOUT_FILENO;
  } else if (target.empty()) {
    throw WriteError("cannot write the result: the name of the output file is empty");
  } else {
    state_->object = "\"" + target.string() + "\"";
    Place place = place_of(target, state_->object);
    const bool exists =
        ::fstatat(place.directory.get(), place.name.c_str(), &status, AT_SYMLINK_NOFOLLOW) == 0;
    if (exists && S_ISDIR(status.st_mode)) {
      throw_write_error("cannot write " + state_->object, EISDIR);
    }
    if (place.is_open_file || (exists && !S_ISREG(status.st_mode))) {
      state_->open_direct(place);
    } else {
      state_->place = std::move(place);
      state_->open_temporary();
    }
  }
  state_->buffer = std::make_unique<DescriptorBuffer>(state_->descriptor, state_->object);
  state_->stream = std::make_unique<std::ostream>(state_->buffer.get());
  state_->stream->exceptions(std::ios::badbit | std::ios::failbit);
}

OutputFile::~OutputFile() = default;
OutputFile::OutputFile(OutputFile&&) noexcept = default;
OutputFile& OutputFile::operator=(OutputFile&&) noexcept = default;

std::ostream& OutputFile::stream() noexcept { return *state_->stream; }

bool OutputFile::is_terminal() const noexcept { return ::isatty(state_->descriptor) == 1; }

void OutputFile::commit() {
  state_->stream->flush();
  // Network file systems and quotas report a failed write when a descriptor is closed; the file's
  // own is still needed to give it its name.
  FileDescriptor probe{::fcntl(state_->descriptor, F_DUPFD_CLOEXEC, 0)};
  if (!probe.is_open() || !probe.close()) {
    throw_write_error("cannot write " + state_->object, errno);
  }
  if (state_->place) {
    state_->put_in_place();
  }
}

void write_data(OutputFile& output, const std::function<void(std::ostream&)>& write, bool is_csv) {
  if (output.is_terminal()) {
    PrintableLines lines(output.stream(), is_csv);
    std::ostream stream(&lines);
    stream.exceptions(std::ios::badbit | std::ios::failbit);
    write(stream);
    lines.finish();
  } else {
    write(output.stream());
  }
  output.commit();
}

}  // namespace cie::viewer_export
