#include "help_text.hpp"

#include <cie/tracepoints/nearest_name.hpp>
#include <cie/tracepoints/text_columns.hpp>

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <iterator>
#include <memory>
#include <regex>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace cie {
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
    for (const auto& part : wrap(line.substr(begin), kHelpColumns - column)) {
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
      std::ranges::move(wrap(fmt::format("{}", fmt::join(block, " ")), kHelpColumns),
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
    auto options = make_positionals(app) + make_groups(app, CLI::AppFormatMode::Normal);
    options.erase(options.find_last_not_of('\n') + 1);  // a hidden group leaves a blank line
    return in_columns("Usage: " + usage_ + "\n\n" + app->get_description()) + options + "\n\n" +
           in_columns(app->get_footer());
  }
  std::string make_option_opts(const CLI::Option* option) const override {
    if (option->get_type_size() == 0) return {};
    const auto& told = option->get_option_text();
    auto text = told.empty() ? option->get_type_name() : told;
    if (!text.empty()) text.insert(0, " ");
    if (option->get_expected_max() == CLI::detail::expected_max_vector_size) text += " ...";
    return text;
  }
  std::string make_option_desc(const CLI::Option* option) const override {
    auto text = CLI::Formatter::make_option_desc(option);
    std::ranges::replace(text, '\n', ' ');
    return fmt::format("{}", fmt::join(wrap(text, kHelpColumns - kOptionColumn), "\n"));
  }

 private:
  std::string usage_;
};

std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const auto* option : app.get_options()) {
    for (const auto& name : option->get_lnames())
      names.push_back("--" + name);
    for (const auto& name : option->get_snames())
      names.push_back("-" + name);
  }
  return names;
}

// "1000000" of what versions of the library write as "1000000.000000" or "1e+06".
std::string without_zeros(const std::string& number) {
  if (number.find_first_of(".e") == std::string::npos) return number;
  double value = 0;
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), value);
  const bool is_number = error == std::errc() && end == number.data() + number.size();
  return is_number ? fmt::format("{}", value) : number;
}

// "--rotate SECONDS".
std::string with_value(const CLI::App& app, const std::string& name) {
  const auto* option = app.get_option_no_throw(name);
  const auto value = option == nullptr                    ? std::string()
                     : !option->get_option_text().empty() ? option->get_option_text()
                                                          : option->get_type_name();
  return value.empty() ? name : name + ' ' + value;
}

std::string needs_value(const CLI::App& app, const std::string& name) {
  return name + " needs a value: " + with_value(app, name);
}

}  // namespace

std::function<std::string(const std::string&)> one_of(std::vector<std::string> values) {
  return [values = std::move(values)](const std::string& value) {
    if (std::ranges::find(values, value) != values.end()) return std::string();
    const auto likely = did_you_mean(value, values);
    return fmt::format("does not know \"{}\"{}{}available: {}", value, likely,
                       likely.empty() ? "; " : " ", fmt::join(values, ", "));
  };
}

std::string unexpected_argument(const CLI::App& app) {
  const auto unknown = app.remaining();
  // CLI11 keeps the mark behind which everything is an argument.
  const auto left = std::find_if(unknown.begin(), unknown.end(),
                                 [](const std::string& word) { return word != "--"; });
  if (left == unknown.end()) return {};
  const auto& first = *left;
  if (!first.starts_with('-')) return fmt::format("one argument too many: \"{}\"", first);
  const auto name = first.substr(0, first.find('='));
  return fmt::format("unknown option \"{}\"{}", name, did_you_mean(name, option_names(app)));
}

std::string empty_value(const CLI::App& app) {
  const auto is_empty = [](const CLI::Option* option) {
    const auto& given = option->results();
    return option->get_items_expected_min() > 0 &&
           std::ranges::find(given, std::string()) != given.end();
  };
  for (const auto* option : app.get_options()) {
    if (!is_empty(option)) continue;
    if (option->get_positional()) return option->get_name(true) + " is empty";
    const auto& names = option->get_lnames();
    return needs_value(app,
                       names.empty() ? '-' + option->get_snames().front() : "--" + names.front());
  }
  return {};
}

std::string in_words_of_help(const CLI::App& app, const CLI::ParseError& error) {
  static const std::regex missing(R"((-\S+): 1 required .* missing)");
  static const std::regex repeated(R"((-\S+): At Most 1 required but received \d+)");
  static const std::regex out_of_range(
      R"((-\S+): Value (\S+) not in range \[?(\S+) (?:to|-) ([^\]\s]+)\]?)");
  static const std::regex no_size(R"((-\S+): .*unit not recognized.*)");
  std::string text = error.what();
  std::smatch found;
  if (std::regex_match(text, found, missing)) {
    return needs_value(app, found.str(1));
  }
  if (std::regex_match(text, found, repeated)) return found.str(1) + " is given more than once";
  if (std::regex_match(text, found, out_of_range)) {
    return fmt::format("{} takes {} to {}, and not {}", with_value(app, found.str(1)),
                       without_zeros(found.str(3)), without_zeros(found.str(4)), found.str(2));
  }
  if (std::regex_match(text, found, no_size)) {
    return with_value(app, found.str(1)) + " takes a size such as 4096, 512k or 4m";
  }
  return text;
}

void lay_out_help(CLI::App& app, const std::string& usage) {
  app.formatter(std::make_shared<UsageFirst>(usage));
  app.get_formatter()->column_width(kOptionColumn);
  app.get_formatter()->label("Positionals", "Arguments");
  app.set_help_flag("-h,--help", "Print this help");
}

}  // namespace cie
