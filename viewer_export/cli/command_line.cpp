#include "command_line.hpp"

#include <cie/tracepoints/nearest_name.hpp>
#include <cie/viewer_export/output_file.hpp>

#include "words/text_layout.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <memory>
#include <utility>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace cie::cli {
namespace {

constexpr std::size_t kHelpColumns = 80;  // of a terminal that nobody made wider
constexpr std::size_t kOptionColumn = 26;

using HelpLines = std::vector<std::string>;

HelpLines lines_of(const std::string& text) {
  HelpLines lines{""};
  for (const char c : text) {
    if (c == '\n') {
      lines.emplace_back();
    } else {
      lines.back() += c;
    }
  }
  if (lines.back().empty()) lines.pop_back();
  return lines;
}

// "  COMMAND    what it does": where the second part begins, or the end.
std::size_t explanation_of(const std::string& line) {
  const auto gap = line.find("  ", line.find_first_not_of(' '));
  return gap == std::string::npos ? line.size() : line.find_first_not_of(' ', gap);
}

// Examples, which keep one column for what they do, on a line of its own where it must.
void add_examples(const HelpLines& lines, HelpLines& out) {
  constexpr std::size_t kMostIndent = 8;  // beyond it, the line above goes on
  HelpLines examples;
  for (const auto& line : lines) {
    const auto indent = line.find_first_not_of(' ');
    if (indent <= kMostIndent || examples.empty()) {
      examples.push_back(line);
    } else {
      examples.back() += ' ' + line.substr(indent);
    }
  }
  std::size_t widest = 0;
  for (const auto& line : examples)
    widest = std::max(widest, line.size() - explanation_of(line));
  const auto column = kHelpColumns - std::min(widest, kHelpColumns - kOptionColumn);
  for (const auto& line : examples) {
    const auto begin = explanation_of(line);
    auto text = line.substr(0, line.find_last_not_of(' ', begin - 1) + 1);
    for (const auto& part : viewer_export::wrap(line.substr(begin), kHelpColumns - column)) {
      if (text.size() + 2 > column) {
        out.push_back(text);
        text.clear();
      }
      text.resize(column, ' ');
      out.push_back(std::exchange(text, {}) + part);
    }
    if (!text.empty()) out.push_back(text);
  }
}

// Paragraphs and examples, each laid out anew where a line of it is too wide.
std::string in_columns(const std::string& text) {
  const auto lines = lines_of(text);
  const auto kind_of = [](const std::string& line) {
    return line.empty() ? 'e' : line.front() == ' ' ? 'x' : 'p';
  };
  HelpLines out;
  for (auto line = lines.begin(); line != lines.end();) {
    const auto end = std::find_if(std::next(line), lines.end(), [&](const std::string& next) {
      return kind_of(next) != kind_of(*line) || next.starts_with("Exit ");
    });
    const HelpLines block(line, end);
    const bool is_wide = std::ranges::any_of(
        block, [](const std::string& row) { return row.size() > kHelpColumns; });
    if (is_wide && kind_of(*line) == 'x') {
      add_examples(block, out);
    } else if (is_wide) {
      std::ranges::move(viewer_export::wrap(fmt::format("{}", fmt::join(block, " ")), kHelpColumns),
                        std::back_inserter(out));
    } else {
      out.insert(out.end(), block.begin(), block.end());
    }
    line = end;
  }
  return fmt::format("{}\n", fmt::join(out, "\n"));
}

// Starts with how to call the command, as manual pages do.
class UsageFirst final : public CLI::Formatter {
 public:
  explicit UsageFirst(std::string usage) : usage_(std::move(usage)) {}
  std::string make_help(const CLI::App* app, std::string, CLI::AppFormatMode) const override {
    return in_columns("Usage: " + usage_ + "\n\n" + app->get_description()) +
           make_positionals(app) + make_groups(app, CLI::AppFormatMode::Normal) + "\n" +
           in_columns(app->get_footer());
  }
  std::string make_option_desc(const CLI::Option* option) const override {
    auto text = CLI::Formatter::make_option_desc(option);
    std::ranges::replace(text, '\n', ' ');
    return fmt::format("{}",
                       fmt::join(viewer_export::wrap(text, kHelpColumns - kOptionColumn), "\n"));
  }

 private:
  std::string usage_;
};

std::string listed(const std::vector<std::string>& words) {
  std::string result;
  for (const auto& word : words) {
    result += (result.empty() ? "" : ", ") + word;
  }
  return result;
}

std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const auto* option : app.get_options()) {
    for (const auto& name : option->get_lnames()) {
      names.push_back("--" + name);
    }
    for (const auto& name : option->get_snames()) {
      names.push_back("-" + name);
    }
  }
  return names;
}

}  // namespace

CommandLine::CommandLine(const HelpText& help)
    : app_(std::make_unique<CLI::App>(help.description)) {
  app_->footer(help.footer);
  app_->formatter(std::make_shared<UsageFirst>(help.usage));
  app_->get_formatter()->column_width(kOptionColumn);
  app_->get_formatter()->label("Positionals", "Arguments");
  app_->set_help_flag("-h,--help", "Print this help");
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
    throw UsageError(error.what());
  }
  const auto unknown = app_->remaining();
  if (!unknown.empty()) {
    if (!unknown.front().starts_with('-')) {
      throw UsageError(fmt::format("one argument too many: \"{}\"", unknown.front()));
    }
    const auto name = unknown.front().substr(0, unknown.front().find('='));
    throw UsageError(
        fmt::format("unknown option \"{}\"{}", name, did_you_mean(name, option_names(*app_))));
  }
  return true;
}

void check_choice(std::string_view option, const std::string& value,
                  const std::vector<std::string>& available,
                  const std::vector<std::string>& planned) {
  if (std::find(available.begin(), available.end(), value) != available.end()) {
    return;
  }
  if (std::find(planned.begin(), planned.end(), value) != planned.end()) {
    throw UsageError(fmt::format("{} {} is not available in this version; available: {}", option,
                                 value, listed(available)));
  }
  throw UsageError(fmt::format(
      "{} does not know \"{}\"{}{}available: {}", option, value, did_you_mean(value, available),
      nearest_name(value, available).empty() ? "; " : " ", listed(available)));
}

void require_traces(const std::vector<std::filesystem::path>& traces) {
  if (traces.empty()) {
    throw UsageError("no TRACE was given: name the directory that a recording is in");
  }
}

}  // namespace cie::cli
