// The exports behind viewer_exports.hpp, and what they share.
#pragma once

#include <cie/viewer_export/viewer_exports.hpp>

#include "recorded_run.hpp"

#include <map>
#include <memory>
#include <string>
#include <utility>

namespace cie::viewer_export {

// Keeps everything it is told for write(), which begins when the analysis has finished.
class RecordingExport : public ViewerExport {
 public:
  explicit RecordingExport(const ViewerOptions& options)
      : run_(options.records_in_memory, options.spill_directory) {}

  void on_instance(const analysis::Instance& instance) override { run_.add(instance); }
  void on_publication(const analysis::Publication& publication) override { run_.add(publication); }
  void show_progress(analysis::Progress* progress) override { run_.show_progress(progress); }

 protected:
  RecordedRun& run() noexcept { return run_; }
  // What the run itself counted, after replay().
  void add_to(ViewerCounts& counts) const noexcept {
    counts.flows = run_.deliveries();
    counts.backward_flows = run_.backward_deliveries();
    counts.skipped += run_.skipped();
  }

 private:
  RecordedRun run_;
};

// The report's names of processes and threads, valid UTF-8.
class ReportNames {
 public:
  explicit ReportNames(const analysis::Report& report);
  // Empty where the report has none. Of several programs that had the pid one after the other all that
  // differ: "launch, then driver".
  std::string process(analysis::HostIndex host, std::int64_t pid) const;
  // Of this one of them.
  std::string process(analysis::ProcessIndex index) const;
  std::string thread(const ThreadKey& thread) const;
  const std::map<ThreadKey, std::string>& threads() const noexcept { return threads_; }
  // The process's host; empty where the report has none.
  std::string host(analysis::HostIndex host, std::int64_t pid) const;
  bool has_several_hosts() const noexcept { return has_several_hosts_; }

 private:
  struct Process {
    std::string name;
    std::string host;
  };
  std::map<std::pair<analysis::HostIndex, std::int64_t>, Process> processes_;
  std::map<analysis::ProcessIndex, std::string> programs_;
  std::map<ThreadKey, std::string> threads_;
  bool has_several_hosts_ = false;
};

std::unique_ptr<ViewerExport> make_chrome_export(const ViewerOptions& options);
std::unique_ptr<ViewerExport> make_speedscope_export(const ViewerOptions& options);
std::unique_ptr<ViewerExport> make_otlp_export(const ViewerOptions& options);
std::unique_ptr<ViewerExport> make_mcap_export(const ViewerOptions& options);

}  // namespace cie::viewer_export
