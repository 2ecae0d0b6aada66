// `cie`: chooses the subcommand.
#include <cie/tracepoints/nearest_name.hpp>

#include "command_line.hpp"
#include "commands.hpp"
#include "memory.hpp"
#include "program.hpp"
#include "version_text.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include <fmt/format.h>

namespace cie::cli {

std::span<const Command> commands() {
  static constexpr std::array<Command, 14> kCommands{{
      {"run", "run an application with every callback on its own thread", nullptr},
      {"record", "record an application with LTTng", nullptr},
      {"collect", "receive what several machines record", nullptr},
      {"report", "response times and more, per callback", report_command},
      {"instances", "one row per instance of a callback, for spreadsheets and programs",
       instances_command},
      {"events", "the events themselves, or a count of each class", events_command},
      {"verify", "does every callback have its own thread? Rules, evidence, exit code",
       verify_command},
      {"analyze", "longest response times by scheduling theory, against those observed",
       analyze_command},
      {"export", "a file for a viewer: Perfetto, or the callback graph", export_command},
      {"view", "the report and the timeline in a browser", view_command},
      {"spec", "check a scheduling spec, or write one from a recording", spec_command},
      {"diff", "two recordings side by side: what became slower", diff_command},
      {"live", "watch a running system: terminal, web page, Prometheus", nullptr},
      {"doctor", "is this machine fit to trace and for real time?", doctor_command},
  }};
  return kCommands;
}

namespace {

std::string overview() {
  std::string text =
      R"(cie runs callbacks isolated, one thread per callback, and shows from LTTng
traces that they are, and how long they take to respond.

Usage: cie COMMAND [ARGUMENTS]

Commands:
)";
  for (const auto& command : commands()) {
    text += fmt::format("  {:<11}{}\n", command.name, command.summary);
  }
  return text +
         "\nA first session:\n"
         "  cie record -o demo -- cie run app.yaml    record while it runs; Ctrl-C ends it\n"
         "  cie report demo                           look at the numbers\n"
         "  cie verify demo                           is every callback isolated?\n"
         "  cie export demo --to perfetto -o demo.pftrace\n"
         "\ncie COMMAND --help explains a command; cie --version prints the version.\n";
}

const Command* find_command(std::string_view name) {
  const auto all = commands();
  const auto* const found = std::ranges::find(all, name, &Command::name).base();
  return found == all.data() + all.size() ? nullptr : found;
}

int dispatch(Arguments arguments) {
  if (arguments.empty() || arguments.front() == "--help" || arguments.front() == "-h") {
    return print_text(overview());
  }
  auto name = arguments.front();
  arguments.erase(arguments.begin());
  if (name == "--version") {
    return print_text(version_text());
  }
  if (name == "help") {  // cie help verify
    return dispatch(arguments.empty() ? Arguments{} : Arguments{arguments.front(), "--help"});
  }
  if (const auto* command = find_command(name)) {
    if (command->run == nullptr) start_program("cie-" + name, arguments);
    return command->run(arguments);
  }
  std::vector<std::string> names{"--help", "--version", "help"};
  for (const auto& command : commands())
    names.emplace_back(command.name);
  throw UsageError(fmt::format("there is no command \"{}\"{}", name, did_you_mean(name, names)));
}

}  // namespace

}  // namespace cie::cli

int main(int argc, char** argv) {
  using namespace cie::cli;
  reserve_standard_descriptors();
  const Arguments arguments(argv + std::min(argc, 1), argv + argc);
  const auto* command = arguments.empty() ? nullptr : find_command(arguments.front());
  const bool is_here = command == nullptr || command->run != nullptr;
  if (is_here) {
    turn_signals_into_errors();
    if (command == nullptr || command->name != "doctor") prepare_memory();
  }
  const bool has_help = command != nullptr && is_here;
  return run_command([](const Arguments& all) { return dispatch(all); }, arguments,
                     has_help ? "cie " + arguments.front() : "cie");
}
