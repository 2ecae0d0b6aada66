#include "command_line.hpp"

#include <cie/tracepoints/nearest_name.hpp>
#include <cie/viewer_export/output_file.hpp>

#include "base/help_text.hpp"
#include "base/text.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <memory>
#include <utility>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace cie::cli {

CommandLine::CommandLine(const HelpText& help)
    : app_(std::make_unique<CLI::App>(help.description)) {
  app_->footer(help.footer);
  lay_out_help(*app_, help.usage);
  app_->allow_extras();  // judged below, with a suggestion
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
  try {
    app_->parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
  } catch (const CLI::CallForHelp&) {
    viewer_export::OutputFile out("-");
    out.stream() << app_->help();
    out.commit();
    return false;
  } catch (const CLI::ParseError& error) {
    throw UsageError(in_words_of_help(*app_, error));
  }
  if (const auto unexpected = unexpected_argument(*app_); !unexpected.empty())
    throw UsageError(unexpected);
  return true;
}

void check_choice(std::string_view option, const std::string& value,
                  const std::vector<std::string>& available) {
  if (std::find(available.begin(), available.end(), value) != available.end()) {
    return;
  }
  throw UsageError(fmt::format(
      "{} does not know \"{}\"{}{}available: {}", option, value, did_you_mean(value, available),
      nearest_name(value, available).empty() ? "; " : " ", joined(available)));
}

void require_traces(const std::vector<std::filesystem::path>& traces) {
  if (traces.empty()) {
    throw UsageError("no TRACE was given: name the directory that a recording is in");
  }
}

}  // namespace cie::cli
