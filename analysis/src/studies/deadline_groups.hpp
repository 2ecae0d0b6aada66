// The SCHED_DEADLINE threads of a report by the CPUs that they share, and whether they can all keep
// their deadlines.
#pragma once

#include <cie/analysis/report_rows.hpp>
#include <cie/analysis/schedulability.hpp>

#include <vector>

namespace cie::analysis {

// Threads whose sets of CPUs overlap, directly or by others: the kernel admits and schedules them
// together (a root domain, sched-deadline.rst of Linux).
struct DeadlineGroup {
  std::vector<const ThreadReport*> threads;
  HostIndex host{};
  DeadlineAdmission admission{};
};

// By host, then by the least CPU.
std::vector<DeadlineGroup> deadline_groups(const Report& report, const ReportRows& rows);

}  // namespace cie::analysis
