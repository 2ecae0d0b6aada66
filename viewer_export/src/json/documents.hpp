// The documents that `--format json` writes, as values: the page holds them, too.
#pragma once

#include <cie/analysis/report.hpp>
#include <cie/analysis/verdict.hpp>

#include "json_text.hpp"

namespace cie::viewer_export {

void write_report(JsonText& json, const analysis::Report& report);
void write_verdicts(JsonText& json, const analysis::VerdictReport& verdicts,
                    const analysis::Report& report);

}  // namespace cie::viewer_export
