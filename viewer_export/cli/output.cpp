#include "output.hpp"

#include <cie/analysis/recording.hpp>

#include "base/messages.hpp"
#include "command_line.hpp"
#include "exit_code.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
#include <array>
#include <clocale>
#include <csignal>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <new>
#include <string>
#include <string_view>
#include <system_error>

#include <langinfo.h>
#include <sys/mman.h>
#include <unistd.h>

namespace cie::cli {
namespace {

using viewer_export::OutputFile;

// The name of the temporary file, for the handler. Empty: none.
std::array<char, 4096> temporary_name{};

// Only async-signal-safe calls: removes the temporary file and dies of the signal.
extern "C" void remove_temporary(int signal_number) {
  if (temporary_name.front() != '\0') {
    ::unlink(temporary_name.data());
  }
  std::signal(signal_number, SIG_DFL);
  std::raise(signal_number);
}

bool has_no_memory() noexcept {
  constexpr std::size_t kLittle = 1 << 20;
  void* const probe =
      ::mmap(nullptr, kLittle, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  return probe == MAP_FAILED || ::munmap(probe, kLittle) != 0;
}

// What ends in a function that may not throw (libstdc++ has such) is not to be had as an exception.
std::string_view cause_of(const std::exception_ptr& error) noexcept {
  constexpr std::string_view kNoMemory = "cie: out of memory\n";
  try {
    if (error) std::rethrow_exception(error);
    if (has_no_memory()) return kNoMemory;
  } catch (const std::bad_alloc&) {
    return kNoMemory;
  } catch (...) {
  }
  return "cie: an error of ours that it cannot go on after; please report it\n";
}

[[noreturn]] void end_with_a_message() {
  if (temporary_name.front() != '\0') {
    ::unlink(temporary_name.data());
  }
  const auto text = cause_of(std::current_exception());
  const auto written = ::write(STDERR_FILENO, text.data(), text.size());
  static_cast<void>(written);
  ::_exit(unreadable);
}

void remember_temporary(const std::filesystem::path& path) {
  const auto& name = path.native();
  temporary_name.fill('\0');
  if (name.size() < temporary_name.size()) {
    std::memcpy(temporary_name.data() + 1, name.data() + (name.empty() ? 0 : 1),
                name.empty() ? 0 : name.size() - 1);
    temporary_name.front() = name.empty() ? '\0' : name.front();  // last: makes it valid
  }
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    const auto previous = std::signal(number, name.empty() ? SIG_DFL : remove_temporary);
    if (previous == SIG_IGN) {  // as nohup asks
      std::signal(number, SIG_IGN);
    }
  }
}

}  // namespace

void end_with_a_message_instead_of_aborting() noexcept { std::set_terminate(end_with_a_message); }

OutputFile open_output(const std::string& target) {
  if (analysis::is_file_of_recording(target)) {
    throw UsageError("\"" + target +
                     "\" is a file of a recording, which -o would replace; name another one");
  }
  return OutputFile(target, remember_temporary);
}

viewer_export::TextStyle text_style(bool is_terminal) {
  const auto value = [](const char* name) {
    const char* text = std::getenv(name);
    return std::string_view(text == nullptr ? "" : text);
  };
  viewer_export::TextStyle style;
  style.colour = is_terminal && value("NO_COLOR").empty() && value("TERM") != "dumb";
  return style;
}

// By setlocale(), because newlocale() tells no code set in a program without shared libraries.
bool is_utf8_locale() {
  const std::string before = std::setlocale(LC_CTYPE, nullptr);
  std::setlocale(LC_CTYPE, "");
  const bool is_utf8 = std::string_view(::nl_langinfo(CODESET)) == "UTF-8";
  std::setlocale(LC_CTYPE, before.c_str());
  return is_utf8;
}

viewer_export::TextStyle text_style(const OutputFile& output) {
  return text_style(output.is_terminal());
}

viewer_export::TextStyle screen_style(const OutputFile& output) {
  constexpr std::size_t kNarrowest = 40;
  constexpr std::size_t kFewestLines = 12;  // a headline, and what to do
  auto style = text_style(output);
  if (!output.is_terminal()) return style;
  style.columns = std::max(kNarrowest, terminal_columns(STDOUT_FILENO));
  style.lines = std::max(kFewestLines, style.lines - std::min(style.lines, told_lines()));
  style.unicode = is_utf8_locale();
  return style;
}

analysis::Progress* begin_writing(ProgressBar& bar, const OutputFile& output) {
  return output.is_terminal() ? nullptr : bar.begin("writing", ProgressUnit::instances);
}

std::filesystem::path spill_directory(const std::string& target) {
  namespace fs = std::filesystem;
  std::error_code error;
  const auto status = fs::status(target, error);
  if (target == "-" || (fs::exists(status) && !fs::is_regular_file(status))) {
    return {};
  }
  const auto parent = fs::path(target).parent_path();
  return parent.empty() ? fs::path(".") : parent;
}

}  // namespace cie::cli
