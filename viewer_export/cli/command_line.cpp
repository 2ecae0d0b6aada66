#include "command_line.hpp"

#include <cie/viewer_export/output_file.hpp>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <numeric>
#include <utility>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace cie::cli {
namespace {

// Edits (insert, delete, replace, swap neighbours) that turn one word into the other.
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> table(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    table[i][0] = i;
  }
  std::iota(table[0].begin(), table[0].end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    for (std::size_t k = 1; k <= b.size(); ++k) {
      const std::size_t replaced = table[i - 1][k - 1] + (a[i - 1] == b[k - 1] ? 0 : 1);
      table[i][k] = std::min({table[i - 1][k] + 1, table[i][k - 1] + 1, replaced});
      if (i > 1 && k > 1 && a[i - 1] == b[k - 2] && a[i - 2] == b[k - 1]) {
        table[i][k] = std::min(table[i][k], table[i - 2][k - 2] + 1);
      }
    }
  }
  return table[a.size()][b.size()];
}

// Starts with how to call the command, as manual pages do.
class UsageFirst final : public CLI::Formatter {
 public:
  explicit UsageFirst(std::string usage) : usage_(std::move(usage)) {}
  std::string make_help(const CLI::App* app, std::string, CLI::AppFormatMode) const override {
    return "Usage: " + usage_ + "\n\n" + app->get_description() + "\n" + make_positionals(app) +
           make_groups(app, CLI::AppFormatMode::Normal) + "\n" + app->get_footer();
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
  constexpr std::size_t kOptionColumn = 26;
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
    const auto name = unknown.front().substr(0, unknown.front().find('='));
    throw UsageError(
        fmt::format("unknown option \"{}\"{}", name, suggestion(name, option_names(*app_))));
  }
  return true;
}

std::string_view nearest(std::string_view word, const std::vector<std::string>& candidates) {
  constexpr std::size_t kLongest = 64;  // nobody misspells an essay
  std::string_view best;
  std::size_t best_distance = 0;
  if (word.size() > kLongest) {
    return best;
  }
  for (const auto& candidate : candidates) {
    const auto edits = distance(word, candidate);
    // A third of the letters may be wrong, and at least two.
    const bool is_near = edits <= std::max<std::size_t>(2, candidate.size() / 3) &&
                         edits < std::max(word.size(), candidate.size()) - 1;
    if (is_near && (best.empty() || edits < best_distance)) {
      best = candidate;
      best_distance = edits;
    }
  }
  return best;
}

std::string suggestion(std::string_view word, const std::vector<std::string>& candidates) {
  const auto meant = nearest(word, candidates);
  return meant.empty() ? std::string{} : fmt::format("; did you mean \"{}\"?", meant);
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
  throw UsageError(fmt::format("{} does not know \"{}\"{}{}available: {}", option, value,
                               suggestion(value, available),
                               nearest(value, available).empty() ? "; " : " ", listed(available)));
}

void require_traces(const std::vector<std::filesystem::path>& traces) {
  if (traces.empty()) {
    throw UsageError("no TRACE was given: name the directory that a recording is in");
  }
}

}  // namespace cie::cli
