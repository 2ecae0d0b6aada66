// From traces to report and verdicts in one pass.
#pragma once

#include <cie/analysis/event.hpp>
#include <cie/analysis/instance.hpp>
#include <cie/analysis/progress.hpp>
#include <cie/analysis/recording.hpp>
#include <cie/analysis/report.hpp>
#include <cie/analysis/verdict.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace cie::analysis {

class EventBatch;

struct AnalysisOptions {
  const SchedulingSpec* spec = nullptr;  // borrowed; null: nothing specified
  bool require_lossless = false;         // T2 fails on any loss
  bool allow_crash = false;              // T4 does not mind an interrupted process
  // For analyze(): metadata of a recording of the same configuration, for traces whose own cannot
  // be read. Empty: such traces are refused.
  std::filesystem::path metadata_from{};
  // For analyze(): the content of each file is held against its recording's manifest, too.
  bool is_content_checked = false;
  // Counts and judges instances within it alone. State from before holds in it, and numbers and
  // totals from outside prove that nothing in it is missing; what an edge cuts is listed as such.
  std::optional<TimeWindow> window{};
  // The events come from a system that runs: no stream's silence or end holds others up or cuts
  // them off, a running process is not an interrupted one, and losses are kept in bounded memory.
  bool is_live = false;
  // False: of all rules only those judge that the report rests on, and only subjects that do not
  // pass are kept, as they come.
  bool is_judged = true;
  // Summaries of callbacks have their histograms (Summary::buckets).
  bool keep_buckets = false;
  // analyze() counts here the bytes that it has read. Borrowed; null: it does not count.
  Progress* progress = nullptr;
};

struct AnalysisResult {
  Report report;
  VerdictReport verdicts;
};

// The input cannot be read at all (T1): what() says what, where and what to do.
class UnreadableTrace : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// AnalysisOptions::window was given for hosts whose clocks differ: what() names two.
class SeveralClocks : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Feed it events in order of time, then finish() once. Not thread-safe. Memory grows with
// callbacks, threads and processes, not with time.
class Analyzer {
 public:
  // `observer` may be null; it is borrowed until finish() returns.
  explicit Analyzer(const AnalysisOptions& options, Observer* observer = nullptr);
  ~Analyzer();
  Analyzer(Analyzer&&) noexcept;
  Analyzer& operator=(Analyzer&&) noexcept;

  void consume(const Event& event);
  // Each event of a reader of this library.
  void consume(const EventBatch& batch);
  // What the recordings that the events come from say of themselves: before finish().
  void add(std::vector<Recording> recordings);
  // What finish() would say of the events so far, but for instances that have begun and not ended,
  // or wait for the kernel's events: they count in a later one. Of those that have begun R3 and
  // CallbackReport::longest_open tell. More events may follow. Takes time with the number of
  // subjects, not with that of events.
  AnalysisResult look();
  // Throws SeveralClocks.
  AnalysisResult finish();

 private:
  friend AnalysisResult analyze(Analyzer& analyzer, std::span<const std::filesystem::path> traces,
                                const AnalysisOptions& options);
  struct Pipeline;
  std::unique_ptr<Pipeline> pipeline_;
};

// Reads the traces (directories; each is searched for CTF traces below it) merged by time and runs
// the analyzer over them. Throws UnreadableTrace and SeveralClocks; trouble short of that is in the
// report.
AnalysisResult analyze(std::span<const std::filesystem::path> traces,
                       const AnalysisOptions& options, Observer* observer = nullptr);
// The same with an analyzer that was made with these options and has seen nothing yet, so that its
// owner says when it, and what reading took, is destroyed: some twentieth of the time of all.
AnalysisResult analyze(Analyzer& analyzer, std::span<const std::filesystem::path> traces,
                       const AnalysisOptions& options);

// Throws UnreadableTrace unless the trace is a directory.
void require_trace_directory(const std::filesystem::path& trace);

// What the recording covers: the window of its report, without the analysis. Reads all of it. Empty
// without packets. Throws UnreadableTrace and SeveralClocks.
std::optional<TimeWindow> recorded_window(std::span<const std::filesystem::path> traces,
                                          const AnalysisOptions& options);

}  // namespace cie::analysis
