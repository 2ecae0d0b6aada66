// Where the subcommands write, and how.
#pragma once

#include <cie/analysis/progress.hpp>
#include <cie/viewer_export/output_file.hpp>
#include <cie/viewer_export/text_style.hpp>

#include "progress_bar.hpp"

#include <string>
#include <string_view>

namespace cie::cli {

// The target of `-o`: a file, or "-". A temporary file vanishes when a signal ends the program.
viewer_export::OutputFile open_output(const std::string& target);

// From now on what no exception can leave ends the program as other errors do, with a message and
// the exit code of errors of ours, and not by a signal: lack of memory within the standard
// library's noexcept functions, for one. A temporary file is removed.
void end_with_a_message_instead_of_aborting() noexcept;

// Colours on a terminal that has them and unless NO_COLOR is set (https://no-color.org).
viewer_export::TextStyle text_style(const viewer_export::OutputFile& output);
viewer_export::TextStyle text_style(bool is_terminal);
// Not thread-safe: asks setlocale().
bool is_utf8_locale();
// The same as wide as the terminal, with symbols where its locale has them.
viewer_export::TextStyle screen_style(const viewer_export::OutputFile& output);

// Where to count the instances written to `output`; null if nothing is drawn: `output` may be the
// terminal itself.
analysis::Progress* begin_writing(ProgressBar& bar, const viewer_export::OutputFile& output);

// Where sorting may spill: beside the output file, else empty (TMPDIR).
std::filesystem::path spill_directory(const std::string& target);

}  // namespace cie::cli
