#include "command_line.hpp"

#include <cie/viewer_export/output_file.hpp>

#include "base/help_text.hpp"

#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace cie::cli {

CommandLine::CommandLine(const HelpText& help)
    : app_(std::make_unique<CLI::App>(help.description)) {
  app_->footer(help.footer);
  lay_out_help(*app_, help.usage);
}

CommandLine::~CommandLine() = default;

void CommandLine::traces(std::vector<std::filesystem::path>& value) {
  app_->add_option("TRACE", value, "Directories of recordings (CTF traces below them)")
      ->type_name("");
}

void CommandLine::argument(const std::string& name, std::string& value, const std::string& help) {
  app_->add_option(name, value, help)->type_name("");
}

void CommandLine::option(const std::string& names, const std::string& type, std::string& value,
                         const std::string& help) {
  app_->add_option(names, value, help)->type_name(type);
}

void CommandLine::option(const std::string& names, const std::string& type,
                         std::vector<std::string>& values, const std::string& help) {
  // One value each: what follows may be a TRACE.
  app_->add_option(names, values, help)->type_name(type)->allow_extra_args(false);
}

void CommandLine::flag(const std::string& name, bool& value, const std::string& help) {
  app_->add_flag(name, value, help);
}

bool CommandLine::parse(const Arguments& arguments) {
  const auto help = parse_arguments(*app_, arguments);
  if (!help) return true;
  viewer_export::OutputFile out("-");
  out.stream() << *help;
  out.commit();
  return false;
}

void check_choice(std::string_view option, const std::string& value,
                  const std::vector<std::string>& available) {
  if (const auto complaint = one_of(available)(value); !complaint.empty())
    throw UsageError(fmt::format("{} {}", option, complaint));
}

void require_traces(const std::vector<std::filesystem::path>& traces) {
  if (traces.empty()) {
    throw UsageError("no TRACE was given: name the directory that a recording is in");
  }
}

}  // namespace cie::cli
