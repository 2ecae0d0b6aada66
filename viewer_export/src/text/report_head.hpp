// What the head of a report accuses a recording of, as text and on the page: only of what somebody
// claimed.
#pragma once

#include <cie/viewer_export/report_writers.hpp>

#include "verify_findings.hpp"

#include <string>
#include <vector>

namespace cie::viewer_export {

struct ReportHead {
  bool is_isolation_claimed = false;  // that every callback has a thread of its own
  std::vector<Finding> findings;      // against what is claimed
  std::string isolation;              // what was seen of it

  // Else there is nothing to judge at the head: `isolation` is a fact.
  bool has_verdict() const { return is_isolation_claimed || !findings.empty(); }
};

ReportHead report_head(const Judged& judged, const ReportContext& context);

}  // namespace cie::viewer_export
