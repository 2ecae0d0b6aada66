// Which callbacks are told first, as text and on the page.
#pragma once

#include <cie/analysis/report.hpp>

#include <vector>

namespace cie::viewer_export {

// Those that ran: late ones by how much of their deadline they took, then the slowest; what ran but
// once or to start others up stands behind.
std::vector<const analysis::CallbackReport*> worst_first(const analysis::Report& report);

// It ran but once, or to start others up.
bool ran_at_start(const analysis::CallbackReport& callback);

}  // namespace cie::viewer_export
