// The SCHED_DEADLINE threads of a report by the CPUs that they share, and whether they can all keep
// their deadlines.
#pragma once

#include <cie/analysis/report_rows.hpp>
#include <cie/analysis/schedulability.hpp>

#include <map>
#include <vector>

namespace cie::analysis {

// Threads whose sets of CPUs overlap, directly or by others (sched-deadline.rst of Linux admits such
// together, as a root domain).
struct DeadlineGroup {
  // Whether the deadlines of each are guaranteed, by what lived while it did.
  std::map<const ThreadReport*, bool> threads;
  HostIndex host{};
  DeadlineAdmission admission{};
};

// By host, then by the least CPU.
std::vector<DeadlineGroup> deadline_groups(const Report& report, const ReportRows& rows);

}  // namespace cie::analysis
