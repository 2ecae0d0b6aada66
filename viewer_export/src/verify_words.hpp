// What every format of `cie verify` says in the same words.
#pragma once

#include <cie/analysis/report.hpp>
#include <cie/analysis/verdict.hpp>

#include <string>

namespace cie::viewer_export {

// "at 12 ns (3 ns into the trace)  callback_start  cpu 0  pid 1  tid 2  what it shows", printable.
std::string evidence_line(const analysis::Evidence& evidence, const analysis::Report& report);

// The first evidence's note, for formats that have room for one line; the verdict if there is none.
std::string headline_of(const analysis::SubjectVerdict& subject);

}  // namespace cie::viewer_export
