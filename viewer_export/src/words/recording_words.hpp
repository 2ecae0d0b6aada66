// What a recording says of itself, in the words of every text.
#pragma once

#include <cie/analysis/report.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cie::viewer_export {

// "cie-demo exited with status 0", "begins with chunk 3: those before are gone": printable,
// without a line end. Its problems are defects of the trace, and told as those.
std::vector<std::string> sentences_of(const analysis::RecordingReport& recording);

// "run1", or "run1 and 2 more", by the directories' names; longer ones than `most` columns are cut. Empty: it
// is known by no path.
std::string name_of_recording(const analysis::Report& report, std::size_t most = std::string::npos,
                              std::string_view gap = "...");

// "3.186 s on vm"; "1.000 s on alpha, 10.00 s on beta" where hosts were recorded for different
// times. Of more than `named` hosts none is named: "1.000 s to 10.00 s on 5 hosts".
std::string length_of(const analysis::Report& report, std::size_t named);

// Of a recording without callbacks: what is there, and what could have shown some.
std::string no_callback_seen(const analysis::Report& report);

// "the window 983990000000..985990000000 ns (2.000 s) alone": what of the recording was asked for.
std::string window_words(const analysis::TimeWindow& window);

// "discarded-events x 5"; of a problem of the recorder, what it says.
std::string name_of_defect(analysis::DefectKind kind, std::uint64_t count, std::string_view advice);

// How often the trace has such defects.
std::uint64_t count_of(const analysis::Report& report, analysis::DefectKind kind);

// Where the number of lost events is not known: "whole packets lost", or "losses unknown" where the recorder
// failed.
std::string_view unknown_losses(const analysis::Report& report);

// Whether all that happened was recorded; empty: nothing is missing that anybody knows of.
std::optional<bool> is_complete(const analysis::Report& report);

// "2 of 12 messages taken came from publishers that were not recorded"; empty: none did.
std::string unrecorded_publishers(const analysis::Report& report);

// "3 messages were not sent in time and reached nobody: 2 on /scan, 1 on /map": the most first; empty: all
// were sent.
std::string unsent_messages(const analysis::Report& report);

// "seq-gaps x 5: " and what that means: errors of the trace, then losses. Of more than two, the
// gravest and how many more there are.
std::vector<std::string> damages_of(const analysis::Report& report, std::string_view gap);

}  // namespace cie::viewer_export
