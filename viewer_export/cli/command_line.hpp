// Reading a subcommand's arguments: CLI11 with errors that name the remedy.
#pragma once

#include "base/program.hpp"
#include "commands.hpp"

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
}

namespace cie::cli {

// What the help says around the options.
struct HelpText {
  std::string usage;        // "cie report TRACE... [OPTIONS]"
  std::string description;  // what the command is good for
  std::string footer;       // examples and exit codes
};

// Declare what there is, then parse. The values are borrowed until then; what they hold before is
// the default. CLI11 stays behind it, which keeps the subcommands quick to compile.
class CommandLine {
 public:
  explicit CommandLine(const HelpText& help);
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  void traces(std::vector<std::filesystem::path>& value);  // TRACE...
  void argument(const std::string& name, std::string& value, const std::string& help);
  // `names` as in "-o,--output"; `type` stands for the value in the help.
  void option(const std::string& names, const std::string& type, std::string& value,
              const std::string& help);
  // The same, as often as one likes.
  void option(const std::string& names, const std::string& type, std::vector<std::string>& values,
              const std::string& help);
  void flag(const std::string& name, bool& value, const std::string& help);

  // False: help was asked for and printed. Throws UsageError; a misspelt option gets a suggestion.
  bool parse(const Arguments& arguments);

 private:
  std::unique_ptr<CLI::App> app_;
};

// Throws UsageError unless `value` is one of `available`.
void check_choice(std::string_view option, const std::string& value,
                  const std::vector<std::string>& available);

// Throws UsageError when no trace was named.
void require_traces(const std::vector<std::filesystem::path>& traces);

}  // namespace cie::cli
