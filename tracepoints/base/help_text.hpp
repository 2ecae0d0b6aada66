// The help of programs that parse with CLI11.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace cie {

// Starts with how to call the program ("cie report TRACE... [OPTIONS]"), as manual pages do, and fits into 80
// columns: options; paragraphs and blocks of examples (indented lines) in which a line is wider.
// What stands for an option's value is its option_text, else its type_name; which options go together is told
// in words.
void lay_out_help(CLI::App& app, const std::string& usage);

// A check of CLI11: what is wrong with a value that is none of these; empty if nothing is.
std::function<std::string(const std::string&)> one_of(std::vector<std::string> values);

// What of the parsed arguments nothing takes, and what was probably meant; empty if there is nothing. The app
// must allow extras.
std::string unexpected_argument(const CLI::App& app);

// The first option or argument whose value is empty, as where a script's variable is unset: what it needs; empty
// if there is none.
std::string empty_value(const CLI::App& app);

// What CLI11 says of a wrong command line, in the words of the help: which option, what it takes.
std::string in_words_of_help(const CLI::App& app, const CLI::ParseError& error);

}  // namespace cie
