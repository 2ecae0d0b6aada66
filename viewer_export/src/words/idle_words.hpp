// A thread that is runnable while its CPU is idle is preempted by nobody: the kernel holds it back.
#pragma once

#include <cie/analysis/report_rows.hpp>

#include <optional>
#include <string>
#include <vector>

namespace cie::viewer_export {

// Why, as far as the recording decides: "throttled: its SCHED_DEADLINE runtime of 5.000 ms was used
// up". `thread`: null where it is not known. `executed`: by one instance that did not block.
std::string why_cpu_was_idle(const analysis::ThreadReport* thread,
                             std::optional<analysis::Duration> executed);
// Of all instances of a callback.
std::string why_cpu_was_idle(const analysis::ReportRows& rows,
                             const analysis::CallbackReport& callback);

// The one thread that a callback ran on; null: it ran on none or on several.
const analysis::ThreadReport* only_thread_of(const analysis::ReportRows& rows,
                                             const analysis::CallbackReport& callback);

// Of a list: for how long the CPU was idle, and the thread that preempted it longest; null: none did.
analysis::Duration idle_time(const std::vector<analysis::Preemptor>& preempted_by);
const analysis::Preemptor* first_preemptor(const std::vector<analysis::Preemptor>& preempted_by);

}  // namespace cie::viewer_export
