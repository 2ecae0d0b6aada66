// The help of programs that parse with CLI11.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace cie {

// Starts with how to call the program ("cie report TRACE... [OPTIONS]"), as manual pages do, and fits into 80
// columns: options; paragraphs and blocks of examples (indented lines) in which a line is wider.
void lay_out_help(CLI::App& app, const std::string& usage);

}  // namespace cie
