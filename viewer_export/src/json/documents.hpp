// The documents that `--format json` writes, as values: the page holds them, too.
#pragma once

#include <cie/analysis/report.hpp>
#include <cie/analysis/verdict.hpp>

#include "json.hpp"

namespace cie::viewer_export {

Json report_json(const analysis::Report& report);
Json verify_json(const analysis::VerdictReport& verdicts, const analysis::Report& report);

}  // namespace cie::viewer_export
