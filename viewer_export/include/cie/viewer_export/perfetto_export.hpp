// `cie export --to perfetto`: a trace that ui.perfetto.dev and trace_processor open.
#pragma once

#include <cie/analysis/analyzer.hpp>
#include <cie/analysis/instance.hpp>
#include <cie/analysis/progress.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <ostream>

namespace cie::viewer_export {

struct PerfettoOptions {
  bool gzip = false;                        // the viewer and trace_processor read it as it is
  std::filesystem::path spill_directory{};  // empty: $TMPDIR or /tmp
  std::size_t records_in_memory = 65536;    // of each kind; the rest goes to temporary files
};

// What the file holds, for the message to the user and for tests.
struct PerfettoCounts {
  std::uint64_t callback_slices = 0;
  std::uint64_t waits = 0;  // release to start
  std::uint64_t publications = 0;
  std::uint64_t flows = 0;           // publish to callback
  std::uint64_t backward_flows = 0;  // received before published: clocks disagree; not drawn
  std::uint64_t sched_slices = 0;
  std::uint64_t wakings = 0;
  std::uint64_t response_values = 0;  // on the curves of response times
  std::uint64_t queue_changes = 0;    // on the curves of queue depths
  std::uint64_t violations = 0;       // pieces of evidence on the track "Enforcement"
  std::uint64_t skipped = 0;  // could not be drawn: times before zero, an end before its start
};

// Collects what the analysis tells its observers, then writes it. Memory is bounded but for one bit
// per instance and the names. Not thread-safe.
class PerfettoExport final : public analysis::Observer {
 public:
  explicit PerfettoExport(const PerfettoOptions& options);
  ~PerfettoExport() override;
  PerfettoExport(const PerfettoExport&) = delete;
  PerfettoExport& operator=(const PerfettoExport&) = delete;

  // Throw WriteError when temporary files cannot be written.
  void on_instance(const analysis::Instance& instance) override;
  void on_publication(const analysis::Publication& publication) override;
  void on_sched_slice(const analysis::SchedSlice& slice) override;
  void on_waking(const analysis::Waking& waking) override;

  // Where to count the instances written; borrowed, null: nowhere.
  void show_progress(analysis::Progress* progress);
  // `result` gives processes and threads their names, and the violations. Call it once, after the
  // analysis has finished. Throws what the stream throws, and WriteError.
  PerfettoCounts write(std::ostream& out, const analysis::AnalysisResult& result);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace cie::viewer_export
