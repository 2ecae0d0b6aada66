// What is around the command in each program of the command line.
#pragma once

#include "commands.hpp"

#include <string>

namespace cie::cli {

// A descriptor that is closed would be given to the next file that is opened, and receive what is
// meant for standard output. Before anything is opened.
void reserve_standard_descriptors();

// From now on a closed pipe is an error of the write, so that temporary files are removed first; a
// file size limit is an error with a message, and so is what would abort. Programs that are started
// in place of this one would inherit it.
void turn_signals_into_errors();

// Runs the command that is called `name`, as in "cie report". Its errors become one line, a wrong usage also
// one with the help to ask for, and the exit code that stands for them.
int run_command(int (*command)(const Arguments&), const Arguments& arguments,
                const std::string& name);

// Prints to standard output. The exit code is that of success.
int print_text(const std::string& text);

}  // namespace cie::cli
