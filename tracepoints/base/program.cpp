#include "program.hpp"

#include "help_text.hpp"
#include "messages.hpp"

#include <exception>

#include <CLI/CLI.hpp>

namespace cie {

std::optional<std::string> parse_arguments(CLI::App& app,
                                           const std::vector<std::string>& arguments) {
  app.allow_extras();  // judged below, with a suggestion
  try {
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
  } catch (const CLI::CallForHelp&) {
    return app.help();
  } catch (const CLI::CallForVersion& version) {
    return std::string(version.what()) + '\n';
  } catch (const CLI::ParseError& error) {
    throw UsageError(in_words_of_help(app, error));
  }
  if (const auto unexpected = unexpected_argument(app); !unexpected.empty())
    throw UsageError(unexpected);
  if (const auto empty = empty_value(app); !empty.empty()) throw UsageError(empty);
  return std::nullopt;
}

int run_program(std::string_view command, std::string_view speaker,
                const std::function<int()>& body) {
  try {
    return body();
  } catch (const UsageError& error) {
    tell_wrong_usage(error.what(), command);
    return kWrongUsage;
  } catch (const std::exception& error) {
    tell(error.what(), speaker);
  } catch (...) {
    tell("unknown exception", speaker);
  }
  return kFailed;
}

}  // namespace cie
