// `cie`: chooses the subcommand, and turns errors into one line and an exit code.
#include <cie/analysis/analyzer.hpp>
#include <cie/tracepoints/nearest_name.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>
#include <cie/viewer_export/output_file.hpp>

#include "command_line.hpp"
#include "commands.hpp"
#include "exit_code.hpp"
#include "memory_limit.hpp"
#include "output.hpp"
#include "version_text.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <initializer_list>
#include <new>
#include <string_view>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

namespace cie::cli {

std::span<const Command> commands() {
  static constexpr std::array<Command, 14> kCommands{{
      {"run", "run an application with every callback on its own thread", nullptr},
      {"record", "record an application with LTTng", nullptr},
      {"collect", "receive what several machines record", nullptr},
      {"report", "response times and more, per callback", report_command},
      {"instances", "one row per run of a callback, for spreadsheets and programs",
       instances_command},
      {"events", "the events themselves, or a count of each class", events_command},
      {"verify", "does every callback have its own thread? Rules, evidence, exit code",
       verify_command},
      {"analyze", "longest response times by scheduling theory, against those observed",
       analyze_command},
      {"export", "a file for a viewer: Perfetto, or the callback graph", export_command},
      {"view", "the report and the timeline in a browser", view_command},
      {"spec", "check a scheduling spec", spec_command},
      {"diff", "two recordings side by side: what became slower", diff_command},
      {"live", "watch a running system: terminal, web page, Prometheus", live_command},
      {"doctor", "is this machine fit to trace and for real time?", doctor_command},
  }};
  return kCommands;
}

namespace {

using viewer_export::OutputFile;

std::string overview() {
  std::string text =
      R"(cie runs callbacks isolated, one thread per callback, and shows from LTTng traces that they
are, and how long they take to respond.

Usage: cie COMMAND [ARGUMENTS]

Commands:
)";
  for (const auto& command : commands()) {
    text += fmt::format("  {:<11}{}\n", command.name, command.summary);
  }
  return text +
         "\nA first session:\n"
         "  cie record -o demo -- cie run app.yaml     record while it runs; Ctrl-C ends it\n"
         "  cie report demo                            look at the numbers\n"
         "  cie verify demo                            is every callback isolated?\n"
         "  cie export demo --to perfetto -o demo.pftrace\n"
         "\ncie COMMAND --help explains a command; cie --version prints the version.\n";
}

int print(const std::string& text) {
  OutputFile out("-");
  out.stream() << text;
  out.commit();
  return ok;
}

int dispatch(Arguments arguments) {
  if (arguments.empty() || arguments.front() == "--help" || arguments.front() == "-h") {
    return print(overview());
  }
  auto name = arguments.front();
  arguments.erase(arguments.begin());
  if (name == "--version") {
    return print(version_text());
  }
  if (name == "help") {  // cie help verify
    return dispatch(arguments.empty() ? Arguments{} : Arguments{arguments.front(), "--help"});
  }
  std::vector<std::string> names{"--help", "--version", "help"};
  for (const auto& command : commands()) {
    if (command.name == name && command.run != nullptr) {
      return command.run(arguments);
    }
    names.emplace_back(command.name);
  }
  if (name == "run" || name == "record" || name == "collect") {
    start_program("cie-" + name, arguments);
  }
  throw UsageError(fmt::format("there is no command \"{}\"{}", name, did_you_mean(name, names)));
}

// A descriptor that is closed would be given to the next file that is opened, and receive what is
// meant for standard output.
void reserve_standard_descriptors() {
  for (int descriptor = ::open("/dev/null", O_RDONLY); descriptor >= 0;
       descriptor = ::open("/dev/null", O_RDONLY)) {
    if (descriptor > STDERR_FILENO) {
      ::close(descriptor);
      return;
    }
  }
}

int fail(std::string_view what, int code, std::string_view hint = "") {
  fmt::print(stderr, "cie: {}\n", printable(what));
  if (!hint.empty()) {
    fmt::print(stderr, "{}\n", hint);
  }
  return code;
}

// As programs end that do not know of the pipe: quietly, by SIGPIPE (a shell says 141). Everything
// that was held has been given back.
int end_with_the_pipe() {
  std::signal(SIGPIPE, SIG_DFL);
  std::raise(SIGPIPE);
  return unreadable;  // the signal is blocked
}

int run(const Arguments& arguments) {
  const bool is_known =
      !arguments.empty() &&
      std::any_of(commands().begin(), commands().end(), [&](const Command& command) {
        return command.name == arguments.front() && command.run != nullptr;
      });
  const auto hint = fmt::format("Try: cie {}--help", is_known ? arguments.front() + " " : "");
  try {
    return dispatch(arguments);
  } catch (const UsageError& error) {
    return fail(error.what(), usage_error, hint);
  } catch (const SpecError& error) {
    return fail(error.what(), usage_error);
  } catch (const viewer_export::ClosedPipe&) {
    return end_with_the_pipe();
  } catch (const analysis::UnreadableTrace& error) {
    return fail(error.what(), unreadable);
  } catch (const std::bad_alloc&) {
    return fail("out of memory", unreadable);
  } catch (const std::exception& error) {
    return fail(error.what(), unreadable);
  }
}

}  // namespace

}  // namespace cie::cli

int main(int argc, char** argv) {
  cie::cli::reserve_standard_descriptors();
  const cie::cli::Arguments arguments(argv + std::min(argc, 1), argv + argc);
  const auto is_one_of = [&arguments](std::initializer_list<std::string_view> names) {
    return !arguments.empty() && std::find(names.begin(), names.end(), arguments[0]) != names.end();
  };
  if (is_one_of({"run", "record", "collect"})) return cie::cli::run(arguments);
  // A closed pipe is an error of the write, so that temporary files are removed first; a file size
  // limit is an error with a message.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  cie::cli::end_with_a_message_instead_of_aborting();
  if (!is_one_of({"live", "doctor"})) cie::cli::limit_memory();
  return cie::cli::run(arguments);
}
